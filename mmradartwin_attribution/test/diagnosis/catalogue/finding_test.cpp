#include "mmradartwin_attribution/finding.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

TEST(Finding, VerdictFollowsFromTheFindings) {
  Findings all;
  EXPECT_EQ(all.verdict(), "none");
  all.findings.resize(1);
  all.findings[0].cause = "unknown";
  EXPECT_EQ(all.verdict(), "unknown");
  all.findings.resize(2);
  all.findings[0].cause = "range_bias";
  all.findings[1].cause = "unknown";
  EXPECT_EQ(all.verdict(), "named");
}

TEST(Finding, ParametersAreFoundByName) {
  Finding finding;
  finding.parameters = {{"x_m", "m", 1.0, {}}, {"y_m", "m", 2.0, {}}};
  ASSERT_NE(finding.parameter("y_m"), nullptr);
  EXPECT_EQ(std::get<double>(finding.parameter("y_m")->value), 2);
  EXPECT_EQ(finding.parameter("y"), nullptr);
}

TEST(Finding, APlacesErrorIsHalfItsInterval) {
  Finding finding;
  EXPECT_EQ(finding.placeError_m(), (std::array<double, 2>{0, 0}));
  finding.parameters = {{"x_m", "m", 1.0, {{{0.5, 1.7}}}}, {"dy_m", "m", 0.0, {{{-0.25, 0.25}}}}};
  EXPECT_NEAR(finding.placeError_m()[0], 0.6, 1e-12);
  EXPECT_NEAR(finding.placeError_m()[1], 0.25, 1e-12);  // of a move
}

TEST(ChangedRecord, IsAsStrongAsTheStrongerOfBoth) {
  ChangedRecord record;
  record.before = RecordState{-80, 2, 0};
  EXPECT_EQ(record.strongest_db(), -80);
  record.after = RecordState{-70, 2, 0};
  EXPECT_EQ(record.strongest_db(), -70);
  record.before.reset();
  EXPECT_EQ(record.strongest_db(), -70);
}

TEST(Cause, EveryOneHasItsClassAndOnlyReflectorsAdmitMaterialChanges) {
  std::vector<std::string> material;
  for (const CauseDescription& c : causeDescriptions()) {
    EXPECT_FALSE(c.action().empty());
    if (materialChangeAdmissible(c.residual_class)) material.push_back(c.name);
  }
  EXPECT_EQ(material, (std::vector<std::string>{"material_reflectivity", "surface_roughness"}));
  EXPECT_EQ(causeDescription("corner_reflection").residual_class, ResidualClass::kMissingSupport);
  EXPECT_EQ(causeDescription("phase_drift").parameters[0].unit, "rad");
  EXPECT_THROW(causeDescription("magic"), InputError);
}

// What a twin can be extended by carries the cause's names and units (docs/reference/contracts.md section 5).
TEST(Cause, MechanismsOfThatNameHaveTheParameters) {
  int compared = 0;
  const std::vector<std::string> mechanisms = MechanismRegistry::instance().names();
  for (const CauseDescription& c : causeDescriptions()) {
    if (std::find(mechanisms.begin(), mechanisms.end(), c.name) == mechanisms.end()) continue;
    const auto specs = MechanismRegistry::instance().create(c.name)->parameters();
    for (const CauseParameter& p : c.parameters) {
      const auto spec = std::find_if(specs.begin(), specs.end(), [&](const auto& s) { return s.name == p.name; });
      ASSERT_NE(spec, specs.end()) << c.name << " " << p.name;
      EXPECT_EQ(spec->unit, p.unit) << c.name << " " << p.name;
      EXPECT_EQ(spec->kind, p.kind) << c.name << " " << p.name;
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

}  // namespace
}  // namespace mmradartwin
