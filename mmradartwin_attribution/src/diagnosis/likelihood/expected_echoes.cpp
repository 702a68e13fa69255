#include "diagnosis/likelihood/expected_echoes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/functional/hash.hpp>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <tuple>

#include "diagnosis/numbers/packed_hermitian.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis::likelihood {
namespace {

// A path whose amplitude changes by less than this share within the pose's accuracy does not graze anything.
constexpr double kSteady = 0.02;
constexpr double kNoFarSkirt = 1e3;  ///< times the strongest power: no echo is strong beside that
constexpr double kFaint = 1e-3;      ///< of the pose's strongest amplitude: less is below the clutter
// How far off a pose may be, to both sides: by what is usual, and across that by what one pose in a hundred is.
struct Offset {
  double direction_rad, sigma, weight;
};
constexpr Offset kOffsets[] = {{0, 1.41, 0.5}, {M_PI / 2, 2.8, 0.02}};
// Scatter points in cells that are small beside what the radar resolves, seen from the pose as reported: a turned or
// moved radar sees the same ones.
constexpr double kCloud_bins = 0.75, kCloud_lobes = 0.5, kCloudElevation = 0.175;
constexpr std::size_t kMostTwins = 6;    ///< that are kept
constexpr std::size_t kMostTraced = 64;  ///< entries of one mechanism and geometry that are kept

/// One line that tells two mechanisms apart that trace different paths.
std::string tracedKey(const NamedParameters& mechanism) {
  NamedParameters tracing{mechanism.mechanism, {}};
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism.mechanism)->parameters()) {
    const auto value = mechanism.values.all().find(s.name);
    if (!s.weighs && value != mechanism.values.all().end()) tracing.values.set(s.name, value->second);
  }
  TwinDescription description;
  description.mechanisms = {tracing};
  return description.toYaml();
}

std::string keyOf(const std::vector<NamedParameters>& mechanisms) {
  std::string key;
  for (const NamedParameters& m : mechanisms) key += tracedKey(m) + "|";
  return key;
}

/// Those of the list that one of its mechanisms looks at when it is traced.
std::vector<NamedParameters> mechanismsReadBy(const NamedParameters& mechanism,
                                              const std::vector<NamedParameters>& list) {
  std::vector<NamedParameters> beside;
  for (const std::string& name : MechanismRegistry::instance().create(mechanism.mechanism)->looksAtPathsOf()) {
    for (const NamedParameters& m : list) {
      if (m.mechanism == name) beside.push_back(m);
    }
  }
  return beside;
}

/// The one of `list` that stands where mechanisms[at] does among those of its name and subject; null where there are
/// fewer.
const NamedParameters* sameInOtherList(const std::vector<NamedParameters>& mechanisms, std::size_t at,
                                       const std::vector<NamedParameters>& list) {
  const NamedParameters& wanted = mechanisms[at];
  const std::string subject = subjectOf(wanted);
  const auto alike = [&](const NamedParameters& m) {
    return m.mechanism == wanted.mechanism && subjectOf(m) == subject;
  };
  auto before = std::count_if(mechanisms.begin(), mechanisms.begin() + static_cast<std::ptrdiff_t>(at), alike);
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const NamedParameters& m) { return alike(m) && before-- == 0; });
  return found == list.end() ? nullptr : &*found;
}

double strongestPower(const std::vector<PathRecord>& records) {
  double strongest = 0;
  for (const PathRecord& r : records) strongest = std::max(strongest, r.amplitude * r.amplitude);
  return strongest;
}

/// Paths by what they meet.
std::map<PerInteraction<int>, std::vector<const PathRecord*>> byActors(const std::vector<PathRecord>& records) {
  std::map<PerInteraction<int>, std::vector<const PathRecord*>> groups;
  for (const PathRecord& r : records) groups[actorsOf(r)].push_back(&r);
  return groups;
}

using PathKey = std::tuple<const std::string*, PerInteraction<int>>;

