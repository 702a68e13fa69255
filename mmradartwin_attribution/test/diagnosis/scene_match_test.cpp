#include "diagnosis/scene_match.h"

#include <gtest/gtest.h>

#include "cabinet_twin.h"
#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/gain/held_out_gain.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin::diagnosis {
namespace {

template <typename Check>
std::string inputError(Check check) {
  try {
    check();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(SameGrid, IsAskedOfChannelsAndSamplesAlone) {
  const Twin twin = CabinetTwin().with({});
  RadarConfig recorded = paperRadar();
  recorded.carrier_hz *= 1.01;
  recorded.tx_position_m[1].y() *= 1.01;
  EXPECT_EQ(inputError([&] { requireSameGrid(twin, recorded); }), "");
  recorded.samples_per_chirp = 128;
  const std::string samples = inputError([&] { requireSameGrid(twin, recorded); });
  EXPECT_TRUE(contains(samples, "8 virtual channels of 64 samples")) << samples;
  EXPECT_TRUE(contains(samples, "the recording has 8 virtual channels of 128 samples")) << samples;
  recorded = paperRadar();
  recorded.tx_position_m.pop_back();
  EXPECT_TRUE(contains(inputError([&] { requireSameGrid(twin, recorded); }), "4 virtual channels"));
}

/// Radars that see the cabinet at ranges of their own.
class SceneMatch : public ::testing::Test {
 protected:
  std::optional<Finding> findingAt(const std::vector<Eigen::Isometry3d>& poses,
                                   const std::vector<Eigen::Isometry3d>& measured_from) {
    ChannelData data = channelsAt(poses);
    const SignalChain chain(data.radar);
    const Twin twin = cabinet_.with({defaultMechanism("specular")});
    for (std::size_t i = 0; i < poses.size(); ++i) {
      data.poses[i].grid = twin.simulate(measured_from[i]).grid;
      transformGrid(chain, data.poses[i]);
    }
    ExpectedEchoes source(twin, data, PoseAccuracy());
    const std::vector<PoseEchoes> echoes = source.echoes({defaultMechanism("specular")});
    return nothingMatches(data, echoes, explainedPower(cellPowers(data, echoes)));
  }
  CabinetTwin cabinet_;
  std::vector<Eigen::Isometry3d> poses_ = {facingEastAt(-2, 0), facingEastAt(-1, 0), facingEastAt(0, 0),
                                           facingEastAt(1, 0)};
};

TEST_F(SceneMatch, IsThereWhereEachPoseMeasuresItsOwnEchoes) { EXPECT_FALSE(findingAt(poses_, poses_)); }

TEST_F(SceneMatch, IsMissingWhereEchoesStandAtRandom) {
  const std::vector<Eigen::Isometry3d> elsewhere = {facingEastAt(-1.5, 0), facingEastAt(-2.5, 0), facingEastAt(1.5, 0),
                                                    facingEastAt(-3.5, 0)};
  const std::optional<Finding> finding = findingAt(poses_, elsewhere);
  ASSERT_TRUE(finding);
  EXPECT_EQ(finding->cause, "unknown");
  ASSERT_TRUE(finding->description);
  EXPECT_TRUE(contains(*finding->description, "nothing matches")) << *finding->description;
  EXPECT_NO_THROW(toJson(*finding));
}

TEST_F(SceneMatch, CannotBeJudgedWhereAllPosesSeeTheSame) {
  const std::vector<Eigen::Isometry3d> same = {facingEastAt(0, 0), facingEastAt(0.1, 0), facingEastAt(0.2, 0.1)};
  EXPECT_FALSE(findingAt(same, {facingEastAt(-2, 0), facingEastAt(-2, 0), facingEastAt(-2, 0)}));
}

}  // namespace
}  // namespace mmradartwin::diagnosis
