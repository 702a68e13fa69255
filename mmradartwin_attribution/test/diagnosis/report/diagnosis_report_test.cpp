#include "mmradartwin_attribution/diagnosis_report.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

Diagnosis withAbsence() {
  Diagnosis d;
  d.has_twin = false;
  d.findings.held_out = "nothing: one location";
  Finding f;
  f.cause = "actor_absent";
  f.parameters = {{"actor", "", std::string("cabinet"), {}}};
  f.candidates = {{f.cause, 1.0}};
  f.where.emplace_back();
  f.records = {{"001", "specular", {"cabinet"}, RecordState{-80, 2, 10}, std::nullopt}};
  d.findings.findings = {f};
  d.plan.walls = {{"cabinet", {3, 1}, {3, 2}}};
  d.plan.stations = {{"001", {1, 1}, {1, 0}}, {"002", {1, 3}, {1, 0}}};
  return d;
}

TEST(DiagnosisReport, LeavesNothingOfTheOneBeforeBesideItsOwn) {
  const TemporaryFolder folder;
  const fs::path at = folder.path();
  const DiagnosisReport report(at.string());
  report.write(withAbsence(), {"diagnose"});
  const fs::path figure = at / "figures/actor_absent.png", records = at / "records/actor_absent.csv";
  ASSERT_TRUE(fs::exists(figure) && fs::exists(records));
  std::ofstream(at / "figures/mine.png") << "a picture of the user's";

  report.write(withAbsence(), {"diagnose"});
  EXPECT_TRUE(fs::exists(figure) && fs::exists(records));
  Diagnosis nothing = withAbsence();
  nothing.findings.findings.clear();
  report.write(nothing, {"diagnose"});
  EXPECT_FALSE(fs::exists(figure));
  EXPECT_FALSE(fs::exists(records));
  EXPECT_TRUE(fs::exists(at / "figures/mine.png"));
}

}  // namespace
}  // namespace mmradartwin
