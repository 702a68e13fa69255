#include <gtest/gtest.h>

#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "test_session_folder.h"

namespace mmradartwin {
namespace {

TEST(Stamps, AreWholeNanoseconds) {
  EXPECT_EQ(parseStamp_ns("1700000000.25"), 1700000000250000000);
  EXPECT_EQ(parseStamp_ns("1700000000.123456789"), 1700000000123456789);
  EXPECT_EQ(parseStamp_ns("0"), 0);
  EXPECT_EQ(parseStamp_ns("1700000000.1234567886"), 1700000000123456789);
  EXPECT_EQ(parseStamp_ns("1.9999999999"), 2000000000);
  for (const std::int64_t stamp : {0ll, 1ll, 1700000000250000000ll, 1700000000123456789ll, 5000000000ll}) {
    EXPECT_EQ(parseStamp_ns(formatStamp(stamp)), stamp);
  }
  EXPECT_EQ(formatStamp(1700000000250000000), "1700000000.25");
  for (const char* bad : {"", "-1", "1e9", "nan", "1.2.3", "5000000000", "abc", " 1"}) {
    EXPECT_TRUE(saysInOneLine(inputError([&] { parseStamp_ns(bad); }), "stamp", bad)) << bad;
  }
}

TEST(Session, ReadsWhatIsThere) {
  const TestFolder folder;
  writeSession(folder / "lab");
  for (const std::string& path : {folder / "lab", folder / "lab/session.yaml", folder / "lab/"}) {
    const Recording recording = openSession(path);
    EXPECT_EQ(recording.name, "lab");
    ASSERT_EQ(recording.poses.size(), 3u);
    EXPECT_EQ(recording.poses[1].name, "001");
    EXPECT_EQ(recording.poses[1].location, "A");
    EXPECT_EQ(recording.poses[1].stamp_ns, 1700000001250000000);
    // qz, qw of 30 deg about z.
    EXPECT_LT((recording.poses[1].T_map_radar.linear().col(0) - Eigen::Vector3d(std::sqrt(0.75), 0.5, 0)).norm(), 1e-9);
    EXPECT_EQ(recording.poses[2].T_map_radar.translation(), Eigen::Vector3d(3, 2, 1.1));
    EXPECT_EQ(*recording.scene_file, folder / "lab/model/scene.yaml");
    EXPECT_TRUE(recording.problems.empty());
    const std::vector<AdcCube> frames = framesOf(recording, recording.poses[2]);
    ASSERT_EQ(frames.size(), 4u);
    EXPECT_EQ(frames[3].stamp_ns, 1700000002650000000);
  }
}

TEST(Session, PosesThatCannotBeUsedAreProblemsOfTheirOwn) {
  const TestFolder folder;
  writeSession(
      folder / "lab",
      "003,B,1700000003.5,nan,2,1.1,0,0,0,1\n004,B,1700000004.5,3,2,1.1,0,0,0,0.9\n005,B,soon,3,2,1.1,0,0,0,1\n"
      "006,B,1700000006.5,x,2,1.1,0,0,0,1\n");
  const Recording recording = openSession(folder / "lab");
  EXPECT_EQ(recording.poses.size(), 3u);
  ASSERT_EQ(recording.problems.size(), 4u);
  EXPECT_TRUE(saysInOneLine(recording.problems[0].message, "poses.csv", "line 5", "'003'", "x is nan"));
  EXPECT_TRUE(saysInOneLine(recording.problems[1].message, "'004'", "norm 0.9"));
  EXPECT_TRUE(saysInOneLine(recording.problems[2].message, "'005'", "stamp 'soon'"));
  EXPECT_TRUE(saysInOneLine(recording.problems[3].message, "'006'", "x 'x' is no number"));
  EXPECT_EQ(recording.pose_names.size(), 7u);
}

TEST(Poses, RowsThatCannotBeUsedAreProblemsOfTheirOwn) {
  const PoseTable table = parsePoses(
      "pose,location,stamp,x,y,z,qx,qy,qz,qw\n"
      "b, door ,12.5,1,2,3,0,0,1,0\r\n"
      "\n"
      "a,desk,later,1,2,3,0,0,0,1\n",
      "list.csv");
  EXPECT_EQ(table.names, (std::vector<std::string>{"b", "a"}));
  ASSERT_EQ(table.poses.size(), 1u);
  EXPECT_EQ(table.poses[0].name, "b");
  EXPECT_EQ(table.poses[0].location, "door");
  EXPECT_EQ(table.poses[0].stamp_ns, 12500000000);
  EXPECT_TRUE(table.poses[0].T_map_radar.translation().isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE(table.poses[0].T_map_radar.linear().col(0).isApprox(-Eigen::Vector3d::UnitX()));
  ASSERT_EQ(table.problems.size(), 1u);
  EXPECT_EQ(table.problems[0].pose, "a");
  EXPECT_TRUE(saysInOneLine(table.problems[0].message, "list.csv", "line 4", "'a'", "later"));
  EXPECT_TRUE(saysInOneLine(inputError([] { parsePoses("pose,place\n", "list.csv"); }), "list.csv", "header"));
  const PoseTable latin1 = parsePoses(
      "pose,location,stamp,x,y,z,qx,qy,qz,qw\na,t\xfcr,12.5,1,2,3,0,0,1,0\nb,door,13.5,1,2,3,0,0,1,0\n", "list.csv");
  ASSERT_EQ(latin1.problems.size(), 1u);
  EXPECT_TRUE(saysInOneLine(latin1.problems[0].message, "line 2", "location 't?r'", "UTF-8"));
}

TEST(Session, MissingAndTruncatedCapturesAreNamedWhenRead) {
  const TestFolder folder;
  writeSession(folder / "lab");
  std::filesystem::remove(folder / "lab/captures/001.bin");
  std::filesystem::resize_file(folder / "lab/captures/002.bin", 3 * 2048 + 7);
  const Recording recording = openSession(folder / "lab");
  ASSERT_EQ(recording.poses.size(), 3u);
  EXPECT_EQ(framesOf(recording, recording.poses[0]).size(), 4u);
  EXPECT_TRUE(saysInOneLine(inputError([&] { framesOf(recording, recording.poses[1]); }), "pose '001'", "001.bin"));
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { framesOf(recording, recording.poses[2]); }), "pose '002'", "3 whole frames"));
}

