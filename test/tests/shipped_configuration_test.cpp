// Every YAML file below config/ is read by the code that reads it for a user; a file of unknown kind fails the test.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/material.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

const fs::path kConfig = MMRADARTWIN_CONFIG_FOLDER;

std::vector<std::string> shippedFiles() {
  std::vector<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(kConfig)) {
    if (entry.path().extension() == ".yaml") files.push_back(fs::relative(entry.path(), kConfig).string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

class ShippedConfiguration : public testing::TestWithParam<std::string> {};

TEST_P(ShippedConfiguration, Loads) {
  const fs::path file = kConfig / GetParam();
  const std::string name = file.filename().string(), folder = file.parent_path().filename().string();
  if (name == "radar.yaml" || name == "awr2243boost.yaml") {
    const RadarConfig radar = loadRadarConfig(file.string());
    EXPECT_GT(SignalChain(radar).axes().range_m.back(), 1.0);
  } else if (name == "attribution.yaml") {
    EXPECT_NO_THROW(loadAttributionConfig(file.string()));
  } else if (name == "diagnosis.yaml") {
    // The file says that it holds what the programs have built in.
    const StatedAccuracy shipped = loadStatedAccuracy(file.string());
    for (const AccuracyKey& key : accuracyKeys()) EXPECT_EQ(shipped.*key.member, StatedAccuracy().*key.member);
  } else if (name == "scene.yaml") {
    const RadarConfig radar = loadRadarConfig((kConfig / "radar.yaml").string());
    const Twin twin(loadTwin("", file.string(), radar));
    EXPECT_GT(twin.scene().facets.size(), 10u);
  } else if (name == "diagnostic_aggregator.yaml") {
    // Read by diagnostic_aggregator; a group that takes no name would be left out without a word.
    const YAML::Node analyzers = YAML::LoadFile(file.string())["analyzers"];
    EXPECT_GE(analyzers.size(), 5u);
    for (const auto& group : analyzers) {
      EXPECT_EQ(group.second["type"].as<std::string>(), "diagnostic_aggregator/GenericAnalyzer");
      EXPECT_FALSE(group.second["contains"].as<std::vector<std::string>>().empty()) << group.first.as<std::string>();
    }
  } else if (name == "materials.yaml" || folder == "materials") {
    EXPECT_GE(loadMaterials(file.string()).size(), 7u);
  } else {
    FAIL() << "no reader is known for " << file << "; add one here";
  }
}

INSTANTIATE_TEST_SUITE_P(All, ShippedConfiguration, testing::ValuesIn(shippedFiles()), [](const auto& info) {
  std::string name = info.param;
  std::replace_if(
      name.begin(), name.end(), [](unsigned char c) { return !std::isalnum(c); }, '_');
  return name;
});

}  // namespace
}  // namespace mmradartwin
