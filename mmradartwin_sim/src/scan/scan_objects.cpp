#include "mmradartwin_sim/scan_objects.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/material_presets.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kFewestPointsOfObject = 4;       // a drawing of a box has few; thinning asks for surface
constexpr double kFarthestObject_m = 1e6;              // a map may have large coordinates
constexpr double kLeastNorm = 0.98, kMostNorm = 1.02;  // of a quaternion that is written with two digits

Eigen::Isometry3d poseOf(YamlMap& object) {
  const std::vector<double> p = object.numbers("pose", -kFarthestObject_m, kFarthestObject_m);
  if (p.size() != 7) {
    object.fail("pose", "has " + std::to_string(p.size()) + " numbers; wants x, y, z (metres), qx, qy, qz, qw");
  }
  const Eigen::Quaterniond q(p[6], p[3], p[4], p[5]);
  if (q.norm() < kLeastNorm || q.norm() > kMostNorm) {
    object.fail("pose", "its last four numbers are no unit quaternion qx, qy, qz, qw (length " +
                            std::to_string(q.norm()) + ")");
  }
  return Eigen::Translation3d(p[0], p[1], p[2]) * q.normalized();
}

std::string materialOf(YamlMap& object) {
  if (!object.has("material")) return "";
  std::vector<std::string> known;
  for (const MaterialPreset& preset : materialPresets()) known.emplace_back(preset.tag);
  return object.choice("material", known);
}

/// Names go into OBJ files and tables as they are.
bool isPlainName(const std::string& name) {
  return !name.empty() && std::all_of(name.begin(), name.end(), [](unsigned char c) {
    return std::isalnum(c) || c == '_' || c == '-' || c == '.';
  });
}

}  // namespace

std::vector<ScanObject> readScanObjects(const std::string& objects_yaml) {
  YamlMap file = YamlMap::load(objects_yaml);
  YamlMap list = file.map("objects");
  file.rejectUnknownKeys();
  const std::filesystem::path folder = std::filesystem::path(objects_yaml).parent_path();
  std::vector<ScanObject> objects;
  for (const std::string& name : list.keys()) {
    if (!isPlainName(name)) list.fail(name, "is no name of an actor; use letters, digits, _, - and .");
    YamlMap entry = list.map(name);
    ScanObject object;
    object.name = name;
    object.T_object = poseOf(entry);
    object.in_scan = entry.has("frame") && entry.choice("frame", {"map", "scan"}) == "scan";
    object.material = materialOf(entry);
    if (entry.has("unit")) {
      const std::string unit = entry.choice("unit", {"m", "cm", "mm"});
      object.unit_m = unit == "mm" ? 1e-3 : unit == "cm" ? 1e-2 : 1.0;
    }
    const std::filesystem::path scan = entry.text("file");
    entry.rejectUnknownKeys();
    object.scan = readScan((scan.is_absolute() ? scan : folder / scan).string(), kFewestPointsOfObject);
    objects.push_back(std::move(object));
  }
  if (objects.empty()) throw InputError(objects_yaml + ": key objects: names no object");
  return objects;
}

}  // namespace mmradartwin