TEST(Session, WholeFramesOfATruncatedCaptureAreVisitedWhereTheOthersAreWhole) {
  const TestFolder folder;
  writeSession(folder / "lab");
  const auto visited = [&](const Recording& recording, std::size_t pose) {
    int frames = 0;
    EXPECT_THROW(recording.forEachFrame(recording.poses[pose], [&](const AdcCube&) { ++frames; }), TruncatedCapture);
    return frames;
  };
  std::filesystem::resize_file(folder / "lab/captures/002.bin", 3 * 2048 + 7);
  EXPECT_EQ(visited(openSession(folder / "lab"), 2), 3);
  std::filesystem::resize_file(folder / "lab/captures/002.bin", 2047);
  EXPECT_EQ(visited(openSession(folder / "lab"), 2), 0);
  // Most of them: they are another radar's.
  std::filesystem::resize_file(folder / "lab/captures/002.bin", 3 * 2048 + 7);
  std::filesystem::resize_file(folder / "lab/captures/001.bin", 3 * 2048 + 7);
  EXPECT_EQ(visited(openSession(folder / "lab"), 1), 0);
  EXPECT_EQ(visited(openSession(folder / "lab"), 2), 0);
}

TEST(Session, OverlapInTimeIsAnError) {
  const TestFolder folder;
  writeSession(folder / "lab", "", 21);  // 21 frames last 1.05 s, the next pose comes after 1 s
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { openSession(folder / "lab"); }), "poses.csv", "'000'", "'001'", "overlap"));
  writeSession(folder / "lab", "", 20);  // back to back
  EXPECT_EQ(openSession(folder / "lab").poses.size(), 3u);
  SessionOptions without;
  without.need_captures = false;
  writeSession(folder / "lab", "", 21);
  EXPECT_EQ(openSession(folder / "lab", without).poses.size(), 3u);
}

TEST(Session, TheLaterDuplicateIsExcludedAndListed) {
  const TestFolder folder;
  // 9 cm aside, 1 cm up, 0.9 deg turned: a duplicate of 002. 11 cm aside, 3 cm up or 2 deg turned are none.
  writeSession(folder / "lab",
               "003,B,1700000010,3.09,2,1.11,0,0,0.007853901,0.999969158\n004,B,1700000020,3.11,2,1.1,0,0,0,1\n"
               "005,B,1700000030,3,2,1.13,0,0,0,1\n006,B,1700000040,3,2,1.1,0,0,0.017452406,0.999847695\n");
  const Recording recording = openSession(folder / "lab");
  EXPECT_EQ(recording.duplicates, std::vector<std::string>{"003"});
  EXPECT_EQ(recording.poses.size(), 6u);
  SessionOptions all;
  all.exclude_duplicates = false;
  EXPECT_EQ(openSession(folder / "lab", all).poses.size(), 7u);
}

