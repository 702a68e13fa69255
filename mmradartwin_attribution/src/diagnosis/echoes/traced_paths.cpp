#include "diagnosis/echoes/traced_paths.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>

#include "mmradartwin_attribution/mechanism_traits.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "mmradartwin_sim/mechanism_stages.h"

namespace mmradartwin::diagnosis::echoes {
namespace {

/// Limit of the amplitude's relative change within the pose's accuracy, for a steady path.
constexpr double kSteady = 0.02;
constexpr double kFaint = 1e-3;  ///< amplitude over the pose's strongest one, below which a path is below the clutter
/// Error of a pose for which pose-sensitive paths are found, to both sides.
struct Offset {
  double direction_rad;
  double sigma;   ///< in standard deviations
  double weight;  ///< share of poses with such an error
};
constexpr Offset kOffsets[] = {{0, 1.41, 0.5}, {M_PI / 2, 2.8, 0.02}};  // the usual one; across it one in a hundred
// Sizes of the cells of scatter points, small beside the radar's resolution. Cells are defined from the reported pose,
// so that a turned or moved radar has the same ones.
constexpr double kCloud_bins = 0.75, kCloud_lobes = 0.5, kCloudElevation = 0.175;
constexpr std::size_t kMostTwins = 6;    ///< twins that are kept
constexpr std::size_t kMostTraced = 64;  ///< lists of one mechanism and geometry that are kept
// Something this far behind the radar stays behind it for any offset of the radar.
constexpr double kBehind_m = 0.15, kBehindShare = 0.1;

const auto kNoPaths = std::make_shared<const TracedPaths::Paths>();

/// Text that is equal for mechanisms which trace the same paths.
std::string traceKeyOf(const NamedParameters& mechanism) {
  NamedParameters tracing{mechanism.mechanism, {}};
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism.mechanism)->parameters()) {
    const auto value = mechanism.values.all().find(s.name);
    if (!s.weighs && value != mechanism.values.all().end()) tracing.values.set(s.name, value->second);
  }
  TwinDescription description;
  description.mechanisms = {tracing};
  return description.toYaml();
}

/// Mechanisms of the list whose paths one of its mechanisms reads when it is traced.
std::vector<NamedParameters> mechanismsReadBy(const NamedParameters& mechanism,
                                              const std::vector<NamedParameters>& list) {
  std::vector<NamedParameters> read;
  const std::unique_ptr<Mechanism> reader = MechanismRegistry::instance().create(mechanism.mechanism);
  const auto* tracer = dynamic_cast<const PathStage*>(reader.get());
  if (tracer == nullptr) return read;
  for (const std::string& name : tracer->looksAtPathsOf()) {
    for (const NamedParameters& m : list) {
      if (m.mechanism == name) read.push_back(m);
    }
  }
  return read;
}

/// False where no part of a change lies before the radar or in the way of a path that reflects behind it.
bool mayTouch(const SceneChange& change, const Eigen::Isometry3d& T_map_radar, const std::vector<PathRecord>& paths) {
  const Eigen::Vector3d p = T_map_radar.translation(), forward = T_map_radar.linear().col(0);
  for (const Eigen::AlignedBox3d& box : change.bounds) {
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d way = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) - p;
      if (forward.dot(way) > -kBehind_m - kBehindShare * way.norm()) return true;
    }
  }
  return std::any_of(paths.begin(), paths.end(),
                     [&](const PathRecord& r) { return r.vertices.size() > 1 && change.touches(p, r); });
}

/// Appends paths of `from` that are weaker in `to`, scaled to the uncertain part of their amplitude.
void addUncertain(const std::vector<PathRecord>& from, const std::vector<PathRecord>& to, double weight,
                  double strongest_amplitude, std::vector<PathRecord>& uncertain) {
  for (const PathRecord& record : from) {
    const auto same = std::find_if(to.begin(), to.end(), [&](const PathRecord& o) {
      return o.event == record.event && o.facets == record.facets;
    });
    const double other = same == to.end() ? 0 : same->amplitude;
    if (record.amplitude <= other || record.amplitude == 0) continue;
    const double lost = (record.amplitude - other) / record.amplitude;
    const double share = std::sqrt(weight) * lost;
    if (lost <= kSteady || share * record.amplitude < kFaint * strongest_amplitude) continue;
    uncertain.push_back(record);
    scaleRecord(share, uncertain.back());
  }
}

}  // namespace

