#include "mmradartwin_attribution/finding.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

Finding pattern() {
  Finding f;
  f.cause = "element_pattern";
  f.parameters = {{"cos_exponent", "1", 2.1, {{{1.8, 2.4}}}}};
  f.mechanism = NamedParameters{"element_pattern", {}};
  f.mechanism->values.set("cos_exponent", 2.1);
  f.candidates = {{"element_pattern", 0.75}, {"material_reflectivity", 0.25}};
  f.experiment = "turn the radar by 90 deg at one place";
  f.evidence = {412.5, 0.001, "material_reflectivity", 96.0};
  f.gain.emplace();
  f.gain->explained_power = {0.52, 0.81, {{0.25, 0.33}}};
  f.gain->classes[1] = {40, 12, {}};
  f.gain->recall_band[2] = {0.5, 0.75, {}};
  FindingPlace place;
  place.range_m = {1.0, 8.0};
  place.azimuth_deg = {-60.0, -30.0};
  place.actors = {"wall_west"};
  place.poses = {"012", "047"};
  f.where = {place};
  f.figure = "figures/element_pattern.png";
  return f;
}

Findings session() {
  Findings all;
  all.poses = 154;
  all.locations = 22;
  all.held_out = "5-fold by location";
  Finding channels;
  channels.cause = "channel_phase_error";
  channels.parameters = {{"phase_deg", "deg", std::vector<double>{0, 4.5, -2}, {{{0, 0}}, {{4, 5}}, {{-2.5, -1.5}}}},
                         {"gain_db", "dB", std::vector<double>{0, 0.1, 0.2}, {}}};
  Finding ghost;
  ghost.cause = "wall_ghost";
  ghost.parameters = {{"walls", "", std::vector<std::string>{"wall_west"}, {}}};
  Finding unknown;
  unknown.cause = "unknown";
  unknown.description = "4 dB at 3 m \xc2\xb1 \"0.2\" m";
  FindingPlace room;
  room.x_m = 1.5;
  room.y_m = -2.0;
  unknown.where = {room};
  all.findings = {pattern(), channels, ghost, unknown};
  all.extended_twin = "twin.extended.yaml";
  return all;
}

