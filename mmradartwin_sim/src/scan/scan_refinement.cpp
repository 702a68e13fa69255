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

constexpr double kMostRange_m = 0.5;  // a scan that is farther off is another room's

const MeasuredRange* rangeOf(const std::string& actor, const std::vector<MeasuredRange>& ranges) {
  const auto found =
      std::find_if(ranges.begin(), ranges.end(), [&](const MeasuredRange& r) { return r.actor == actor; });
  return found == ranges.end() ? nullptr : &*found;
}

void readShift(YamlMap& actor, MeasuredRange& range) {
  const std::vector<double> shift = actor.numbers("shift_m", -kMostRange_m, kMostRange_m);
  if (shift.size() != 2) actor.fail("shift_m", "wants x and y");
  const std::vector<double> covariance = actor.numbers("shift_covariance_m2", -1, 1);
  if (covariance.size() != 3 || !(covariance[0] > 0) || !(covariance[2] > 0)) {
    actor.fail("shift_covariance_m2", "wants xx, xy and yy, of which xx and yy are positive");
  }
  range.shift_m = Eigen::Vector2d(shift[0], shift[1]);
  range.shift_std_m = Eigen::Vector2d(std::sqrt(covariance[0]), std::sqrt(covariance[2]));
}

/// Whether a thing stands behind a wall, or nearer to it than it did and nearer than things end before walls.
bool runsIntoWall(const ScanScene& scene, const ScanThing& thing, const Eigen::Vector3d& by) {
  constexpr double kNearest_m = 0.001;
  for (const ScanPlane& wall : scene.planes) {
    if (wall.kind != PlaneKind::kWall) continue;
    Eigen::AlignedBox1d span;
    for (const Eigen::Vector2d& q : wall.outline) span.extend(Eigen::Matrix<double, 1, 1>(q.x()));
    for (const Eigen::Vector3d& v : thing.vertices) {
      const double before = wall.normal.dot(v) - wall.offset_m, after = before + wall.normal.dot(by);
      if (before > 0 && after < kNearest_m && span.contains(Eigen::Matrix<double, 1, 1>(wall.u.dot(v)))) return true;
    }
  }
  return false;
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
    MeasuredRange range{
        name, actor.number("range_m", -kMostRange_m, kMostRange_m), actor.number("std_m", 1e-6, kMostRange_m), {}, {}};
    if (actor.has("shift_m")) readShift(actor, range);
    ranges.push_back(range);
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
        std::find_if(shifts.begin(), shifts.end(), [&](const PlaneShift& shift) { return shift.plane == plane.plane; });
    if (known == shifts.end()) {
      shifts.push_back({plane.plane, -range->range_m});
      weights.push_back(weight);
    } else {
      double& sum = weights[static_cast<std::size_t>(known - shifts.begin())];
      known->by_m = (sum * known->by_m - weight * range->range_m) / (sum + weight);
      sum += weight;
    }
  }
  const bool any_thing = std::any_of(scene.things.begin(), scene.things.end(),
                                     [&](const ScanThing& thing) { return rangeOf(thing.name, ranges) != nullptr; });
  if (shifts.empty() && !any_thing) {
    throw InputError(file + ": names no wall or thing of this scan; measure with the scene that make_scene made of it");
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

std::vector<std::string> moveThings(const std::vector<MeasuredRange>& ranges, ScanScene& scene) {
  std::vector<std::string> notes;
  for (std::size_t t = 0; t < scene.things.size(); ++t) {
    ScanThing& thing = scene.things[t];
    const MeasuredRange* range = rangeOf(thing.name, ranges);
    if (!range || !range->shift_m) continue;
    const Eigen::Vector3d by(range->shift_m->x(), range->shift_m->y(), 0);
    std::array<char, 200> text{};
    if (runsIntoWall(scene, thing, by)) {
      std::snprintf(text.data(), text.size(), "%s stays: the radar has it by (%.1f, %.1f) mm aside, within a wall",
                    thing.name.c_str(), 1000 * by.x(), 1000 * by.y());
      notes.emplace_back(text.data());
      continue;
    }
    for (Eigen::Vector3d& v : thing.vertices) v += by;
    thing.bounds.translate(by);
    scene.actors[scene.planes.size() + t].vertices = thing.vertices;
    std::snprintf(text.data(), text.size(), "%s moves by (%.1f +- %.1f, %.1f +- %.1f) mm by the radar",
                  thing.name.c_str(), 1000 * by.x(), 1000 * range->shift_std_m->x(), 1000 * by.y(),
                  1000 * range->shift_std_m->y());
    notes.emplace_back(text.data());
  }
  return notes;
}

}  // namespace mmradartwin