/// Paths of `there` that `here` has, too, and those of `here` that `there` lacks. Scatter points of one facet are many
/// under one name, and their cells change with every step: they stay as they are here.
void addShared(const std::vector<PathRecord>& there, const std::vector<PathRecord>& here,
               std::vector<PathRecord>& all) {
  std::map<PathKey, int> count;
  for (const PathRecord& r : here) ++count[PathKey{r.event, r.facets}];
  std::map<PathKey, int> found;
  for (const PathRecord& r : there) {
    const auto at = count.find(PathKey{r.event, r.facets});
    if (at == count.end() || at->second > 1) continue;
    ++found[at->first];
    all.push_back(r);
  }
  for (const PathRecord& r : here) {
    if (found.find(PathKey{r.event, r.facets}) == found.end()) all.push_back(r);
  }
}

/// True where a parameter of the mechanism weighs paths.
bool weighs(const std::string& mechanism) {
  const std::vector<ParameterSpec> specs = MechanismRegistry::instance().create(mechanism)->parameters();
  return std::any_of(specs.begin(), specs.end(), [](const ParameterSpec& s) { return s.weighs; });
}

/// What lies behind the radar by so much stays there whatever its own offsets are.
constexpr double kBehind_m = 0.15, kBehind = 0.1;

/// False where nothing of what is changed lies before the radar, nor in the way of what bounces behind it.
bool mayTouch(const SceneChange& change, const Eigen::Isometry3d& T_map_radar, const std::vector<PathRecord>& paths) {
  const Eigen::Vector3d p = T_map_radar.translation(), forward = T_map_radar.linear().col(0);
  for (const Eigen::AlignedBox3d& box : change.bounds) {
    for (int k = 0; k < 8; ++k) {
      const Eigen::Vector3d way = box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(k)) - p;
      if (forward.dot(way) > -kBehind_m - kBehind * way.norm()) return true;
    }
  }
  return std::any_of(paths.begin(), paths.end(),
                     [&](const PathRecord& r) { return r.vertices.size() > 1 && change.touches(p, r); });
}

/// The same for all that have none.
const auto nothing = std::make_shared<const std::vector<PathRecord>>();

}  // namespace

ExpectedEchoes::ExpectedEchoes(const Twin& base, const ChannelData& data, const PoseAccuracy& accuracy)
    : base_(base), data_(data), accuracy_(accuracy) {}

const ExpectedEchoes::Edit& ExpectedEchoes::editOf(const NamedParameters& mechanism) {
  const std::string key = tracedKey(mechanism);
  const auto at = edits_.find(key);
  if (at != edits_.end()) return at->second;
  const Twin twin = base_.changed({mechanism});
  const Geometry geometry = twin.addsOccludersOnly() ? Geometry::kMoreScreens
                            : twin.altersGeometry()  ? Geometry::kOther
                                                     : Geometry::kSame;
  return edits_[key] = {geometry, twin.placesOneActor()};
}

bool ExpectedEchoes::addsToOthers(const Edit& edit) {
  return edit.geometry == Geometry::kMoreScreens || edit.placed.has_value();
}

bool ExpectedEchoes::altersGeometry(const NamedParameters& mechanism) {
  return editOf(mechanism).geometry != Geometry::kSame;
}

bool ExpectedEchoes::mixesRanges(const NamedParameters& mechanism) {
  const auto [at, fresh] = mixes_ranges_.try_emplace(mechanism.mechanism, false);
  if (fresh) {
    const Twin twin = base_.changed({mechanism});
    const Pose& pose = data_.poses.front().pose;
    at->second = twin.hasReceiveStage() && !twin.channelMatrix(pose.T_map_radar, pose.stamp_ns);
  }
  return at->second;
}

std::shared_ptr<const Twin> ExpectedEchoes::twinOf(const std::vector<NamedParameters>& mechanisms) {
  TwinDescription description;
  description.mechanisms = mechanisms;
  std::string text = description.toYaml();
  const auto at = std::find_if(twins_.begin(), twins_.end(), [&](const auto& known) { return known.first == text; });
  if (at != twins_.end()) {
    std::rotate(twins_.begin(), at, at + 1);
  } else {
    twins_.insert(twins_.begin(), {std::move(text), std::make_shared<const Twin>(base_.changed(mechanisms))});
    if (twins_.size() > kMostTwins) twins_.pop_back();
  }
  return twins_.front().second;
}

