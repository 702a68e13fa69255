// The camera's pose from its cloud, on depth rendered from the shipped office and from a real room's scan, and what
// must be refused: wrong rooms, far guesses, walls that fix nothing.

#include "mmradartwin_sim/room_registration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <stdexcept>

#include "depth_camera.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

constexpr double kDeg = M_PI / 180;

struct Room {
  explicit Room(const std::string& file, double floor_m_)
      : scene(loadScene(file, 77.9e9)), rays(scene), registration(scene), floor_m(floor_m_) {
    for (const Actor& actor : scene.actors) bounds.extend(actor.bounds);
  }
  /// A camera in the room at a height of 0.9 to 1.5 m, level within some degrees.
  Eigen::Isometry3d randomPose(std::mt19937& random) const {
    std::uniform_real_distribution<double> unit(0, 1);
    for (int tries = 0; tries < 20000; ++tries) {
      const Eigen::Vector3d p(bounds.min().x() + unit(random) * bounds.sizes().x(),
                              bounds.min().y() + unit(random) * bounds.sizes().y(), floor_m + 0.9 + 0.6 * unit(random));
      if (!freePlace(rays, p, 0.4)) continue;
      return Eigen::Translation3d(p) * Eigen::AngleAxisd(2 * M_PI * unit(random), Eigen::Vector3d::UnitZ()) *
             Eigen::AngleAxisd((unit(random) * 20 - 5) * kDeg, Eigen::Vector3d::UnitY()) *
             Eigen::AngleAxisd((unit(random) * 6 - 3) * kDeg, Eigen::Vector3d::UnitX());
    }
    throw std::runtime_error(scene.file + ": has no free place");
  }

  Scene scene;
  RayCaster rays;
  RoomRegistration registration;
  double floor_m;
  Eigen::AlignedBox3d bounds;
};

Eigen::Isometry3d displaced(const Eigen::Isometry3d& T, double distance_m, double turn_deg, std::mt19937& random) {
  std::uniform_real_distribution<double> unit(0, 1);
  const double a = 2 * M_PI * unit(random), side = unit(random) < 0.5 ? -1 : 1;
  Eigen::Isometry3d moved = T;
  moved.translation() += distance_m * Eigen::Vector3d(std::cos(a), std::sin(a), 0.1);
  moved.linear() = Eigen::AngleAxisd(side * turn_deg * kDeg, Eigen::Vector3d::UnitZ()).toRotationMatrix() * T.linear();
  return moved;
}

double positionError_m(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}
double angleError_deg(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle() / kDeg;
}
double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

Eigen::Vector3d measuredUp(const Eigen::Isometry3d& T, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 0.4 * kDeg);
  return (T.linear().transpose() * Eigen::Vector3d(normal(random), normal(random), 1)).normalized();
}

class RoomRegistrationTest : public SceneFiles {
 protected:
  static const Room& office() {
    static const Room room(std::string(MMRADARTWIN_CONFIG) + "/office/scene.yaml", 0);
    return room;
  }
  /// Null where the recorded data are not there.
  const Room* scan() {
    static std::unique_ptr<Room> room;
    const char* data = std::getenv("MMRADARTWIN_DATA");
    const std::string file = std::string(data ? data : MMRADARTWIN_DEFAULT_DATA) + "/rooms/hololens_room.ply";
    if (!room && std::filesystem::exists(file)) {
      write("scan.yaml", "meshes: [{file: " + file +
                             "}]\nmaterials: materials.yaml\nactors: {hololens_room: {material: Concrete}}\n"
                             "facets: {angle_deg: 35, offset_m: 0.05}\n");
      room = std::make_unique<Room>(path("scan.yaml"), -1.0);
    }
    return room.get();
  }

