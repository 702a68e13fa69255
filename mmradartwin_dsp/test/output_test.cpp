#include "mmradartwin_dsp/output.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <set>

#include "mmradartwin_dsp/input_file.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// Names in a folder, hidden ones too.
std::set<std::string> namesIn(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) names.insert(entry.path().filename().string());
  return names;
}

/// A result of one file, `mark`.
void writeResult(const OutputArguments& arguments, const std::string& text) {
  Output output = Output::folder(arguments, {}, "mark");
  writeBytes(output.path() + "/mark", text);
  output.complete();
}

TEST(Output, AppearsWhenItIsComplete) {
  const TestFolder folder;
  {
    Output file = Output::file({folder / "a.bin", false}, {});
    writeBytes(file.path(), "bytes");
    EXPECT_FALSE(fs::exists(folder / "a.bin"));
    file.complete();
    EXPECT_EQ(readBytes(folder / "a.bin"), "bytes");
  }
  writeResult({folder / "deep/er/out/", false}, "1");
  EXPECT_EQ(readBytes(folder / "deep/er/out/mark"), "1");
  EXPECT_EQ(namesIn(folder / ""), (std::set<std::string>{"a.bin", "deep"}));
  EXPECT_EQ(namesIn(folder / "deep/er"), std::set<std::string>{"out"});
}

TEST(Output, LeavesNothingUnfinished) {
  const TestFolder folder;
  {
    const Output file = Output::file({folder / "a.bin", false}, {});
    writeBytes(file.path(), "half");
    const Output made = Output::folder({folder / "deep/er/out", false}, {}, "mark");
    writeBytes(made.path() + "/mark", "half");
  }
  EXPECT_TRUE(namesIn(folder / "").empty());
}

TEST(Output, IsNeverAnInput) {
  const TestFolder folder;
  writeBytes(folder / "in/session.yaml", "input");
  fs::create_symlink(folder / "in", folder / "link");
  fs::create_hard_link(folder / "in/session.yaml", folder / "hard.yaml");
  fs::create_symlink(folder / "in/session.yaml", folder / "soft.yaml");
  for (const bool force : {false, true}) {
    for (const char* name : {"in", "in/", "link", "in/../in"}) {
      for (const char* input : {"in", "link", "in/session.yaml", "hard.yaml"}) {
        if (std::string(input) == "hard.yaml") continue;  // lies elsewhere
        const std::string said = inputError([&] {
          Output::folder({folder / name, force}, {folder / input}, "session.yaml");
        });
        EXPECT_TRUE(saysInOneLine(said, name, "input")) << said;
      }
    }
    for (const char* name : {"in/session.yaml", "hard.yaml", "soft.yaml"}) {
      const std::string said = inputError([&] { Output::file({folder / name, force}, {folder / "in/session.yaml"}); });
      EXPECT_TRUE(saysInOneLine(said, name, "input")) << said;
    }
  }
  EXPECT_EQ(readBytes(folder / "in/session.yaml"), "input");
}

TEST(Output, NeverReplacesWhatWasRead) {
  const TestFolder folder;
  writeBytes(folder / "captures/mark", "recorded");
  fs::create_hard_link(folder / "captures/mark", folder / "other.bin");
  requireRegularFile(folder / "captures/mark");
  EXPECT_TRUE(wasRead(folder / "other.bin"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { writeResult({folder / "captures", true}, "new"); }), "captures", "input"));
  const auto write_file = [&] {
    Output file = Output::file({folder / "other.bin", true}, {});
    writeBytes(file.path(), "new");
    file.complete();
  };
  EXPECT_TRUE(saysInOneLine(inputError(write_file), "other.bin", "input"));
  EXPECT_EQ(readBytes(folder / "captures/mark"), "recorded");
  EXPECT_EQ(namesIn(folder / ""), (std::set<std::string>{"captures", "other.bin"}));
}

TEST(Output, ReplacesOnlyWithForceAndAsAWhole) {
  const TestFolder folder;
  writeResult({folder / "out", false}, "first");
  writeBytes(folder / "out/of_the_first", "stale");
  EXPECT_TRUE(saysInOneLine(inputError([&] { writeResult({folder / "out", false}, "second"); }), "out", "--force"));
  EXPECT_EQ(readBytes(folder / "out/mark"), "first");
  writeResult({folder / "out", true}, "second");
  EXPECT_EQ(contentsOf(folder / "out"), (std::map<std::string, std::string>{{"mark", "second"}}));

  writeBytes(folder / "a.bin", "first");
  EXPECT_TRUE(saysInOneLine(inputError([&] { Output::file({folder / "a.bin", false}, {}); }), "a.bin", "--force"));
  Output file = Output::file({folder / "a.bin", true}, {});
  writeBytes(file.path(), "second");
  EXPECT_EQ(readBytes(folder / "a.bin"), "first");
  file.complete();
  EXPECT_EQ(readBytes(folder / "a.bin"), "second");
  EXPECT_EQ(namesIn(folder / ""), (std::set<std::string>{"a.bin", "out"}));
}