std::string traceKeyOf(const std::vector<NamedParameters>& mechanisms) {
  std::string key;
  for (const NamedParameters& m : mechanisms) key += traceKeyOf(m) + "|";
  return key;
}

TracedPaths::TracedPaths(const Twin& base, const ChannelData& data, double position_error_m)
    : base_(base), data_(data), position_error_m_(position_error_m) {}

const TracedPaths::Edit& TracedPaths::editOf(const NamedParameters& mechanism) {
  const std::string key = traceKeyOf(mechanism);
  const auto known = edits_.find(key);
  if (known != edits_.end()) return known->second;
  const Twin twin = base_.changed({mechanism});
  const Geometry geometry = twin.addsOccludersOnly() ? Geometry::kMoreScreens
                            : twin.altersGeometry()  ? Geometry::kOther
                                                     : Geometry::kSame;
  return edits_[key] = {geometry, twin.placesOneActor()};
}

bool TracedPaths::altersGeometry(const NamedParameters& mechanism) {
  return editOf(mechanism).geometry != Geometry::kSame;
}

std::shared_ptr<const Twin> TracedPaths::twinOf(const std::vector<NamedParameters>& mechanisms) {
  TwinDescription description;
  description.mechanisms = mechanisms;
  std::string text = description.toYaml();
  const auto found = std::find_if(twins_.begin(), twins_.end(), [&](const auto& kept) { return kept.first == text; });
  if (found != twins_.end()) {
    std::rotate(twins_.begin(), found, found + 1);
  } else {
    twins_.insert(twins_.begin(), {std::move(text), std::make_shared<const Twin>(base_.changed(mechanisms))});
    if (twins_.size() > kMostTwins) twins_.pop_back();
  }
  return twins_.front().second;
}

std::vector<NamedParameters> TracedPaths::geometryOf(const std::vector<NamedParameters>& mechanisms) {
  std::vector<NamedParameters> geometry;
  for (const NamedParameters& m : mechanisms) {
    if (altersGeometry(m)) geometry.push_back(m);
  }
  // Paths around a placed actor follow from the paths without it. Placed actors come last in any order of trying, so
  // that the same edits always give the same paths.
  std::stable_partition(geometry.begin(), geometry.end(),
                        [this](const NamedParameters& m) { return !editOf(m).addsToOthers(); });
  return geometry;
}

std::vector<NamedParameters> TracedPaths::withEdits(const std::vector<NamedParameters>& mechanisms,
                                                    const std::vector<NamedParameters>& edits) {
  std::vector<NamedParameters> all;
  for (const NamedParameters& m : mechanisms) {
    if (!altersGeometry(m)) all.push_back(m);
  }
  all.insert(all.end(), edits.begin(), edits.end());
  return all;
}

TracedPaths::Predecessor TracedPaths::predecessorOf(const std::vector<NamedParameters>& geometry,
                                                    const NamedParameters& mechanism,
                                                    const std::vector<NamedParameters>& mechanisms,
                                                    const std::vector<int>& missing, const Twin& twin) {
  Predecessor before;
  const bool own = geometry.empty() || traceKeyOf(geometry.back()) == traceKeyOf(mechanism);
  if (!own) before.edit = editOf(geometry.back());
  if (before.edit.geometry == Geometry::kSame) return before;
  std::vector<NamedParameters> rest(geometry.begin(), geometry.end() - 1);
  if (before.edit.placed && before.edit.placed->actor >= 0) {
    NamedParameters absent = defaultMechanism(mechanismOfForm(MechanismForm::kActorAbsent));
    absent.values.set("actor", base_.scene().actors[static_cast<std::size_t>(before.edit.placed->actor)].name);
    rest.push_back(std::move(absent));
  }
  const auto known =
      known_.find(traceKeyOf(rest) + traceKeyOf(mechanismsReadBy(mechanism, mechanisms)) + traceKeyOf(mechanism));
  if (before.edit.addsToOthers()) {
    before.paths = &of(rest, mechanism, mechanisms, missing);
  } else if (known != known_.end()) {
    known->second.used = call_;
    before.paths = &known->second.paths;
  }
  if (before.paths != nullptr) before.change = twin.changesFrom(*twinOf(withEdits(mechanisms, rest)));
  return before;
}