std::string inputError(const std::string& text) {
  try {
    parseFindings(text, "findings.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

/// findings.json of session() after a change.
template <typename Change>
std::string changed(Change change) {
  nlohmann::json j = nlohmann::json::parse(toJson(session()));
  change(j);
  return inputError(j.dump());
}

TEST(Finding, JsonIsAsTheContractGivesIt) {
  const nlohmann::json j = nlohmann::json::parse(toJson(session()));
  EXPECT_EQ(j["format"], "mmradartwin_findings/1");
  EXPECT_EQ(j["verdict"], "named");
  EXPECT_EQ(j["poses"], (nlohmann::json{{"count", 154}, {"locations", 22}, {"held_out", "5-fold by location"}}));
  const nlohmann::json& f = j["findings"][0];
  EXPECT_EQ(f["class"], "C3");
  EXPECT_NE(f["action"].get<std::string>().find("antenna-response modelling"), std::string::npos);
  EXPECT_EQ(f["parameters"]["cos_exponent"],
            nlohmann::json::parse(R"({"value": 2.1, "unit": "1", "ci95": [1.8, 2.4]})"));
  EXPECT_EQ(f["mechanism"], nlohmann::json::parse(R"({"element_pattern": {"cos_exponent": 2.1}})"));
  EXPECT_EQ(f["gain"]["explained_power"],
            nlohmann::json::parse(R"({"before": 0.52, "after": 0.81, "difference_ci95": [0.25, 0.33]})"));
  EXPECT_TRUE(f["gain"]["q1"]["before"].is_null());
  EXPECT_EQ(f["where"][0], nlohmann::json::parse(R"({"range_m": [1.0, 8.0], "azimuth_deg": [-60.0, -30.0],
      "actors": ["wall_west"], "poses": ["012", "047"], "x_m": null, "y_m": null})"));
  EXPECT_EQ(j["findings"][1]["parameters"]["phase_deg"]["ci95"][2], (nlohmann::json{-2.5, -1.5}));
  EXPECT_EQ(j["findings"][2]["parameters"]["walls"], nlohmann::json::parse(R"({"value": ["wall_west"]})"));
  EXPECT_TRUE(j["findings"][2]["gain"].is_null());
  EXPECT_EQ(nlohmann::json::parse(toJson(session().findings[0])), f);
}

TEST(Finding, ReadsBackWhatItWrites) {
  std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_test_XXXXXX").string();
  const std::filesystem::path folder = ::mkdtemp(pattern.data());
  const std::string file = (folder / "findings.json").string();
  writeFindings(session(), file);
  const Findings read = readFindings(file);
  std::filesystem::remove_all(folder);
  EXPECT_EQ(toJson(read), toJson(session()));
  EXPECT_EQ(read.findings[0].gain->recall_band[2].after, 0.75);
  EXPECT_TRUE(std::isnan(read.findings[0].gain->q2.after));
  EXPECT_EQ(std::get<std::vector<std::string>>(read.findings[2].parameter("walls")->value).front(), "wall_west");
  EXPECT_EQ(read.findings[3].where[0].y_m, -2.0);
  EXPECT_THROW(writeFindings(session(), (folder / "absent" / "findings.json").string()), std::runtime_error);
}

TEST(Finding, VerdictFollowsFromTheFindings) {
  Findings all = session();
  EXPECT_EQ(all.verdict(), "named");
  all.findings.erase(all.findings.begin(), all.findings.end() - 1);
  EXPECT_EQ(all.verdict(), "unknown");
  all.findings.clear();
  EXPECT_EQ(all.verdict(), "none");
  EXPECT_EQ(parseFindings(toJson(all), "findings.json").verdict(), "none");
}

TEST(Finding, ErrorsNameFileAndKey) {
  using J = nlohmann::json;
  const auto expect = [](const std::string& message, const std::string& place, const std::string& why) {
    EXPECT_NE(message.find("findings.json"), std::string::npos) << message;
    EXPECT_NE(message.find(place), std::string::npos) << message;
    EXPECT_NE(message.find(why), std::string::npos) << message;
  };
  expect(inputError("{"), "findings.json", "no JSON");
  expect(changed([](J& j) { j["format"] = "2"; }), "/format", "mmradartwin_findings/1");
  expect(changed([](J& j) { j["extra"] = 1; }), "findings.json", "extra");
  expect(changed([](J& j) { j.erase("poses"); }), "poses", "missing");
  expect(changed([](J& j) { j["poses"]["count"] = -1; }), "/poses/count", "whole number");
  expect(changed([](J& j) { j["verdict"] = "none"; }), "/verdict", "named");
  expect(changed([](J& j) { j["findings"][0]["cause"] = "magic"; }), "/findings/0/cause", "range_bias");
  expect(changed([](J& j) { j["findings"][0]["class"] = "C2"; }), "/findings/0/class", "C3");
  expect(changed([](J& j) { j["findings"][1]["parameters"].erase("gain_db"); }), "findings/1/", "gain_db");
  expect(changed([](J& j) { j["findings"][0]["parameters"].clear(); }), "findings/0/parameters", "cos_exponent or");
  expect(changed([](J& j) { j["findings"][1]["parameters"]["phase_deg"]["unit"] = "rad"; }), "phase_deg", "'deg'");
  expect(changed([](J& j) {
           j["findings"][1]["parameters"]["phase_deg"]["ci95"] = J::array({J::array({1, 2})});
         }),
         "phase_deg", "interval");
  expect(changed([](J& j) { j["findings"][0]["parameters"]["cos_exponent"]["value"] = true; }), "cos_exponent/value",
         "number");
  expect(changed([](J& j) { j["findings"][0]["where"][0]["actors"] = "wall"; }), "where/0/actors", "list");
  expect(changed([](J& j) { j["findings"][0]["gain"]["q1"].erase("after"); }), "gain/q1", "after");
  expect(changed([](J& j) { j["findings"][0]["candidates"][1]["probability"] = 0.5; }), "candidates", "more than 1");
  expect(changed([](J& j) { std::swap(j["findings"][2], j["findings"][3]); }), "findings/2", "last");
  EXPECT_THROW(readFindings("/nowhere/findings.json"), InputError);
}

TEST(Finding, IncompleteOnesAreNotWritten) {
  Findings all = session();
  all.findings[0].parameters[0].value = std::nan("");
  EXPECT_THROW(toJson(all), std::logic_error);
  all = session();
  all.findings[3].description.reset();
  EXPECT_THROW(toJson(all), std::logic_error);
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

// What a twin can be extended by carries the cause's names and units (DESIGN section 5).
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