TEST(Output, AnOlderResultStaysWhereTheNewOneFails) {
  const TestFolder folder;
  writeResult({folder / "out", false}, "first");
  {
    const Output output = Output::folder({folder / "out", true}, {}, "mark");
    writeBytes(output.path() + "/mark", "half");
  }
  EXPECT_EQ(contentsOf(folder / "out"), (std::map<std::string, std::string>{{"mark", "first"}}));
}

TEST(Output, AnEmptyFolderMayBeThere) {
  const TestFolder folder;
  fs::create_directory(folder / "out");
  writeResult({folder / "out", false}, "1");
  EXPECT_EQ(readBytes(folder / "out/mark"), "1");
}

TEST(Output, RefusesWhatIsNoPlaceForIt) {
  const TestFolder folder;
  fs::create_directory(folder / "photos");
  writeBytes(folder / "photos/cat.jpg", "cat");
  writeBytes(folder / "file", "text");
  mkfifo((folder / "pipe").c_str(), 0600);
  fs::create_symlink(folder / "nowhere", folder / "dangling");
  const auto as_folder = [&](const std::string& name) {
    return inputError([&] { Output::folder({name, true}, {}, "mark"); });
  };
  const auto as_file = [&](const std::string& name) { return inputError([&] { Output::file({name, true}, {}); }); };
  EXPECT_TRUE(saysInOneLine(as_folder(folder / "photos"), "photos", "holds no mark"));
  EXPECT_TRUE(saysInOneLine(as_folder(folder / "file"), "file", "is a file"));
  EXPECT_TRUE(saysInOneLine(as_folder("/"), "/"));
  EXPECT_TRUE(saysInOneLine(as_folder(""), "no name"));
  EXPECT_TRUE(saysInOneLine(as_folder(folder / "file/out"), "out"));
  EXPECT_TRUE(saysInOneLine(as_file(folder / "photos"), "is a folder"));
  EXPECT_TRUE(saysInOneLine(as_file(folder / "pipe"), "no regular file"));
  EXPECT_TRUE(saysInOneLine(as_file("/dev/null"), "no regular file"));
  EXPECT_TRUE(saysInOneLine(as_file(folder / "none/a.bin"), "a.bin", "cannot be written"));
  EXPECT_EQ(readBytes(folder / "photos/cat.jpg"), "cat");
  EXPECT_EQ(namesIn(folder / ""), (std::set<std::string>{"dangling", "file", "photos", "pipe"}));
}

TEST(Output, SweepsWhatAKilledProgramLeft) {
  const TestFolder folder;
  const auto old = fs::file_time_type::clock::now() - std::chrono::hours(1);
  writeBytes(folder / ".out.unfinished_abcdef/mark", "half");
  writeBytes(folder / ".other.unfinished_abcdef/mark", "of another output");
  writeBytes(folder / ".out.unfinished_young1/mark", "may be in use");
  for (const char* name : {".out.unfinished_abcdef", ".other.unfinished_abcdef"})
    fs::last_write_time(folder / name, old);
  writeBytes(folder / ".out.unfinished_tomorr/mark", "made before the clock was set back");
  fs::last_write_time(folder / ".out.unfinished_tomorr", fs::file_time_type::clock::now() + std::chrono::hours(24));
  const Output in_use = Output::folder({folder / "out", false}, {}, "mark");
  fs::last_write_time(in_use.path(), old);
  writeResult({folder / "out", false}, "1");
  EXPECT_FALSE(fs::exists(folder / ".out.unfinished_abcdef"));
  EXPECT_FALSE(fs::exists(folder / ".out.unfinished_tomorr"));
  EXPECT_TRUE(fs::exists(folder / ".other.unfinished_abcdef"));
  EXPECT_TRUE(fs::exists(folder / ".out.unfinished_young1"));
  EXPECT_TRUE(fs::exists(in_use.path()));
}

TEST(Output, MessagesNameItAsTheUserDoes) {
  const TestFolder folder;
  const Output output = Output::folder({folder / "out", false}, {}, "mark");
  EXPECT_EQ(Output::namedIn(output.path() + "/mark: cannot be written"), folder / "out/mark: cannot be written");
  Output::showAs(output.path() + "/recorded", "lab.bag");
  EXPECT_EQ(Output::namedIn(output.path() + "/recorded/office.obj: is damaged"), "lab.bag/office.obj: is damaged");
}

TEST(InputFile, IsNoPipeAndNoDevice) {
  const TestFolder folder;
  mkfifo((folder / "pipe").c_str(), 0600);
  EXPECT_TRUE(saysInOneLine(inputError([&] { requireRegularFile(folder / "pipe"); }), "pipe", "regular file"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { requireRegularFile("/dev/zero"); }), "/dev/zero", "device"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { loadRadarConfig(folder / "pipe"); }), "pipe", "regular file"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { openSession(folder / "pipe"); }), "pipe", "regular file"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { CaptureReader(paperRadar(), folder / "pipe"); }), "pipe", "regular file"));
}

}  // namespace
}  // namespace mmradartwin