const TracedPaths::ByPose& TracedPaths::of(const std::vector<NamedParameters>& geometry,
                                           const NamedParameters& mechanism,
                                           const std::vector<NamedParameters>& mechanisms,
                                           const std::vector<int>& poses) {
  const std::string key = traceKeyOf(mechanism);
  Entry& entry = known_[traceKeyOf(geometry) + traceKeyOf(mechanismsReadBy(mechanism, mechanisms)) + key];
  entry.used = call_;
  entry.paths.resize(data_.poses.size());
  std::vector<int> missing;
  for (int i : poses) {
    if (!entry.paths[static_cast<std::size_t>(i)]) missing.push_back(i);
  }
  if (missing.empty()) return entry.paths;
  // One twin traces all mechanisms of a geometry.
  const std::vector<NamedParameters> all = withEdits(mechanisms, geometry);
  Task task;
  task.mechanism = static_cast<std::size_t>(
      std::find_if(all.begin(), all.end(), [&](const NamedParameters& m) { return traceKeyOf(m) == key; }) -
      all.begin());
  task.twin = twinOf(all);
  task.before = predecessorOf(geometry, mechanism, mechanisms, missing, *task.twin);
  task.opens = task.twin->removesActors();
  tbb::parallel_for(std::size_t{0}, missing.size(), [&](std::size_t j) {
    const std::size_t i = static_cast<std::size_t>(missing[j]);
    entry.paths[i] = pathsAt(task, i);
  });
  return entry.paths;
}

std::shared_ptr<const TracedPaths::Paths> TracedPaths::pathsAt(const Task& task, std::size_t pose) const {
  const Eigen::Isometry3d& T = data_.poses[pose].pose.T_map_radar;
  const Twin& twin = *task.twin;
  const Edit& edit = task.before.edit;
  const std::optional<SceneChange>& change = task.before.change;
  const std::shared_ptr<const Paths> known = task.before.paths != nullptr ? (*task.before.paths)[pose] : nullptr;
  if (known && change && !mayTouch(*change, T, *known)) return known;
  ScatterCells cells{T, kCloud_bins * base_.radar().range_bin_m(), kCloud_lobes * 2 / base_.radar().channels(),
                     kCloudElevation};
  // Points that the base scene hides stay separate where an edit removes an occluder: they have other weights.
  if (task.opens) {
    cells.sides = [&](const std::vector<Eigen::Vector3d>& points) {
      return base_.rays().visible(T.translation(), points, std::vector<double>(points.size(), 1e-3));
    };
  }
  Paths paths;
  try {
    if (known && edit.geometry == Geometry::kMoreScreens) {
      // A screen only hides paths: no new trace is needed.
      paths = *known;
      twin.removeHidden(T, paths);
    } else if (known && edit.placed) {
      paths = twin.traceAround(task.mechanism, T, cells, *edit.placed, *known);
    } else {
      paths = known && change && !task.opens ? twin.retrace(task.mechanism, T, cells, *change, *known)
                                             : twin.trace(task.mechanism, T, &cells);
    }
  } catch (const InputError&) {
    // The edit places something at the radar's position: the radar sees nothing.
  }
  return paths.empty() ? kNoPaths : std::make_shared<const Paths>(std::move(paths));
}

