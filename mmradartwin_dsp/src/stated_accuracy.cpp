#include "mmradartwin_dsp/stated_accuracy.h"

#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {

const std::vector<AccuracyKey>& accuracyKeys() {
  static const std::vector<AccuracyKey> keys = {
      {"scene_m", "m", &StatedAccuracy::scene_m, 0.0005, 0.5},
      {"level_db", "dB", &StatedAccuracy::level_db, 0.05, 10},
      {"pose_m", "m", &StatedAccuracy::pose_m, 0, 0.5},
      {"heading_deg", "deg", &StatedAccuracy::heading_deg, 0.001, 10},
      {"path_range_m", "m", &StatedAccuracy::path_range_m, 0.0001, 0.2},
      {"path_angle_deg", "deg", &StatedAccuracy::path_angle_deg, 0.001, 5},
  };
  return keys;
}

std::map<std::string, double> readStatedAccuracy(YamlMap accuracy) {
  std::map<std::string, double> stated;
  for (const AccuracyKey& key : accuracyKeys()) {
    if (accuracy.has(key.name)) stated[key.name] = accuracy.number(key.name, key.min, key.max);
  }
  accuracy.rejectUnknownKeys();
  return stated;
}

StatedAccuracy with(StatedAccuracy accuracy, const std::map<std::string, double>& stated) {
  for (const AccuracyKey& key : accuracyKeys()) {
    const auto value = stated.find(key.name);
    if (value != stated.end()) accuracy.*key.member = value->second;
  }
  return accuracy;
}

StatedAccuracy loadStatedAccuracy(const std::string& file) {
  YamlMap yaml = YamlMap::load(file);
  const StatedAccuracy accuracy = with({}, readStatedAccuracy(yaml.map("accuracy")));
  yaml.rejectUnknownKeys();
  return accuracy;
}

}  // namespace mmradartwin
