// Interventions on the simulated side against a session of the measured-session generator (test/, Python, no code
// shared): how residuals route that appear with an intervention and not without it. Counts are printed; thresholds hold
// where the rules can reach them.

#include "intervention.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "mmradartwin_attribution/report.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

std::string generate(const std::string& name, const std::string& options) {
  const std::string script = MMRADARTWIN_TEST_DIR "/scripts/make_session.py";
  if (!fs::exists(script)) return "";
  const std::string directory = fs::temp_directory_path() / ("attribution_" + std::to_string(getpid()) + "_" + name);
  const std::string command = "/usr/bin/python3 " + script + " --output " + directory + " --truth " + directory +
                              ".json --seed 1 --frames 20 " + options + " >/dev/null 2>" + directory + ".log";
  if (std::system(command.c_str()) != 0) return "";
  return directory;
}

void remove(const std::string& directory) {
  if (directory.empty()) return;
  fs::remove_all(directory);
  fs::remove(directory + ".json");
  fs::remove(directory + ".log");
}

class InterventionTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    measured_ = generate("measured", "");
    other_speckle_ = generate("speckle", "--speckle-seed 99");
    if (measured_.empty() || other_speckle_.empty()) return;
    lab_ = std::make_unique<Laboratory>(measured_);
    base_ = std::make_unique<Evaluation>(lab_->against(simulatedByTwin(lab_->twin)));
  }
  static void TearDownTestSuite() {
    lab_.reset();
    base_.reset();
    remove(measured_);
    remove(other_speckle_);
  }
  void SetUp() override {
    if (!lab_)
      GTEST_SKIP() << "the session generator " << MMRADARTWIN_TEST_DIR << "/scripts/make_session.py did not run";
  }

  // Prints and returns the classes of what appears.
  static std::array<int, 5> routed(const std::string& name, const Evaluation& with, int expected) {
    const auto count = Laboratory::classes(lab_->appearing(with, *base_));
    std::printf("[  counts  ] %-28s C%d %3.0f %%  (%s)\n", name.c_str(), expected, 100 * share(count, expected),
                text(count).c_str());
    return count;
  }

  static SimulatedBranch without(const std::string& actor) {
    const int index = lab_->twin.scene().actorIndex(actor);
    return lab_->edited([index](std::vector<PathRecord>& records) {
      records.erase(std::remove_if(records.begin(), records.end(),
                                   [index](const PathRecord& r) {
                                     return std::find(r.actors.begin(), r.actors.end(), index) != r.actors.end();
                                   }),
                    records.end());
    });
  }

  static std::string measured_, other_speckle_;
  static std::unique_ptr<Laboratory> lab_;
  static std::unique_ptr<Evaluation> base_;
};

std::string InterventionTest::measured_, InterventionTest::other_speckle_;
std::unique_ptr<Laboratory> InterventionTest::lab_;
std::unique_ptr<Evaluation> InterventionTest::base_;

TEST_F(InterventionTest, WithNothingHiddenTheTwinReachesTheCeiling) {
  const Recording other = openSession(other_speckle_);
  const Evaluation ceiling = lab_->against(simulatedBySession(other));
  const LedgerSummary &twin = base_->central, &best = ceiling.central;
  std::printf("[  counts  ] recall %.3f (%.3f/%.3f/%.3f), ceiling %.3f (%.3f/%.3f/%.3f), Q3 median %.2f dB\n",
              twin.recall, twin.recall_band[0], twin.recall_band[1], twin.recall_band[2], best.recall,
              best.recall_band[0], best.recall_band[1], best.recall_band[2], twin.q3_median_db);
  EXPECT_EQ(twin.poses, 154);
  EXPECT_EQ(base_->duplicates.size(), 2u);
  EXPECT_LE(std::abs(twin.q3_median_db), 0.5);
  EXPECT_GE(twin.recall, 0.95 * best.recall);
  EXPECT_GT(best.recall, 0.7);
  EXPECT_EQ(base_->conjugated_better, 0);
}

TEST_F(InterventionTest, ATurnedRadarShiftsResponses) {
  const Twin turned(lab_->describe("  radar_yaw_offset: {yaw_deg: 14}\n"));
  const auto count = routed("radar turned by 14 deg", lab_->against(simulatedByTwin(turned)), 4);
  // The rest: speckle maxima of rough walls away from any region (C5), and peaks that normalise where the array has a
  // null (C3).
  EXPECT_EQ(std::max_element(count.begin(), count.end()) - count.begin(), 3);
  EXPECT_GE(share(count, 4), 0.7);
}