TEST(Session, HeadingsAreComparedAcrossPlusMinus180) {
  Eigen::Isometry3d a = Eigen::Isometry3d::Identity(), b = a;
  a.rotate(Eigen::AngleAxisd(179.7 * M_PI / 180, Eigen::Vector3d::UnitZ()));
  b.rotate(Eigen::AngleAxisd(-179.7 * M_PI / 180, Eigen::Vector3d::UnitZ()));
  EXPECT_TRUE(sameView(a, b));
}

TEST(Session, WhatMakesAllOfItUnusableIsOneLine) {
  const TestFolder folder;
  const auto with = [&](const std::string& file, const std::string& from, const std::string& to) {
    std::filesystem::remove_all(folder / "lab");
    writeSession(folder / "lab");
    std::string text = readBytes(folder / ("lab/" + file));
    text.replace(text.find(from), from.size(), to);
    writeBytes(folder / ("lab/" + file), text);
    return inputError([&] { openSession(folder / "lab"); });
  };
  EXPECT_TRUE(saysInOneLine(with("session.yaml", "scene:", "scen:"), "session.yaml", "scen", "did you mean 'scene'"));
  EXPECT_TRUE(saysInOneLine(with("session.yaml", "session/1", "session/2"), "format", "mmradartwin_session/1"));
  EXPECT_TRUE(saysInOneLine(with("session.yaml", "{pose}", "pose"), "captures", "{pose}"));
  EXPECT_TRUE(saysInOneLine(with("session.yaml", "radar.yaml", "radio.yaml"), "radio.yaml"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "location", "place"), "poses.csv", "header"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "001,A", "000,A"), "line 3", "'000'", "twice"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "001,A", "a/b,A"), "line 3", "slash"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "001,A", ".x,A"), "line 3", "dot"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "001,A,", "001,"), "line 3", "9 fields"));
  EXPECT_TRUE(saysInOneLine(with("poses.csv", "001,A",
                                 "K\xfc"
                                 "che,A"),
                            "line 3", "'K?che'", "UTF-8"));
  EXPECT_EQ(with("poses.csv", "001,A",
                 "K\xc3\xbc"
                 "che,A"),
            "");
  const std::string long_name = with("poses.csv", "001,A", std::string(5000, 'x') + ",A");
  EXPECT_TRUE(saysInOneLine(long_name, "line 3", "5000 bytes", "allowed: 200"));
  EXPECT_LT(long_name.size(), 400u) << "not the name itself";
  EXPECT_TRUE(saysInOneLine(inputError([&] { openSession(folder / "none"); }), "none"));
}

TEST(Session, WriterAndReaderAgree) {
  const TestFolder folder;
  const RadarConfig radar = paperRadar();
  Pose pose;
  pose.name = "7";
  pose.location = "desk";
  pose.stamp_ns = 1700000000123456789;
  pose.T_map_radar =
      Eigen::Translation3d(1.0 / 3, -2.5, 1.1) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  AdcCube cube;
  decodeFrame(radar, reinterpret_cast<const std::uint8_t*>(randomCapture(radar, 1, 5).data()), cube.data);
  SessionWriter::Files files;
  files.radar_yaml = toYaml(radar);
  files.scene = "../scene.yaml";
  files.gain_db = -12.345678901234567;
  SessionWriter writer(folder / "out", radar, files);
  writer.add(pose, {cube, cube});
  EXPECT_FALSE(std::filesystem::exists(folder / "out/session.yaml"));
  writer.finish();
  const Recording recording = openSession(folder / "out");
  ASSERT_EQ(recording.poses.size(), 1u);
  EXPECT_EQ(recording.poses[0].stamp_ns, pose.stamp_ns);
  EXPECT_EQ(recording.poses[0].T_map_radar.translation(), pose.T_map_radar.translation());
  EXPECT_TRUE(recording.poses[0].T_map_radar.isApprox(pose.T_map_radar, 1e-15));
  EXPECT_EQ(*recording.gain_db, -12.345678901234567);
  EXPECT_EQ(*recording.scene_file, folder / "scene.yaml");
  ASSERT_EQ(framesOf(recording, recording.poses[0]).size(), 2u);
  EXPECT_EQ(framesOf(recording, recording.poses[0])[1].data, cube.data);
  pose.name = "a/b";
  EXPECT_FALSE(inputError([&] { writer.add(pose, {}); }).empty());
}