std::vector<NamedParameters> ExpectedEchoes::geometryOf(const std::vector<NamedParameters>& mechanisms) {
  std::vector<NamedParameters> geometry;
  for (const NamedParameters& m : mechanisms) {
    if (altersGeometry(m)) geometry.push_back(m);
  }
  // What is found around an actor that was placed follows from what is found without it: those come last, whatever was
  // tried last, so that the same edits always make the same paths.
  std::stable_partition(geometry.begin(), geometry.end(),
                        [this](const NamedParameters& m) { return !addsToOthers(editOf(m)); });
  return geometry;
}

const ExpectedEchoes::Traced& ExpectedEchoes::traced(const std::vector<NamedParameters>& geometry,
                                                     const NamedParameters& mechanism,
                                                     const std::vector<NamedParameters>& mechanisms,
                                                     const std::vector<int>& poses) {
  const std::vector<NamedParameters> beside = mechanismsReadBy(mechanism, mechanisms);
  const std::string key = tracedKey(mechanism), behind = keyOf(beside) + key;
  Entry& entry = cache_[keyOf(geometry) + behind];
  entry.used = calls_;
  entry.paths.resize(data_.poses.size());
  std::vector<int> missing;
  for (int i : poses) {
    if (!entry.paths[i]) missing.push_back(i);
  }
  if (missing.empty()) return entry.paths;
  // One twin traces all of a geometry's mechanisms.
  const auto within = [&](const std::vector<NamedParameters>& edits) {
    std::vector<NamedParameters> all;
    for (const NamedParameters& m : mechanisms) {
      if (!altersGeometry(m)) all.push_back(m);
    }
    all.insert(all.end(), edits.begin(), edits.end());
    return all;
  };
  const std::vector<NamedParameters> all = within(geometry);
  const auto wanted = static_cast<std::size_t>(
      std::find_if(all.begin(), all.end(), [&](const NamedParameters& m) { return tracedKey(m) == key; }) -
      all.begin());
  const std::shared_ptr<const Twin> twin = twinOf(all);
  // Without the last edit, where that is not the mechanism's own.
  const Traced* before = nullptr;
  std::optional<SceneChange> change;
  const Edit edit = geometry.empty() || tracedKey(geometry.back()) == key ? Edit() : editOf(geometry.back());
  if (edit.geometry != Geometry::kSame) {
    std::vector<NamedParameters> rest(geometry.begin(), geometry.end() - 1);
    if (edit.placed && edit.placed->actor >= 0) {
      NamedParameters absent = defaultMechanism("actor_absent");
      absent.values.set("actor", base_.scene().actors[static_cast<std::size_t>(edit.placed->actor)].name);
      rest.push_back(std::move(absent));
    }
    const auto known = cache_.find(keyOf(rest) + behind);
    if (addsToOthers(edit)) {
      before = &traced(rest, mechanism, mechanisms, missing);
    } else if (known != cache_.end()) {
      known->second.used = calls_;
      before = &known->second.paths;
    }
    if (before != nullptr) change = twin->changesFrom(*twinOf(within(rest)));
  }
  const bool opens = twin->removesActors();
  tbb::parallel_for(std::size_t{0}, missing.size(), [&](std::size_t j) {
    const std::size_t i = static_cast<std::size_t>(missing[j]);
    const Eigen::Isometry3d& T = data_.poses[i].pose.T_map_radar;
    const std::shared_ptr<const Paths> known = before != nullptr ? (*before)[i] : nullptr;
    if (known && change && !mayTouch(*change, T, *known)) {
      entry.paths[i] = known;
      return;
    }
    ScatterCells cells{T, kCloud_bins * base_.radar().range_bin_m(), kCloud_lobes * 2 / base_.radar().channels(),
                       kCloudElevation};
    // What the scene as given hides stays apart where rays come through: it is weighed otherwise.
    if (opens) {
      cells.sides = [&](const std::vector<Eigen::Vector3d>& points) {
        return base_.rays().visible(T.translation(), points, std::vector<double>(points.size(), 1e-3));
      };
    }
    Paths paths;
    try {
      if (known && edit.geometry == Geometry::kMoreScreens) {
        // What only hides needs no new trace: paths without it, less those that it stands in the way of.
        paths = *known;
        twin->removeHidden(T, paths);
      } else if (known && edit.placed) {
        paths = twin->traceAround(wanted, T, cells, *edit.placed, *known);
      } else {
        paths = known && change && !opens ? twin->retrace(wanted, T, cells, *change, *known)
                                          : twin->trace(wanted, T, &cells);
      }
    } catch (const InputError&) {
      // What is tried stands where the radar stood, which therefore sees nothing.
    }
    entry.paths[i] = paths.empty() ? nothing : std::make_shared<const Paths>(std::move(paths));
  });
  return entry.paths;
}

