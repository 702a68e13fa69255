#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/temporary_folder.h"

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

TEST(FindingJson, JsonIsAsTheContractGivesIt) {
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

TEST(FindingJson, ReadsBackWhatItWrites) {
  const TemporaryFolder temporary;
  const std::filesystem::path folder = temporary.path();
  const std::string file = (folder / "findings.json").string();
  writeFindings(session(), file);
  const Findings read = readFindings(file);
  EXPECT_EQ(toJson(read), toJson(session()));
  EXPECT_EQ(read.findings[0].gain->recall_band[2].after, 0.75);
  EXPECT_TRUE(std::isnan(read.findings[0].gain->q2.after));
  EXPECT_EQ(std::get<std::vector<std::string>>(read.findings[2].parameter("walls")->value).front(), "wall_west");
  EXPECT_EQ(read.findings[3].where[0].y_m, -2.0);
  EXPECT_THROW(writeFindings(session(), (folder / "absent" / "findings.json").string()), std::runtime_error);
}

TEST(FindingJson, ErrorsNameFileAndKey) {
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

TEST(FindingJson, IncompleteOnesAreNotWritten) {
  Findings all = session();
  all.findings[0].parameters[0].value = std::nan("");
  EXPECT_THROW(toJson(all), std::logic_error);
  all = session();
  all.findings[3].description.reset();
  EXPECT_THROW(toJson(all), std::logic_error);
}

TEST(FindingJson, WhatIsReadOfAFieldIsWhatWasWritten) {
  const Findings read = parseFindings(toJson(session()), "findings.json");
  ASSERT_EQ(read.findings.size(), 4u);
  EXPECT_EQ(read.poses, 154);
  EXPECT_EQ(read.locations, 22);
  EXPECT_EQ(read.held_out, "5-fold by location");
  EXPECT_EQ(read.extended_twin, "twin.extended.yaml");
  const Finding& f = read.findings[0];
  EXPECT_EQ(f.candidates[1].cause, "material_reflectivity");
  EXPECT_EQ(f.candidates[1].probability, 0.25);
  EXPECT_EQ(f.experiment, "turn the radar by 90 deg at one place");
  EXPECT_EQ(f.evidence.log_likelihood_gain, 412.5);
  EXPECT_EQ(f.evidence.false_alarm_rate, 0.001);
  EXPECT_EQ(f.evidence.runner_up, "material_reflectivity");
  EXPECT_EQ(f.evidence.margin, 96);
  EXPECT_EQ(f.gain->classes[1].before, 40);
  EXPECT_FALSE(f.gain->classes[1].difference_ci95);
  EXPECT_EQ((*f.gain->explained_power.difference_ci95)[1], 0.33);
  EXPECT_EQ((*f.where[0].azimuth_deg)[0], -60);
  EXPECT_EQ(f.where[0].poses, (std::vector<std::string>{"012", "047"}));
  EXPECT_EQ(f.mechanism->values.number("cos_exponent"), 2.1);
  EXPECT_EQ(read.findings[1].parameter("phase_deg")->ci95.size(), 3u);
  EXPECT_EQ(read.findings[1].parameter("phase_deg")->ci95[2][0], -2.5);
  EXPECT_EQ(read.findings[3].description, "4 dB at 3 m \xc2\xb1 \"0.2\" m");
}

TEST(FindingJson, CandidatesOfOneCauseSayWhatTellsThemApart) {
  Findings all = session();
  all.findings[0].candidates = {{"element_pattern", 0.5, {{"cos_exponent", "1", 2.1, {}}}},
                                {"element_pattern", 0.5, {{"cos_exponent", "1", 3.5, {}}}}};
  const Findings read = parseFindings(toJson(all), "findings.json");
  EXPECT_EQ(std::get<double>(read.findings[0].candidates[1].parameters.at(0).value), 3.5);
  EXPECT_EQ(toJson(read), toJson(all));
}

TEST(FindingJson, NoKeyMayBeAddedAnywhere) {
  using J = nlohmann::json;
  const std::vector<std::string> objects = {"/poses",
                                            "/findings/0",
                                            "/findings/0/evidence",
                                            "/findings/0/gain",
                                            "/findings/0/gain/recall",
                                            "/findings/0/gain/recall/bands",
                                            "/findings/0/gain/classes",
                                            "/findings/0/where/0",
                                            "/findings/0/candidates/0",
                                            "/findings/0/parameters/cos_exponent"};
  for (const std::string& object : objects) {
    const std::string error = changed([&](J& j) { j[J::json_pointer(object)]["surplus"] = 1; });
    EXPECT_NE(error.find("surplus"), std::string::npos) << object << ": " << error;
  }
}

// Every key is asked for: of a file without it the error names it.
TEST(FindingJson, NoKeyOfTheContractMayBeMissing) {
  using J = nlohmann::json;
  for (const std::string key :
       {"cause", "class", "action", "parameters", "mechanism", "candidates", "evidence", "gain", "where"}) {
    const std::string error = changed([&](J& j) { j["findings"][0].erase(key); });
    EXPECT_NE(error.find(key), std::string::npos) << key << ": " << error;
    EXPECT_NE(error.find("findings/0"), std::string::npos) << error;
  }
  for (const std::string key : {"format", "poses", "verdict", "findings"}) {
    EXPECT_NE(changed([&](J& j) { j.erase(key); }).find(key), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace mmradartwin