TEST(ResolvePath, FindsPackagesWithoutROS) {
  const TestFolder folder;
  writeBytes(folder / "ws/src/repo/config/package.xml", "<package><name>my_config</name></package>");
  writeBytes(folder / "ws/src/repo/config/radar.yaml", "a: 1");
  writeBytes(folder / "install/share/other/package.xml", "<package><name> other </name></package>");
  std::filesystem::create_directory_symlink("..", folder / "ws/src/loop");
  const char* old_ros = std::getenv("ROS_PACKAGE_PATH");
  const char* old_cmake = std::getenv("CMAKE_PREFIX_PATH");
  const std::string keep_ros = old_ros ? old_ros : "", keep_cmake = old_cmake ? old_cmake : "";
  setenv("ROS_PACKAGE_PATH", (folder / "ws/src").c_str(), 1);
  setenv("CMAKE_PREFIX_PATH", (folder / "install").c_str(), 1);
  EXPECT_EQ(resolvePath("package://my_config/radar.yaml", "/a/session.yaml"), folder / "ws/src/repo/config/radar.yaml");
  EXPECT_EQ(resolvePath("package://other/x.yaml", "/a/session.yaml"), folder / "install/share/other/x.yaml");
  EXPECT_TRUE(saysInOneLine(inputError([] { resolvePath("package://nobody/x", "/a/session.yaml"); }), "/a/session.yaml",
                            "'nobody'"));
  setenv("ROS_PACKAGE_PATH", keep_ros.c_str(), 1);
  setenv("CMAKE_PREFIX_PATH", keep_cmake.c_str(), 1);
  EXPECT_EQ(resolvePath("b/../c.yaml", "/a/session.yaml"), "/a/c.yaml");
  EXPECT_EQ(resolvePath("/x/c.yaml", "/a/session.yaml"), "/x/c.yaml");
}

TEST(SessionFiles, HoldEverythingThatSceneAndTwinName) {
  const TestFolder folder;
  writeSession(folder / "lab");
  std::vector<std::string> names;
  for (const StoredFile& file : gatherSessionFiles(folder / "lab")) names.push_back(file.name);
  EXPECT_EQ(names.front(), "session.yaml");
  std::sort(names.begin(), names.end());
  EXPECT_EQ(names, (std::vector<std::string>{"materials.yaml", "model/parts/desk.bin", "model/parts/desk.gltf",
                                             "model/room.mtl", "model/room.obj", "model/scene.yaml", "poses.csv",
                                             "radar.yaml", "session.yaml", "twin.yaml"}));
  std::filesystem::remove(folder / "lab/materials.yaml");
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { gatherSessionFiles(folder / "lab"); }), "scene.yaml", "'../materials.yaml'"));
}

TEST(SessionFiles, OutsideFilesWorkElsewhereAndLeaveTheOriginalAlone) {
  const TestFolder folder;
  writeSession(folder / "here/lab");
  writeBytes(folder / "here/shared/scene.yaml", "meshes: [{file: meshes/room.obj}]\nmaterials: ../materials.yaml\n");
  writeBytes(folder / "here/shared/meshes/room.obj", "v 0 0 0\n");
  writeBytes(folder / "here/materials.yaml", "materials: {}\n");
  std::string yaml = readBytes(folder / "here/lab/session.yaml");
  yaml.replace(yaml.find("model/scene.yaml"), 16, "../shared/scene.yaml");
  writeBytes(folder / "here/lab/session.yaml", yaml);
  const std::vector<StoredFile> files = gatherSessionFiles(folder / "here/lab");

  restoreSessionFiles(files, folder / "here/lab2");  // beside the original: the shared files still stand there
  EXPECT_EQ(readBytes(folder / "here/lab2/session.yaml"), yaml);
  EXPECT_FALSE(std::filesystem::exists(folder / "here/lab2/external"));

  restoreSessionFiles(files, folder / "there/x/lab");
  const Recording recording = openSession(folder / "there/x/lab", {false, true, "", std::nullopt});
  ASSERT_TRUE(recording.scene_file);
  EXPECT_EQ(*recording.scene_file, folder / "there/x/lab/external/session/up/shared/scene.yaml");
  EXPECT_EQ(readBytes(folder / "there/x/lab/external/session/up/shared/meshes/room.obj"), "v 0 0 0\n");
  const std::string scene = readBytes(*recording.scene_file);
  const std::size_t at = scene.find("materials: ") + 11;
  EXPECT_EQ(readBytes(resolvePath(scene.substr(at, scene.find('\n', at) - at), *recording.scene_file)),
            "materials: {}\n");
}