// Where the actor held the strongest echo, the normalisation lifts all others: what then stands out is C3 and C4 by
// rule.
TEST_F(InterventionTest, ASuppressedActorLosesSupport) {
  for (const std::string actor : {"wall_north", "cabinet_north", "wardrobe"}) {
    routed("paths of " + actor + " suppressed", lab_->against(without(actor)), 1);
  }
  const auto count = routed("paths of wall_east suppressed", lab_->against(without("wall_east")), 1);
  EXPECT_GE(share(count, 1), 0.6);
}

TEST_F(InterventionTest, AWeakerMaterialIsWeakSupport) {
  const auto weaker = [](const std::string& tag) {
    return lab_->against(lab_->edited([tag](std::vector<PathRecord>& records) {
      for (PathRecord& r : records) {
        for (int actor : r.actors) {
          if (lab_->twin.scene().actors[actor].material_tag != tag) continue;
          r.amplitude *= std::sqrt(0.1);
          for (auto& c : r.c) c *= std::sqrt(0.1);
        }
      }
    }));
  };
  for (const std::string tag : {"Concrete", "Metal"}) routed(tag + " 10 dB weaker", weaker(tag), 2);
  const auto count = routed("Wood 10 dB weaker", weaker("Wood"), 2);
  EXPECT_EQ(std::max_element(count.begin(), count.end()) - count.begin(), 1);
  EXPECT_GE(share(count, 2), 0.5);
}

TEST_F(InterventionTest, ACouplingPeakIsAnUnsupportedAnchor) {
  const auto chain = std::make_shared<SignalChain>(lab_->twin.radar());
  const RadarConfig& radar = lab_->twin.radar();
  const EvaluationField field(lab_->options.config, radar, chain->axes());
  const SimulatedBranch coupled = [&](const Pose& pose) {
    Simulation s = lab_->twin.simulate(pose.T_map_radar, pose.stamp_ns);
    const double peak_db = field.normalise(chain->map(s.grid)).peak_db;
    static const std::string event = "tx_rx_leakage";
    PathRecord p;
    p.event = &event;
    p.departure = p.arrival = Eigen::Vector3d::UnitX();
    p.length_m.assign(static_cast<std::size_t>(radar.channels()), 1.2);
    p.c.assign(static_cast<std::size_t>(radar.channels()), 1);
    ReceiveGrid alone = s.grid;
    alone.x.setZero();
    accumulate(radar, {p}, alone.x);
    const double gain = std::pow(10.0, (peak_db + 0.3 - field.normalise(chain->map(alone)).peak_db) / 20);
    s.grid.x += gain * alone.x;
    return SimulatedPose{chain->map(s.grid), s.records};
  };
  const auto count = routed("coupling 0.3 dB above", lab_->against(coupled), 3);
  EXPECT_GE(share(count, 3), 0.6);
}

TEST_F(InterventionTest, AnUnmodelledObjectIsAMissingMechanism) {
  const std::string session = generate("unmodelled", "--effect actor_unmodelled");
  if (session.empty()) GTEST_SKIP() << "the session generator has no effect actor_unmodelled";
  const Laboratory changed(session);
  const auto count = routed("object that the scene lacks", changed.against(simulatedByTwin(changed.twin)), 5);
  EXPECT_GE(share(count, 5), 0.6);
  remove(session);
}

TEST_F(InterventionTest, RecordsOfASuppressedActorNameIt) {
  // Without suppression, a matched response's records name the actor of its region in most cases.
  int named = 0, all = 0;
  for (const PoseResult& pose : base_->poses) {
    for (const Residual& r : pose.attribution.residuals) {
      if (r.residual_class != ResidualClass::kWeakSupport || r.records.empty()) continue;
      ++all;
      const PathRecord& record = pose.residual_records.at(r.records.front());
      for (int actor : record.actors) {
        if (r.actor.find(lab_->twin.scene().actors[actor].name) != std::string::npos) {
          ++named;
          break;
        }
      }
    }
  }
  EXPECT_GT(all, 0);
  EXPECT_GE(named, all / 2);
}

}  // namespace
}  // namespace mmradartwin