std::vector<int> ExpectedEchoes::everyPose() const {
  std::vector<int> all(data_.poses.size());
  std::iota(all.begin(), all.end(), 0);
  return all;
}

void ExpectedEchoes::forgetLongUnused() {
  ++calls_;
  const auto forget = [](auto& known, std::size_t most) {
    while (known.size() > most) {
      known.erase(std::min_element(known.begin(), known.end(),
                                   [](const auto& a, const auto& b) { return a.second.used < b.second.used; }));
    }
  };
  forget(cache_, kMostTraced);
  forget(grazing_, kMostTraced);
}

const ExpectedEchoes::Traced& ExpectedEchoes::grazing(const std::vector<NamedParameters>& mechanisms,
                                                      const std::vector<int>& poses) {
  // What is put beside others leaves what they graze as it is.
  std::vector<NamedParameters> moving, smooth;
  for (const NamedParameters& m : geometryOf(mechanisms)) {
    if (!addsToOthers(editOf(m))) moving.push_back(m);
  }
  Entry& entry = grazing_[keyOf(moving)];
  entry.used = std::max(entry.used, calls_);
  entry.paths.resize(data_.poses.size());
  std::vector<std::size_t> missing;
  for (int i : poses) {
    if (!entry.paths[static_cast<std::size_t>(i)]) missing.push_back(static_cast<std::size_t>(i));
  }
  if (missing.empty()) return entry.paths;
  for (const NamedParameters& m : mechanisms) {
    if (m.mechanism != "diffuse") smooth.push_back(m);  // its many points fade in and out one by one
  }
  const Twin twin = base_.changed(smooth);
  tbb::parallel_for(std::size_t{0}, missing.size(),
                    [&](std::size_t j) { entry.paths[missing[j]] = grazeAt(twin, missing[j]); });
  return entry.paths;
}

std::shared_ptr<const ExpectedEchoes::Paths> ExpectedEchoes::grazeAt(const Twin& twin, std::size_t i) const {
  const Eigen::Isometry3d& here = data_.poses[i].pose.T_map_radar;
  std::vector<PathRecord> at;
  try {
    at = twin.trace(here);
  } catch (const InputError&) {
    return nothing;  // what is tried stands where the radar stood
  }
  const double strongest = std::sqrt(strongestPower(at));
  Paths uncertain;
  const auto compare = [&](const std::vector<PathRecord>& from, const std::vector<PathRecord>& to, double weight) {
    for (const PathRecord& r : from) {
      const auto same = std::find_if(to.begin(), to.end(),
                                     [&](const PathRecord& o) { return o.event == r.event && o.facets == r.facets; });
      const double other = same == to.end() ? 0 : same->amplitude;
      if (r.amplitude <= other || r.amplitude == 0) continue;
      const double lost = (r.amplitude - other) / r.amplitude;
      const double share = std::sqrt(weight) * lost;
      if (lost <= kSteady || share * r.amplitude < kFaint * strongest) continue;
      uncertain.push_back(r);
      scaleRecord(share, uncertain.back());
    }
  };
  // Turned from pose to pose so that no direction is preferred.
  for (const Offset& offset : kOffsets) {
    const double turn = 2.4 * static_cast<double>(i) + offset.direction_rad;
    const Eigen::Vector3d error =
        accuracy_.position_m * offset.sigma * Eigen::Vector3d(std::cos(turn), std::sin(turn), 1 / std::sqrt(2.0));
    for (const double sign : {-1.0, 1.0}) {
      Eigen::Isometry3d T = here;
      T.translation() += sign * error;
      try {
        const std::vector<PathRecord> there = twin.trace(T);
        compare(at, there, offset.weight);
        compare(there, at, offset.weight);
      } catch (const InputError&) {
        // The shifted pose lies inside something; the pose itself does not.
      }
    }
  }
  return uncertain.empty() ? nothing : std::make_shared<const Paths>(std::move(uncertain));
}

