#include "mmradartwin_sim/scan_refinement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr double kMostRange_m = 0.5;    // a scan that is farther off is another room's
constexpr double kSamePlane_m = 0.001;  // parts of one wall share their plane exactly
constexpr double kSameNormal = 1 - 1e-6;

const MeasuredRange* rangeOf(const std::string& actor, const std::vector<MeasuredRange>& ranges) {
  const auto found =
      std::find_if(ranges.begin(), ranges.end(), [&](const MeasuredRange& r) { return r.actor == actor; });
  return found == ranges.end() ? nullptr : &*found;
}

bool isSamePlane(const PlaneShift& shift, const ScanPlane& plane) {
  return shift.normal.dot(plane.normal) > kSameNormal && std::abs(shift.offset_m - plane.offset_m) < kSamePlane_m;
}

}  // namespace

std::vector<MeasuredRange> readRefinement(const std::string& path) {
  std::filesystem::path given(path);
  if (std::filesystem::is_directory(given)) {
    given /= "refinement.yaml";
    if (!std::filesystem::exists(given)) {
      throw InputError(path + ": holds no refinement.yaml; `rosrun mmradartwin_attribution refine_scene " + path +
                       " --output DIR` measures one");
    }
  }
  YamlMap file = YamlMap::load(given.string());
  file.choice("format", {"mmradartwin_refinement/1"});
  for (const char* key : {"recording", "scene_m", "poses", "locations", "held_out_nats_per_pose"}) {
    if (file.has(key)) file.dump(key);
  }
  std::vector<MeasuredRange> ranges;
  YamlMap actors = file.map("actors");
  for (const std::string& name : actors.keys()) {
    YamlMap actor = actors.map(name);
    ranges.push_back(
        {name, actor.number("range_m", -kMostRange_m, kMostRange_m), actor.number("std_m", 1e-6, kMostRange_m)});
    actor.rejectUnknownKeys();
  }
  file.rejectUnknownKeys();
  return ranges;
}

std::vector<PlaneShift> shiftsOf(const ScanScene& scene, const std::vector<MeasuredRange>& ranges,
                                 const std::string& file) {
  std::vector<PlaneShift> shifts;
  std::vector<double> weights;
  for (const ScanPlane& plane : scene.planes) {
    const MeasuredRange* range = rangeOf(plane.name, ranges);
    if (!range || plane.kind != PlaneKind::kWall) continue;
    // The radar stands before the wall: what is farther lies against the normal.
    const double weight = 1 / (range->std_m * range->std_m);
    const auto known =
        std::find_if(shifts.begin(), shifts.end(), [&](const PlaneShift& shift) { return isSamePlane(shift, plane); });
    if (known == shifts.end()) {
      shifts.push_back({plane.normal, plane.offset_m, -range->range_m});
      weights.push_back(weight);
    } else {
      double& sum = weights[static_cast<std::size_t>(known - shifts.begin())];
      known->by_m = (sum * known->by_m - weight * range->range_m) / (sum + weight);
      sum += weight;
    }
  }
  if (shifts.empty()) {
    throw InputError(file + ": names no wall of this scan; measure with the scene that make_scene made of it");
  }
  return shifts;
}

std::vector<std::string> refinementNotes(const ScanScene& scene, const std::vector<MeasuredRange>& ranges) {
  std::vector<std::string> notes;
  for (const ScanPlane& plane : scene.planes) {
    const MeasuredRange* range = rangeOf(plane.name, ranges);
    if (!range || plane.kind != PlaneKind::kWall) continue;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(), "%s moves %.1f mm %s by the radar (+- %.1f mm)", plane.name.c_str(),
                  1000 * std::abs(range->range_m), range->range_m > 0 ? "outwards" : "inwards", 1000 * range->std_m);
    notes.emplace_back(text.data());
  }
  return notes;
}

}  // namespace mmradartwin