std::vector<int> TracedPaths::everyPose() const {
  std::vector<int> all(data_.poses.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

void TracedPaths::beginCall() {
  ++call_;
  const auto forget = [](auto& kept, std::size_t most) {
    while (kept.size() > most) {
      kept.erase(std::min_element(kept.begin(), kept.end(),
                                  [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
    }
  };
  forget(known_, kMostTraced);
  forget(pose_sensitive_, kMostTraced);
}

const TracedPaths::ByPose& TracedPaths::poseSensitive(const std::vector<NamedParameters>& mechanisms,
                                                      const std::vector<int>& poses) {
  // Edits that only add something leave the pose-sensitive paths of the others unchanged.
  std::vector<NamedParameters> moving, smooth;
  for (const NamedParameters& m : geometryOf(mechanisms)) {
    if (!editOf(m).addsToOthers()) moving.push_back(m);
  }
  Entry& entry = pose_sensitive_[traceKeyOf(moving)];
  entry.used = std::max(entry.used, call_);
  entry.paths.resize(data_.poses.size());
  std::vector<std::size_t> missing;
  for (int i : poses) {
    if (!entry.paths[static_cast<std::size_t>(i)]) missing.push_back(static_cast<std::size_t>(i));
  }
  if (missing.empty()) return entry.paths;
  for (const NamedParameters& m : mechanisms) {
    if (m.mechanism != "diffuse") smooth.push_back(m);  // its many points appear and vanish one by one
  }
  const Twin twin = base_.changed(smooth);
  tbb::parallel_for(std::size_t{0}, missing.size(),
                    [&](std::size_t j) { entry.paths[missing[j]] = poseSensitiveAt(twin, missing[j]); });
  return entry.paths;
}

std::shared_ptr<const TracedPaths::Paths> TracedPaths::poseSensitiveAt(const Twin& twin, std::size_t pose) const {
  const Eigen::Isometry3d& here = data_.poses[pose].pose.T_map_radar;
  Paths at_pose;
  try {
    at_pose = twin.trace(here);
  } catch (const InputError&) {
    return kNoPaths;  // an edit places something at the radar's position
  }
  double strongest_power = 0;
  for (const PathRecord& r : at_pose) strongest_power = std::max(strongest_power, r.amplitude * r.amplitude);
  const double strongest = std::sqrt(strongest_power);
  Paths uncertain;
  // Offsets turn from pose to pose, so that no direction is preferred.
  for (const Offset& offset : kOffsets) {
    const double turn = 2.4 * static_cast<double>(pose) + offset.direction_rad;
    const Eigen::Vector3d error =
        position_error_m_ * offset.sigma * Eigen::Vector3d(std::cos(turn), std::sin(turn), 1 / std::sqrt(2.0));
    for (const double sign : {-1.0, 1.0}) {
      Eigen::Isometry3d T = here;
      T.translation() += sign * error;
      try {
        const Paths shifted = twin.trace(T);
        addUncertain(at_pose, shifted, offset.weight, strongest, uncertain);
        addUncertain(shifted, at_pose, offset.weight, strongest, uncertain);
      } catch (const InputError&) {
        // The shifted pose lies inside something; the pose itself does not.
      }
    }
  }
  return uncertain.empty() ? kNoPaths : std::make_shared<const Paths>(std::move(uncertain));
}

void TracedPaths::setBaseline(const std::vector<NamedParameters>& mechanisms) {
  const std::string geometry = traceKeyOf(geometryOf(mechanisms));
  std::vector<std::string> wanted;
  for (const NamedParameters& m : mechanisms) {
    wanted.push_back(geometry + traceKeyOf(mechanismsReadBy(m, mechanisms)) + traceKeyOf(m));
  }
  if (wanted != baseline_) {
    pose_sensitive_.clear();
    poseSensitive(mechanisms, everyPose());
    pose_sensitive_.begin()->second.used = std::numeric_limits<std::size_t>::max();  // never forgotten
  }
  baseline_ = wanted;
  for (auto entry = known_.begin(); entry != known_.end();) {
    const bool kept = std::find(wanted.begin(), wanted.end(), entry->first) != wanted.end();
    entry = kept ? std::next(entry) : known_.erase(entry);
  }
}

}  // namespace mmradartwin::diagnosis::echoes