std::vector<PoseEchoes> ExpectedEchoes::echoes(const std::vector<NamedParameters>& mechanisms,
                                               const std::vector<int>& poses,
                                               const std::vector<double>& actor_range_m) {
  forgetLongUnused();
  const std::vector<NamedParameters> geometry = geometryOf(mechanisms);
  std::vector<Part> parts;
  for (const NamedParameters& m : mechanisms) parts.push_back({&traced(geometry, m, mechanisms, poses)});
  return collect(mechanisms, poses, actor_range_m, parts, settled_.empty() ? nullptr : &grazing(mechanisms, poses));
}

std::vector<PoseEchoes> ExpectedEchoes::echoesNear(const std::vector<NamedParameters>& mechanisms,
                                                   const std::vector<NamedParameters>& from,
                                                   const std::vector<int>& poses,
                                                   const std::vector<double>& actor_range_m) {
  forgetLongUnused();
  const std::vector<NamedParameters> geometry = geometryOf(mechanisms), geometry_from = geometryOf(from);
  if (keyOf(geometry) == keyOf(geometry_from)) return echoes(mechanisms, poses, actor_range_m);
  std::vector<Part> parts;
  for (std::size_t k = 0; k < mechanisms.size(); ++k) {
    const NamedParameters* same = sameInOtherList(mechanisms, k, from);
    const Traced& there = traced(geometry, mechanisms[k], mechanisms, poses);
    parts.push_back({&there, same == nullptr ? nullptr : &traced(geometry_from, *same, from, poses)});
  }
  return collect(mechanisms, poses, actor_range_m, parts, nullptr);
}

std::vector<PathShift> ExpectedEchoes::pathShifts(const std::vector<NamedParameters>& mechanisms,
                                                  const std::vector<NamedParameters>& from,
                                                  const std::vector<int>& poses) {
  forgetLongUnused();
  const std::vector<NamedParameters> geometry = geometryOf(mechanisms), geometry_from = geometryOf(from);
  std::vector<Part> parts;
  for (std::size_t k = 0; k < from.size(); ++k) {
    const NamedParameters* same = sameInOtherList(from, k, mechanisms);
    if (same == nullptr) continue;
    const Traced& there = traced(geometry, *same, mechanisms, poses);
    parts.push_back({&there, &traced(geometry_from, from[k], from, poses)});
  }
  const std::shared_ptr<const Twin> there_twin = twinOf(mechanisms), here_twin = twinOf(from);
  const auto azimuth = [](const PathRecord& p) { return std::atan2(p.departure.y(), p.departure.x()); };
  std::vector<PathShift> shifts;
  for (std::size_t place = 0; place < poses.size(); ++place) {
    const std::size_t i = static_cast<std::size_t>(poses[place]);
    const Pose& at = data_.poses[i].pose;
    for (const auto& [there, here] : parts) {
      std::map<PathKey, std::vector<PathRecord>> pairs;
      for (PathRecord& r : here_twin->receivedPaths(at.T_map_radar, *(*here)[i], at.stamp_ns)) {
        pairs[PathKey{r.event, r.facets}].push_back(std::move(r));
      }
      for (const PathRecord& r : there_twin->receivedPaths(at.T_map_radar, *(*there)[i], at.stamp_ns)) {
        const auto same = pairs.find(PathKey{r.event, r.facets});
        if (same == pairs.end() || same->second.size() > 1) continue;
        const PathRecord& s = same->second.front();
        shifts.push_back({place, r.event, r.facets, r.actors, r.amplitude, 0.5 * (r.length_m[0] - s.length_m[0]),
                          azimuth(r) - azimuth(s)});
      }
    }
  }
  return shifts;
}

EchoShift ExpectedEchoes::shift(const std::vector<NamedParameters>& mechanisms,
                                const std::vector<NamedParameters>& from, const std::vector<int>& poses, int actors) {
  EchoShift shift;
  shift.range_m.assign(static_cast<std::size_t>(actors), 0.0);
  shift.azimuth_rad.assign(poses.size(), 0.0);
  std::vector<double> weights(shift.range_m.size(), 1e-30), sums(poses.size(), 1e-30);
  for (const PathShift& p : pathShifts(mechanisms, from, poses)) {
    if (p.actors.size() != 1 || p.actors[0] < 0) continue;
    const std::size_t actor = static_cast<std::size_t>(p.actors[0]);
    shift.range_m[actor] += p.amplitude * p.range_m;
    weights[actor] += p.amplitude;
    shift.azimuth_rad[p.place] += p.amplitude * p.azimuth_rad;
    sums[p.place] += p.amplitude;
  }
  for (std::size_t a = 0; a < weights.size(); ++a) shift.range_m[a] /= weights[a];
  for (std::size_t j = 0; j < sums.size(); ++j) shift.azimuth_rad[j] /= sums[j];
  return shift;
}

