#include "../emulator/pose_schedule.h"

#include <gtest/gtest.h>

#include "emulated_rig.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

TEST(PoseSchedule, EveryFrameOfAPoseLiesInsideItsStay) {
  TestFolder folder;
  writeSession(folder, 0.05, {4, 1, 100});
  const PlayedSession session = openPlayedSession(folder.file(""), "", {});
  ASSERT_EQ(3u, session.poses.size());
  EXPECT_EQ(105, session.frames);
  const std::int64_t start_ns = 7'000'000'000, period_ns = 50'000'000;
  const auto schedule = schedulePoses(session, start_ns);
  const std::vector<std::int64_t> first_frame = {0, 4, 5}, frames = {4, 1, 100};
  for (std::size_t pose = 0; pose < 3; ++pose) {
    std::vector<std::int64_t> stamps;
    for (const ScheduledPose& due : schedule) {
      if (due.pose == pose) stamps.push_back(due.stamp_ns);
    }
    const std::int64_t T = start_ns + first_frame[pose] * period_ns;
    EXPECT_EQ(T, poseStart_ns(session, pose, start_ns));
    EXPECT_EQ(T - period_ns / 4, stamps.front());
    EXPECT_EQ(T + (frames[pose] - 1) * period_ns + period_ns / 4, stamps.back());
    for (std::size_t i = 1; i < stamps.size(); ++i) {
      EXPECT_GT(stamps[i], stamps[i - 1]);
      EXPECT_LE(stamps[i] - stamps[i - 1], 50'000'000);
    }
  }
}

TEST(PlayedSession, LeavesOutWhatCannotBePlayedAndSaysSo) {
  TestFolder folder;
  writeSession(folder, 0.05, {2, 2, 2});
  std::filesystem::remove(folder.file("captures/a.bin"));
  writeText(folder.file("captures/b.bin"), randomBytes(3000, 1));
  const PlayedSession session = openPlayedSession(folder.file(""), "", {});
  ASSERT_EQ(1u, session.poses.size());
  EXPECT_EQ("c", session.poses[0].pose.name);
  EXPECT_EQ(0, session.poses[0].first_frame);
  ASSERT_EQ(2u, session.problems.size());
  EXPECT_NE(std::string::npos, session.problems[1].message.find("3000 bytes")) << session.problems[1].message;
  PlayedSelection beyond;
  beyond.first = 3;
  EXPECT_THROW(openPlayedSession(folder.file(""), "", beyond), InputError);
  std::filesystem::remove(folder.file("captures/c.bin"));
  try {
    openPlayedSession(folder.file(""), "", {});
    FAIL() << "nothing can be played";
  } catch (const InputError& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("a.bin")) << error.what();
  }
}

}  // namespace
}  // namespace mmradartwin