  /// Median error of trusted fits, none of which may be wrong; how many were trusted.
  void expectAccurate(const Room& room, int poses, double off_m, double off_deg, GuessKind kind, double trusted_share,
                      double limit_m, double limit_deg) {
    std::mt19937 random(seed);
    std::vector<double> distance, turn, ratio;
    int refused = 0;
    for (int i = 0; i < poses; ++i) {
      const Eigen::Isometry3d truth = room.randomPose(random);
      const auto cloud = camera.cloud(room.rays, room.scene, truth, random);
      const Registration fit =
          room.registration.locate(cloud, displaced(truth, off_m, off_deg, random), kind, measuredUp(truth, random));
      const double e = positionError_m(fit.T_map_camera, truth), a = angleError_deg(fit.T_map_camera, truth);
      if (std::getenv("MMRADARTWIN_SHOW_FITS")) {
        std::cerr << i << (fit.trusted ? " trusted " : " refused ") << e * 1000 << " mm " << a << " deg, agreement "
                  << fit.agreement << " behind " << fit.behind << " coverage " << fit.coverage << " information "
                  << fit.information << " rms " << fit.rms_m << " sd "
                  << std::sqrt(fit.covariance.diagonal().head<3>().maxCoeff()) * 1000 << " mm starts " << fit.starts
                  << " " << fit.reason << "\n";
      }
      if (!fit.trusted) {
        ++refused;
        EXPECT_FALSE(fit.reason.empty());
        continue;
      }
      EXPECT_LT(e, 0.05) << "seed " << seed << ", pose " << i;
      EXPECT_LT(a, 1.5) << "seed " << seed << ", pose " << i;
      distance.push_back(e);
      turn.push_back(a);
      const Eigen::Vector3d d = fit.T_map_camera.translation() - truth.translation();
      ratio.push_back(d.dot(fit.covariance.topLeftCorner<3, 3>().inverse() * d));
    }
    ASSERT_GE(static_cast<int>(distance.size()), trusted_share * poses) << "seed " << seed;
    RecordProperty("median_mm", std::to_string(1000 * median(distance)));
    RecordProperty("median_deg", std::to_string(median(turn)));
    std::cout << "seed " << seed << ": median " << 1000 * median(distance) << " mm, " << median(turn) << " deg, "
              << refused << " of " << poses << " refused; median squared error over covariance " << median(ratio)
              << " (2.4 expected)\n";
    EXPECT_LE(median(distance), limit_m) << "seed " << seed;
    EXPECT_LE(median(turn), limit_deg) << "seed " << seed;
    // Of three normal variables: half below 2.4, 99.9 % below 16.3.
    EXPECT_LT(median(ratio), 2.4) << "the covariance is below the real error; seed " << seed;
    EXPECT_LT(*std::max_element(ratio.begin(), ratio.end()), 16.3) << "seed " << seed;
  }

  /// No fit but the true one may be trusted.
  void expectNoWrongFit(const Room& seen, const Room& believed, int poses, double off_m, double off_deg) {
    std::mt19937 random(seed);
    int trusted = 0;
    for (int i = 0; i < poses; ++i) {
      const Eigen::Isometry3d truth = seen.randomPose(random);
      const auto cloud = camera.cloud(seen.rays, seen.scene, truth, random);
      const Eigen::Isometry3d guess =
          &seen == &believed ? displaced(truth, off_m, off_deg, random) : believed.randomPose(random);
      const GuessKind kind = i % 2 ? GuessKind::kPerson : GuessKind::kTracking;
      const Registration fit = believed.registration.locate(cloud, guess, kind, measuredUp(truth, random));
      const bool right = &seen == &believed && positionError_m(fit.T_map_camera, truth) < 0.05;
      if (std::getenv("MMRADARTWIN_SHOW_FITS")) {
        std::cerr << i << (fit.trusted ? " trusted " : " refused ") << (right ? "right" : "wrong") << ", agreement "
                  << fit.agreement << " behind " << fit.behind << " coverage " << fit.coverage << " information "
                  << fit.information << " " << fit.reason << "\n";
      }
      if (fit.trusted) ++trusted;
      EXPECT_TRUE(!fit.trusted || right) << "seed " << seed << ", pose " << i << ", agreement " << fit.agreement;
      EXPECT_EQ(fit.trusted, fit.reason.empty());
    }
    std::cout << "seed " << seed << ": " << trusted << " of " << poses << " trusted\n";
  }

  DepthCamera camera;
  unsigned seed = [] {
    const char* text = std::getenv("MMRADARTWIN_REGISTRATION_SEED");
    return text ? static_cast<unsigned>(std::atoi(text)) : 1U;
  }();
  int scale = [] {
    const char* text = std::getenv("MMRADARTWIN_REGISTRATION_SCALE");
    return text ? std::atoi(text) : 1;
  }();
};

TEST_F(RoomRegistrationTest, SaysWhatAFlatWallLeavesOpen) {
  std::vector<Eigen::Vector3d> wall;
  for (double y = -0.9; y < 0.9; y += 0.005) {
    for (double z = -0.5; z < 0.5; z += 0.005) wall.emplace_back(1, y, z);
  }
  const Eigen::Isometry3d guess(Eigen::Translation3d(office().bounds.max().x() - 1, office().bounds.center().y(), 1.6));
  const Registration fit = office().registration.locate(wall, guess, GuessKind::kTracking);
  EXPECT_FALSE(fit.trusted);
  EXPECT_FALSE(fit.reason.empty());
}