void ExpectedEchoes::addGroups(std::size_t pose, const std::vector<PathRecord>& records, double strongest,
                               EchoCollector& to) {
  for (const auto& [actors, members] : byActors(records)) {
    std::size_t signature = 0;
    const auto sign = [&](double v) { boost::hash_combine(signature, v); };
    sign(strongest);
    sign(to.addedRange_m(actors));
    for (const PathRecord* r : members) addToSignature(*r, signature);
    std::array<Kept, 2>& kept = kept_[pose][actors];
    if (kept[1].group && kept[1].signature == signature) std::swap(kept[0], kept[1]);
    if (!kept[0].group || kept[0].signature != signature) {
      (kept[0].group ? kept[1] : kept[0]) = {signature, to.addTones(members, strongest)};
    } else {
      to.add(kept[0].group);
    }
  }
}

std::vector<PoseEchoes> ExpectedEchoes::collect(const std::vector<NamedParameters>& mechanisms,
                                                const std::vector<int>& poses, const std::vector<double>& actor_range_m,
                                                const std::vector<Part>& parts, const Traced* grazing) {
  const std::shared_ptr<const Twin> whole = twinOf(mechanisms);
  const Twin& twin = *whole;
  const RadarConfig& radar = base_.radar();
  const int channels = radar.channels();
  kept_.resize(data_.poses.size());
  kept_poses_.resize(data_.poses.size());
  mixed_.resize(data_.poses.size());
  // The twin less what mixes ranges in its receiver; nothing where it mixes none.
  std::shared_ptr<const Twin> without_mixing;
  std::vector<NamedParameters> rest;
  TwinDescription mixing;
  for (const NamedParameters& m : mechanisms) (mixesRanges(m) ? mixing.mechanisms : rest).push_back(m);
  const std::size_t mixing_key = std::hash<std::string>()(mixing.toYaml());
  if (rest.size() < mechanisms.size()) without_mixing = twinOf(rest);
  // What a pose's echoes follow from beside its paths.
  TwinDescription weights;
  for (const NamedParameters& m : mechanisms) {
    if (!altersGeometry(m) || weighs(m.mechanism)) weights.mechanisms.push_back(m);
  }
  std::size_t alike = std::hash<std::string>()(weights.toYaml());
  boost::hash_range(alike, actor_range_m.begin(), actor_range_m.end());

  std::vector<PoseEchoes> result(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) {
    const std::size_t i = static_cast<std::size_t>(poses[j]);
    const Pose& pose = data_.poses[i].pose;
    KeptPose own;
    own.signature = alike;
    for (const auto& [there, here] : parts) {
      for (const Traced* part : {there, here}) {
        if (part == nullptr) continue;
        own.paths.push_back((*part)[i]);
        boost::hash_combine(own.signature, own.paths.back().get());
      }
    }
    if (grazing != nullptr) {
      own.paths.push_back((*grazing)[i]);
      boost::hash_combine(own.signature, own.paths.back().get());
    }
    std::array<KeptPose, 2>& kept = kept_poses_[i];
    if (!kept[1].echoes.groups.empty() && kept[1].signature == own.signature) std::swap(kept[0], kept[1]);
    if (!kept[0].echoes.groups.empty() && kept[0].signature == own.signature) {
      result[j] = kept[0].echoes;
      return;
    }
    // Kept from pose to pose: most of the time went into the small vectors of records that were made and thrown away.
    thread_local std::vector<PathRecord> all;
    std::size_t count = 0, to = 0;
    for (const Part& part : parts) count += part.here == nullptr ? (*part.there)[i]->size() : 0;
    all.resize(count);
    for (const Part& part : parts) {
      if (part.here != nullptr) continue;
      for (const PathRecord& r : *(*part.there)[i]) all[to++] = r;
    }
    for (const Part& part : parts) {
      if (part.here != nullptr) addShared(*(*part.there)[i], *(*part.here)[i], all);
    }
    EchoCollector collector(radar, accuracy_.path_angle_rad, data_.poses[i].beams, actor_range_m);
    const Twin& receiver = without_mixing ? *without_mixing : twin;
    std::optional<Eigen::MatrixXcd> matrix;
    if (receiver.hasReceiveStage()) matrix = receiver.channelMatrix(pose.T_map_radar, pose.stamp_ns);
    const auto receive = [&](std::vector<PathRecord>& records) {
      records = receiver.receivedPaths(pose.T_map_radar, std::move(records), pose.stamp_ns);
      for (PathRecord& r : records) {
        if (!matrix) break;
        Eigen::Map<Eigen::VectorXcd> c(r.c.data(), channels);
        c = *matrix * c.eval();
      }
    };
    std::optional<ReceiverMixture> mixture;
    double strongest = 0;
    if (without_mixing) {
      mixture.emplace(twin, *without_mixing, mixing_key, pose, mixed_[i], calls_);
      strongest = strongestPower(all);  // tones that are mixed lose some of theirs
      mixture->scaleTones(all, collector);
    }
    receive(all);
    if (!mixture) strongest = strongestPower(all);
    addGroups(i, all, strongest, collector);
    if (mixture) mixture->addTo(collector);
    result[j].groups = collector.take();
    if (grazing != nullptr) {
      Paths uncertain = *(*grazing)[i];
      receive(uncertain);
      const std::vector<double> none;
      EchoCollector of_grazing(radar, accuracy_.path_angle_rad, data_.poses[i].beams, none);
      for (const auto& [actors, members] : byActors(uncertain)) of_grazing.addTones(members, kNoFarSkirt * strongest);
      result[j].grazing = of_grazing.take();
    }
    if (mixture) return;
    own.echoes = result[j];
    (kept[0].echoes.groups.empty() ? kept[0] : kept[1]) = std::move(own);
  });
  return result;
}