TEST(SessionFiles, NamesThatLeaveTheFolderAreRefused) {
  const TestFolder folder;
  const std::string long_name(5000, 'x');
  for (const std::string& name : {std::string("../evil"), std::string("/evil"), std::string("a/../../evil"),
                                  std::string(), std::string("."), std::string("a/"), long_name}) {
    EXPECT_TRUE(saysInOneLine(inputError([&] {
                                restoreSessionFiles({{name, "x"}}, folder / "s");
                              }),
                              "session message"))
        << name;
  }
}

StampedTransform at(double t_s, double x, double yaw_deg, double jitter = 0) {
  StampedTransform frame;
  frame.stamp_ns = static_cast<std::int64_t>(std::llround(t_s * 1e9));
  frame.T_map_radar =
      Eigen::Translation3d(x, jitter, 1.1) * Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitZ());
  return frame;
}

TEST(SessionFiles, AFileIsNoFolderOfAnother) {
  const TestFolder folder;
  const std::string said = inputError([&] { restoreSessionFiles({{"a", "1"}, {"a/b/c", "2"}}, folder / "s"); });
  EXPECT_TRUE(saysInOneLine(said, "session message", "'a'", "'a/b/c'"));
  EXPECT_FALSE(std::filesystem::exists(folder / "s"));
}

TEST(StationaryPoses, AreStretchesOfASecond) {
  std::vector<StampedTransform> frames;
  double t = 100;
  const auto stay = [&](double seconds, double x, double yaw_deg) {
    for (int i = 0; i < seconds * 20; ++i, t += 0.05) frames.push_back(at(t, x, yaw_deg, 0.004 * ((i * 7) % 3 - 1)));
  };
  const auto move = [&](double seconds, double from, double to) {
    for (int i = 0; i < seconds * 20; ++i, t += 0.05)
      frames.push_back(at(t, from + (to - from) * i / (seconds * 20), 0));
  };
  stay(3, 0, 0);  // 001
  move(2, 0.1, 1.9);
  stay(0.9, 2, 0);  // too short
  stay(5, 2, 30);   // 002: the same place, turned
  move(2, 2.1, 2.9);
  stay(1, 3, 0);      // 003: just long enough
  stay(2, 0.05, 40);  // 004: back at the first location
  const std::vector<Stretch> stretches = findStationaryPoses(frames, 50000000);
  ASSERT_EQ(stretches.size(), 4u);
  EXPECT_EQ(stretches[0].pose.name, "001");
  EXPECT_EQ(stretches[0].pose.stamp_ns, 100000000000);
  EXPECT_NEAR(stretches[0].pose.T_map_radar.translation().y(), 0, 1e-12);  // median of the jitter
  EXPECT_NEAR(stretches[1].pose.T_map_radar.translation().x(), 2, 1e-12);
  EXPECT_NEAR((stretches[1].last_stamp_ns - stretches[1].pose.stamp_ns) * 1e-9, 4.95, 1e-9);
  EXPECT_NEAR(stretches[2].pose.T_map_radar.translation().x(), 3, 1e-12);
  EXPECT_EQ(stretches[3].pose.location, stretches[0].pose.location);
  EXPECT_NE(stretches[1].pose.location, stretches[0].pose.location);
}

TEST(StationaryPoses, AGapEndsAStretchAndCreepingIsNoStandingStill) {
  std::vector<StampedTransform> frames;
  for (int i = 0; i < 30; ++i) frames.push_back(at(i * 0.05, 0, 0));
  for (int i = 0; i < 30; ++i) frames.push_back(at(100 + i * 0.05, 0, 0));
  EXPECT_EQ(findStationaryPoses(frames, 50000000).size(), 2u);
  frames.clear();
  for (int i = 0; i < 200; ++i) frames.push_back(at(i * 0.05, 0.01 * i, 0));  // 0.2 m/s
  EXPECT_TRUE(findStationaryPoses(frames, 50000000).empty());
  frames.clear();
  for (int i = 0; i < 200; ++i) frames.push_back(at(i * 0.05, 0, 0.2 * i));  // 4 deg/s
  EXPECT_TRUE(findStationaryPoses(frames, 50000000).empty());
}

}  // namespace
}  // namespace mmradartwin