TEST_F(RoomRegistrationTest, RefusesACloudOfFewPoints) {
  const Registration fit = office().registration.locate({{1, 0, 0}, {NAN, 0, 0}, {1, 0.1, 0}},
                                                        Eigen::Isometry3d::Identity(), GuessKind::kTracking);
  EXPECT_FALSE(fit.trusted);
  EXPECT_NE(fit.reason.find("cells"), std::string::npos) << fit.reason;
}

TEST(GravityEstimate, IsTheMeanOfARestingSensorAndNothingElse) {
  const Eigen::Vector3d up = Eigen::Vector3d(0.1, -0.2, 1).normalized();
  GravityEstimate gravity;
  for (int i = 0; i < 9; ++i) gravity.add(10 + 0.01 * i, 9.81 * up, Eigen::Vector3d::Zero());
  EXPECT_FALSE(gravity.up(10.1)) << "nine samples are few";
  for (int i = 9; i < 30; ++i) {
    const Eigen::Vector3d shaken = (i % 2 ? 0.2 : -0.2) * Eigen::Vector3d::UnitX();
    gravity.add(10 + 0.01 * i, 9.85 * up + shaken, Eigen::Vector3d::Zero());
  }
  ASSERT_TRUE(gravity.up(10.3));
  EXPECT_LT(std::acos(std::min(1.0, gravity.up(10.3)->dot(up))), 0.2 * kDeg);
  EXPECT_FALSE(gravity.up(11)) << "the newest sample is old";

  gravity.add(10.31, 9.81 * up, {0, 0, 0.5});
  EXPECT_FALSE(gravity.up(10.32)) << "it turns";
  for (int i = 0; i < 20; ++i) gravity.add(20 + 0.01 * i, 11 * up, Eigen::Vector3d::Zero());
  EXPECT_FALSE(gravity.up(20.2)) << "it is being pushed";
  for (int i = 0; i < 20; ++i) gravity.add(5 + 0.01 * i, 9.81 * up, Eigen::Vector3d::Zero());
  EXPECT_TRUE(gravity.up(5.2)) << "time went back, as in a bag that loops";
}

TEST_F(RoomRegistrationTest, FollowsACameraThroughTheOffice) {
  expectAccurate(office(), 24 * scale, 0.1, 4, GuessKind::kTracking, 0.3, 0.01, 0.3);
}

TEST_F(RoomRegistrationTest, FollowsACameraThroughARealRoomsScan) {
  if (!scan()) GTEST_SKIP() << "rooms/hololens_room.ply is not there; set MMRADARTWIN_DATA";
  expectAccurate(*scan(), 10 * scale, 0.1, 4, GuessKind::kTracking, 0.5, 0.01, 0.3);
}

TEST_F(RoomRegistrationTest, FindsTheFirstFixInARealRoomsScan) {
  if (!scan()) GTEST_SKIP() << "rooms/hololens_room.ply is not there; set MMRADARTWIN_DATA";
  expectAccurate(*scan(), 2 * scale, 0.4, 15, GuessKind::kPerson, 0.3, 0.02, 0.6);
}

TEST_F(RoomRegistrationTest, FindsTheFirstFixInTheOffice) {
  expectAccurate(office(), 3 * scale, 0.4, 15, GuessKind::kPerson, 0.3, 0.02, 0.6);
}

TEST_F(RoomRegistrationTest, RefusesAnotherRoom) {
  if (!scan()) GTEST_SKIP() << "rooms/hololens_room.ply is not there; set MMRADARTWIN_DATA";
  expectNoWrongFit(office(), *scan(), 2 * scale, 0, 0);
  expectNoWrongFit(*scan(), office(), 2 * scale, 0, 0);
}

TEST_F(RoomRegistrationTest, RefusesFarGuesses) {
  expectNoWrongFit(office(), office(), 2 * scale, 2.5, 110);
  if (!scan()) GTEST_SKIP() << "rooms/hololens_room.ply is not there; set MMRADARTWIN_DATA";
  expectNoWrongFit(*scan(), *scan(), 2 * scale, 3, 110);
}

}  // namespace
}  // namespace mmradartwin