std::vector<PoseEchoes> ExpectedEchoes::echoes(const std::vector<NamedParameters>& mechanisms,
                                               const std::vector<double>& actor_range_m) {
  return echoes(mechanisms, everyPose(), actor_range_m);
}

void ExpectedEchoes::pointBeams(ChannelData& data, const std::vector<NamedParameters>& mechanisms, int first_bin) {
  const Twin twin = base_.changed(mechanisms);
  tbb::parallel_for(std::size_t{0}, data.poses.size(), [&](std::size_t i) {
    PoseChannels& p = data.poses[i];
    const Eigen::Isometry3d& T = p.pose.T_map_radar;
    p.beams = chooseBeams(base_.radar(), twin.receivedPaths(T, twin.trace(T), p.pose.stamp_ns), first_bin);
    for (EchoBeam& beam : p.beams) {
      beam.y = formBeam(beam, p.y);
      const int channels = base_.radar().channels();
      PackedHermitian clutter(channels);
      clutter.add(p.clutter.at(middleBin(beam, channels), static_cast<std::size_t>(clutter.size())), 1);
      beam.clutter = clutter.quadratic(beam.weights.data());
    }
  });
  settled_.clear();  // what grazes is to be found in the beams, too
  kept_.clear();
  kept_poses_.clear();
  mixed_.clear();
}

void ExpectedEchoes::setBaseline(const std::vector<NamedParameters>& mechanisms) {
  const std::string geometry = keyOf(geometryOf(mechanisms));
  std::vector<std::string> wanted;
  for (const NamedParameters& m : mechanisms)
    wanted.push_back(geometry + keyOf(mechanismsReadBy(m, mechanisms)) + tracedKey(m));
  if (wanted != settled_) {
    grazing_.clear();
    grazing(mechanisms, everyPose());
    grazing_.begin()->second.used = std::numeric_limits<std::size_t>::max();  // never forgotten
  }
  settled_ = wanted;
  for (auto at = cache_.begin(); at != cache_.end();) {
    at = std::find(wanted.begin(), wanted.end(), at->first) == wanted.end() ? cache_.erase(at) : std::next(at);
  }
}

}  // namespace mmradartwin::diagnosis::likelihood
