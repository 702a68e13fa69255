#include "diagnosis/pose_convention.h"

#include <gtest/gtest.h>

#include "diagnosis/made_room.h"

namespace mmradartwin::diagnosis {
namespace {

using Written = std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)>;

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

/// What a reader of x, y, z, w makes of a quaternion written as w, x, y, z.
Eigen::Isometry3d wFirst(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  Eigen::Quaterniond read;
  read.coeffs() << q.w(), q.x(), q.y(), q.z();  // x, y, z, w
  Eigen::Isometry3d written(read.normalized());
  written.pretranslate(T.translation());
  return written;
}

/// The same place with a frame of z forward, x right, y down.
Eigen::Isometry3d optical(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d R = T.linear();
  Eigen::Isometry3d written = T;
  written.linear() << -R.col(1), -R.col(2), R.col(0);
  return written;
}

/// In a map of x east, y up, z south.
Eigen::Isometry3d yUp(const Eigen::Isometry3d& T) {
  Eigen::Matrix3d south;
  south << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  return Eigen::Isometry3d(south) * T;
}

class PoseConvention : public ::testing::Test {
 protected:
  /// Words for the reading of poses that were written so, where the captures are those of the true ones.
  static std::string wordsFor(const Written& written) {
    MadeRoom room(12, {{"east", "Metal", 4, -2.5, 4.3, 2.5},
                       {"north", "Plate", -2.5, 3, 2.5, 3.3},
                       {"south", "Metal", -2.5, -2.4, 2.5, -2.2}});
    room.measure(room.twin->description().mechanisms);
    for (PoseChannels& p : room.data.poses) p.pose.T_map_radar = written(p.pose.T_map_radar);
    return matchingPoseReading(*room.twin, room.data).value_or("");
  }
};

TEST_F(PoseConvention, NamesAQuaternionWithWFirst) {
  const std::string words = wordsFor(wFirst);
  EXPECT_TRUE(contains(words, "their quaternions are w, x, y, z;")) << words;
  EXPECT_TRUE(contains(words, "explains ")) << words;
}

TEST_F(PoseConvention, NamesInvertedPoses) {
  const std::string whole = wordsFor([](const auto& T) { return T.inverse(); });
  EXPECT_TRUE(contains(whole, "if they are inverted (T_radar_map, world to camera);")) << whole;
  const std::string rotations = wordsFor([](const Eigen::Isometry3d& T) {
    Eigen::Isometry3d written = T;
    written.linear() = T.linear().transpose().eval();
    return written;
  });
  EXPECT_TRUE(contains(rotations, "if their rotations are inverted;")) << rotations;
}

TEST_F(PoseConvention, NamesAnOpticalFrame) {
  const std::string words = wordsFor(optical);
  EXPECT_TRUE(contains(words, "if their frame is an optical one")) << words;
}

TEST_F(PoseConvention, NamesAMapWithYUp) {
  const std::string words = wordsFor(yUp);
  EXPECT_TRUE(contains(words, "if their map's y axis points up;")) << words;
}

TEST_F(PoseConvention, NamesWhatReconstructionsWrite) {
  // World to camera, optical, w first.
  const std::string words = wordsFor([](const Eigen::Isometry3d& T) { return wFirst(optical(T).inverse()); });
  EXPECT_TRUE(contains(words, "w, x, y, z and they are inverted")) << words;
  EXPECT_TRUE(contains(words, "and their frame is an optical one")) << words;
}

TEST_F(PoseConvention, NamesNothingWhereNoneMatches) {
  int i = 0;
  EXPECT_EQ(wordsFor([&i](const Eigen::Isometry3d&) {
              ++i;  // places of no relation to the true ones
              return Eigen::Isometry3d(Eigen::Translation3d(std::sin(5.3 * i), std::cos(3.1 * i), 0) *
                                       Eigen::AngleAxisd(1.9 * i, Eigen::Vector3d::UnitZ()));
            }),
            "");
}

TEST(PoseReadings, AreAllTheirOwn) {
  const Eigen::Isometry3d T = Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2) / 3);
  const std::vector<PoseReading>& readings = poseReadings();
  EXPECT_EQ(readings.size(), 47u);
  for (std::size_t i = 0; i < readings.size(); ++i) {
    EXPECT_FALSE(readings[i].T_map_radar(T).isApprox(T, 1e-6)) << readings[i].words;
    for (std::size_t k = 0; k < i; ++k) {
      EXPECT_FALSE(readings[i].T_map_radar(T).isApprox(readings[k].T_map_radar(T), 1e-6)) << readings[i].words;
    }
  }
}

}  // namespace
}  // namespace mmradartwin::diagnosis
