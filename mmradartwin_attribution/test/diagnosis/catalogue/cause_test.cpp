#include <gtest/gtest.h>

#include <set>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/catalogue/stated_bounds.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis {
namespace {

/// True of causes with a mechanism of their name. More bounces are a number of `specular`.
bool hasMechanism(const CauseDescription& cause) { return cause.name != "unknown" && cause.name != "trace_coverage"; }

TEST(Catalogue, EveryCauseIsAMechanismOfTheSimulator) {
  for (const CauseDescription& cause : causeDescriptions()) {
    if (!hasMechanism(cause)) continue;
    EXPECT_NO_THROW(defaultMechanism(cause.name)) << cause.name;
  }
}

TEST(Catalogue, FormsThatAStepAsksForAreOneMechanismsAlone) {
  std::set<MechanismForm> seen;
  for (const CauseDescription& cause : causeDescriptions()) {
    const MechanismForm form = cause.traits.form;
    if (form == MechanismForm::kOrdinary || form == MechanismForm::kBodyFixedTone) continue;
    EXPECT_TRUE(seen.insert(form).second) << cause.name;
    EXPECT_EQ(mechanismOfForm(form), cause.name);
  }
  EXPECT_EQ(mechanismOfForm(MechanismForm::kLaw), "empirical_law");
  EXPECT_EQ(mechanismOfForm(MechanismForm::kOrdinary), "");
}

TEST(Catalogue, TraitsNameParametersThatTheirMechanismHas) {
  for (const CauseDescription& cause : causeDescriptions()) {
    if (!hasMechanism(cause)) continue;
    const NamedParameters mechanism = defaultMechanism(cause.name);
    for (const PlausibleRange& range : cause.traits.plausible) {
      EXPECT_TRUE(mechanism.values.has(range.parameter)) << cause.name << " " << range.parameter;
      EXPECT_LT(range.low, range.high) << cause.name;
    }
    if (!cause.traits.clutter_parameter.empty()) {
      EXPECT_TRUE(mechanism.values.has(cause.traits.clutter_parameter)) << cause.name;
    }
  }
}

TEST(Catalogue, TakesACauseOfAPlugInBeforeUnknownAndNoNameTwice) {
  EXPECT_THROW(addCause({"range_bias", ResidualClass::kShiftedResponse, {}, {}}), InputError);
  addCause({"user_cause",
            ResidualClass::kWeakSupport,
            {{"level_db", "dB"}},
            {MechanismForm::kOrdinary, Experiment::kRaise}});
  EXPECT_TRUE(isCatalogued("user_cause"));
  EXPECT_EQ(traitsOf("user_cause").experiment, Experiment::kRaise);
  EXPECT_EQ(causeDescriptions().back().name, "unknown");
}

TEST(StatedBounds, GrowInProportionToTheAccuracyOfTheScene) {
  StatedAccuracy fine, coarse;
  fine.scene_m = 0.01;
  coarse.scene_m = 0.05;
  const StatedBounds small(fine), large(coarse);
  EXPECT_DOUBLE_EQ(large.mostRangeError_m() / small.mostRangeError_m(), 5);
  EXPECT_DOUBLE_EQ(large.leastMove_m() / small.leastMove_m(), 5);
  EXPECT_DOUBLE_EQ(large.farAway_m() / small.farAway_m(), 5);
  EXPECT_DOUBLE_EQ(large.commonOffset_m() / small.commonOffset_m(), 5);
  EXPECT_DOUBLE_EQ(large.sureOffset_m() / small.sureOffset_m(), 5);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
