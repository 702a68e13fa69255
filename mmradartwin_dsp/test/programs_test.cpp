// The offline programs as a user runs them: what they print, leave behind and return.

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>

#include "test_session_folder.h"

namespace mmradartwin {
namespace {

struct Outcome {
  int status;
  std::string errors;
};

/// Runs a program; its stderr is kept.
Outcome run(const std::string& command) {
  std::FILE* pipe = ::popen((command + " 2>&1 >/dev/null").c_str(), "r");
  Outcome result = {-1, ""};
  std::array<char, 4096> buffer;
  for (std::size_t got; (got = std::fread(buffer.data(), 1, buffer.size(), pipe)) > 0;)
    result.errors.append(buffer.data(), got);
  result.status = WEXITSTATUS(::pclose(pipe));
  return result;
}

const std::string kProcess = MMRADARTWIN_PROCESS;

TEST(Process, WritesAMapAndAPicturePerPose) {
  const TestFolder folder;
  writeSession(folder / "lab");
  const Outcome done = run(kProcess + " " + folder / "lab" + " --output " + folder / "out --mat --npz --cubes");
  EXPECT_EQ(done.status, 0) << done.errors;
  for (const char* pose : {"000", "001", "002"}) {
    EXPECT_TRUE(contains(readBytes(folder / ("out/maps/" + std::string(pose) + ".csv")),
                         "range_m,azimuth_deg,power_db\n0.000000,-81."));
    EXPECT_EQ(readBytes(folder / ("out/pictures/" + std::string(pose) + ".png")).substr(1, 3), "PNG");
    EXPECT_EQ(readBytes(folder / ("out/mat/" + std::string(pose) + ".mat")).substr(0, 10), "MATLAB 5.0");
    EXPECT_EQ(readBytes(folder / ("out/npz/" + std::string(pose) + ".npz")).substr(0, 2), "PK");
  }
}

TEST(Process, SessionBagAndCaptureGiveTheSameMap) {
  const TestFolder folder;
  writeSession(folder / "lab");
  EXPECT_EQ(run(kProcess + " " + folder / "lab" + " --output " + folder / "a").status, 0);
  EXPECT_EQ(run(std::string(MMRADARTWIN_SESSION_TO_BAG) + " " + folder / "lab" + " " + folder / "lab.bag").status, 0);
  EXPECT_EQ(run(kProcess + " " + folder / "lab.bag" + " --output " + folder / "b").status, 0);
  EXPECT_EQ(run(kProcess + " " + folder / "lab/captures/001.bin" + " --radar " + folder / "lab/radar.yaml" +
                " --output " + folder / "c")
                .status,
            0);
  const std::string map = readBytes(folder / "a/maps/001.csv");
  EXPECT_GT(map.size(), 64u * 64 * 20);
  EXPECT_EQ(readBytes(folder / "b/maps/001.csv"), map);
  EXPECT_EQ(readBytes(folder / "c/maps/001.csv"), map);
  EXPECT_EQ(run(std::string(MMRADARTWIN_BAG_TO_SESSION) + " " + folder / "lab.bag" + " " + folder / "back").status, 0);
  EXPECT_EQ(contentsOf(folder / "back"), contentsOf(folder / "lab"));
}

TEST(Process, SkipsWhatCannotBeUsedAndSaysSo) {
  const TestFolder folder;
  writeSession(folder / "lab", "003,B,1700000003.5,nan,2,1.1,0,0,0,1\n004,B,1700000004.5,9,2,1.1,0,0,0,1\n");
  std::filesystem::resize_file(folder / "lab/captures/001.bin", 3 * 2048 + 7);
  const Outcome done = run(kProcess + " " + folder / "lab" + " --output " + folder / "out");
  EXPECT_EQ(done.status, 2);
  EXPECT_TRUE(contains(done.errors, "error: pose '001'")) << done.errors;
  EXPECT_TRUE(contains(done.errors, "3 whole frames")) << done.errors;
  EXPECT_TRUE(contains(done.errors, "pose '003': x is nan")) << done.errors;
  EXPECT_TRUE(contains(done.errors, "error: pose '004'")) << done.errors;
  EXPECT_TRUE(std::filesystem::exists(folder / "out/maps/000.csv"));
  EXPECT_TRUE(std::filesystem::exists(folder / "out/maps/002.csv"));
  EXPECT_FALSE(std::filesystem::exists(folder / "out/maps/001.csv"));
}

TEST(Process, BadUseIsOneErrorLineAndStatusTwo) {
  const TestFolder folder;
  writeSession(folder / "lab");
  const std::string out = " --output " + folder / "out";
  for (const std::string& command :
       {kProcess, kProcess + " " + folder / "lab", kProcess + " " + folder / "none" + out,
        kProcess + " " + folder / "lab --layout 3lane" + out, kProcess + " " + folder / "lab/captures/000.bin" + out,
        kProcess + " " + folder / "lab --cubes" + out,
        std::string(MMRADARTWIN_SESSION_TO_BAG) + " " + folder / "none" + " " + folder / "x.bag",
        std::string(MMRADARTWIN_SESSION_TO_BAG) + " " + folder / "lab" + " " + folder / "no/x.bag",
        std::string(MMRADARTWIN_BAG_TO_SESSION) + " " + folder / "none.bag" + " " + folder / "x"}) {
    const Outcome failed = run(command);
    EXPECT_EQ(failed.status, 2) << command;
    EXPECT_EQ(failed.errors.substr(0, 7), "error: ") << command << "\n" << failed.errors;
    EXPECT_EQ(std::count(failed.errors.begin(), failed.errors.end(), '\n'), 1) << command << "\n" << failed.errors;
  }
  EXPECT_EQ(run(kProcess + " --help").status, 0);
}

}  // namespace
}  // namespace mmradartwin
