#include "diagnosis/echoes/expected_echoes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/functional/hash.hpp>
#include <functional>
#include <optional>

#include "diagnosis/numbers/packed_hermitian.h"
#include "mmradartwin_sim/mechanism.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis::echoes {
namespace {

constexpr double kNoFarSkirt = 1e3;  ///< factor on the strongest power beside which no echo is strong

double strongestPower(const std::vector<PathRecord>& records) {
  double strongest = 0;
  for (const PathRecord& r : records) strongest = std::max(strongest, r.amplitude * r.amplitude);
  return strongest;
}

/// True where a parameter of the mechanism changes the weights of paths.
bool weighs(const std::string& mechanism) {
  const std::vector<ParameterSpec> specs = MechanismRegistry::instance().create(mechanism)->parameters();
  return std::any_of(specs.begin(), specs.end(), [](const ParameterSpec& s) { return s.weighs; });
}

/// Converts a pose's paths into what its channels receive of them, in place.
class PathReceiver {
 public:
  PathReceiver(const Twin& twin, const Pose& pose) : twin_(twin), pose_(pose) {
    if (twin.hasReceiveStage()) matrix_ = twin.channelMatrix(pose.T_map_radar, pose.stamp_ns);
  }
  void receive(std::vector<PathRecord>& records) const {
    records = twin_.receivedPaths(pose_.T_map_radar, std::move(records), pose_.stamp_ns);
    for (PathRecord& r : records) {
      if (!matrix_) break;
      Eigen::Map<Eigen::VectorXcd> c(r.c.data(), twin_.radar().channels());
      c = *matrix_ * c.eval();
    }
  }

 private:
  const Twin& twin_;
  const Pose& pose_;
  std::optional<Eigen::MatrixXcd> matrix_;
};

}  // namespace

ExpectedEchoes::ExpectedEchoes(const Twin& base, const ChannelData& data, const PoseAccuracy& accuracy)
    : base_(base), data_(data), accuracy_(accuracy), paths_(base, data, accuracy.position_m) {}

bool ExpectedEchoes::mixesRanges(const NamedParameters& mechanism) {
  const auto [known, fresh] = mixes_ranges_.try_emplace(mechanism.mechanism, false);
  if (fresh) {
    const Twin twin = base_.changed({mechanism});
    const Pose& pose = data_.poses.front().pose;
    known->second = twin.hasReceiveStage() && !twin.channelMatrix(pose.T_map_radar, pose.stamp_ns);
  }
  return known->second;
}

std::vector<PoseEchoes> ExpectedEchoes::echoes(const std::vector<NamedParameters>& mechanisms,
                                               const std::vector<int>& poses,
                                               const std::vector<double>& actor_range_m) {
  paths_.beginCall();
  const std::vector<NamedParameters> geometry = paths_.geometryOf(mechanisms);
  std::vector<Part> parts;
  for (const NamedParameters& m : mechanisms) parts.push_back({&paths_.of(geometry, m, mechanisms, poses)});
  const TracedPaths::ByPose* pose_sensitive = paths_.hasBaseline() ? &paths_.poseSensitive(mechanisms, poses) : nullptr;
  return collect(mechanisms, poses, {parts, pose_sensitive, actor_range_m});
}

std::vector<PoseEchoes> ExpectedEchoes::echoesNear(const std::vector<NamedParameters>& mechanisms,
                                                   const std::vector<NamedParameters>& from,
                                                   const std::vector<int>& poses,
                                                   const std::vector<double>& actor_range_m) {
  paths_.beginCall();
  const std::vector<NamedParameters> geometry = paths_.geometryOf(mechanisms), geometry_from = paths_.geometryOf(from);
  if (traceKeyOf(geometry) == traceKeyOf(geometry_from)) return echoes(mechanisms, poses, actor_range_m);
  std::vector<Part> parts;
  for (std::size_t k = 0; k < mechanisms.size(); ++k) {
    const NamedParameters* same = sameInOtherList(mechanisms, k, from);
    const TracedPaths::ByPose& there = paths_.of(geometry, mechanisms[k], mechanisms, poses);
    parts.push_back({&there, same == nullptr ? nullptr : &paths_.of(geometry_from, *same, from, poses)});
  }
  return collect(mechanisms, poses, {parts, nullptr, actor_range_m});
}

std::vector<PathShift> ExpectedEchoes::pathShifts(const std::vector<NamedParameters>& mechanisms,
                                                  const std::vector<NamedParameters>& from,
                                                  const std::vector<int>& poses) {
  paths_.beginCall();
  const std::vector<NamedParameters> geometry = paths_.geometryOf(mechanisms), geometry_from = paths_.geometryOf(from);
  std::vector<Part> parts;
  for (std::size_t k = 0; k < from.size(); ++k) {
    const NamedParameters* same = sameInOtherList(from, k, mechanisms);
    if (same == nullptr) continue;
    const TracedPaths::ByPose& there = paths_.of(geometry, *same, mechanisms, poses);
    parts.push_back({&there, &paths_.of(geometry_from, from[k], from, poses)});
  }
  const std::shared_ptr<const Twin> there_twin = paths_.twinOf(mechanisms), here_twin = paths_.twinOf(from);
  std::vector<PathShift> shifts;
  for (std::size_t place = 0; place < poses.size(); ++place) {
    const std::size_t i = static_cast<std::size_t>(poses[place]);
    const Pose& pose = data_.poses[i].pose;
    for (const auto& [there, here] : parts) {
      std::vector<PathRecord> before = here_twin->receivedPaths(pose.T_map_radar, *(*here)[i], pose.stamp_ns);
      addShifts(place, there_twin->receivedPaths(pose.T_map_radar, *(*there)[i], pose.stamp_ns), std::move(before),
                shifts);
    }
  }
  return shifts;
}

EchoShift ExpectedEchoes::shift(const std::vector<NamedParameters>& mechanisms,
                                const std::vector<NamedParameters>& from, const std::vector<int>& poses, int actors) {
  return meanShift(pathShifts(mechanisms, from, poses), static_cast<std::size_t>(actors), poses.size());
}

void ExpectedEchoes::addGroups(std::size_t pose, const std::vector<PathRecord>& records, double strongest,
                               EchoCollector& to) {
  for (const auto& [actors, members] : byActors(records)) {
    std::size_t signature = 0;
    const auto sign = [&](double v) { boost::hash_combine(signature, v); };
    sign(strongest);
    sign(to.addedRange_m(actors));
    for (const PathRecord* r : members) addToSignature(*r, signature);
    std::array<KeptGroup, 2>& kept = kept_groups_[pose][actors];
    if (kept[1].group && kept[1].signature == signature) std::swap(kept[0], kept[1]);
    if (!kept[0].group || kept[0].signature != signature) {
      (kept[0].group ? kept[1] : kept[0]) = {signature, to.addTones(members, strongest)};
    } else {
      to.add(kept[0].group);
    }
  }
}

std::vector<PoseEchoes> ExpectedEchoes::collect(const std::vector<NamedParameters>& mechanisms,
                                                const std::vector<int>& poses, Collection collection) {
  collection.twin = paths_.twinOf(mechanisms);
  kept_groups_.resize(data_.poses.size());
  kept_poses_.resize(data_.poses.size());
  mixed_.resize(data_.poses.size());
  std::vector<NamedParameters> linear;
  TwinDescription mixing, weights;
  for (const NamedParameters& m : mechanisms) (mixesRanges(m) ? mixing.mechanisms : linear).push_back(m);
  collection.mixing_key = std::hash<std::string>()(mixing.toYaml());
  if (linear.size() < mechanisms.size()) collection.without_mixing = paths_.twinOf(linear);
  for (const NamedParameters& m : mechanisms) {
    if (!altersGeometry(m) || weighs(m.mechanism)) weights.mechanisms.push_back(m);
  }
  collection.signature = std::hash<std::string>()(weights.toYaml());
  boost::hash_range(collection.signature, collection.actor_range_m.begin(), collection.actor_range_m.end());
  std::vector<PoseEchoes> result(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(),
                    [&](std::size_t j) { result[j] = collectAt(collection, static_cast<std::size_t>(poses[j])); });
  return result;
}

PoseEchoes ExpectedEchoes::collectAt(const Collection& collection, std::size_t i) {
  KeptPose own;
  own.signature = collection.signature;
  const auto hold = [&](const TracedPaths::ByPose& paths) {
    own.paths.push_back(paths[i]);
    boost::hash_combine(own.signature, own.paths.back().get());
  };
  for (const auto& [there, here] : collection.parts) {
    for (const TracedPaths::ByPose* part : {there, here}) {
      if (part != nullptr) hold(*part);
    }
  }
  if (collection.pose_sensitive != nullptr) hold(*collection.pose_sensitive);
  std::array<KeptPose, 2>& kept = kept_poses_[i];
  if (!kept[1].echoes.groups.empty() && kept[1].signature == own.signature) std::swap(kept[0], kept[1]);
  if (!kept[0].echoes.groups.empty() && kept[0].signature == own.signature) return kept[0].echoes;
  // The memory of records is reused from pose to pose: allocating their small vectors takes most of the time.
  thread_local std::vector<PathRecord> all;
  std::size_t count = 0, to = 0;
  for (const Part& part : collection.parts) count += part.here == nullptr ? (*part.there)[i]->size() : 0;
  all.resize(count);
  for (const Part& part : collection.parts) {
    if (part.here != nullptr) continue;
    for (const PathRecord& r : *(*part.there)[i]) all[to++] = r;
  }
  for (const Part& part : collection.parts) {
    if (part.here != nullptr) addShared(*(*part.there)[i], *(*part.here)[i], all);
  }
  EchoCollector collector(base_.radar(), accuracy_.path_angle_rad, data_.poses[i].beams, collection.actor_range_m);
  const Twin& linear = collection.without_mixing ? *collection.without_mixing : *collection.twin;
  const PathReceiver receiver(linear, data_.poses[i].pose);
  std::optional<ReceiverMixture> mixture;
  double strongest = 0;
  if (collection.without_mixing) {
    mixture.emplace(*collection.twin, linear, collection.mixing_key, data_.poses[i].pose, mixed_[i], paths_.call());
    strongest = strongestPower(all);  // before the receiver's losses are taken off the tones
    mixture->scaleTones(all, collector);
  }
  receiver.receive(all);
  if (!mixture) strongest = strongestPower(all);
  addGroups(i, all, strongest, collector);
  if (mixture) mixture->addTo(collector);
  PoseEchoes result;
  result.groups = collector.take();
  if (collection.pose_sensitive != nullptr) {
    Paths uncertain = *(*collection.pose_sensitive)[i];
    receiver.receive(uncertain);
    const std::vector<double> none;
    EchoCollector of_pose_sensitive(base_.radar(), accuracy_.path_angle_rad, data_.poses[i].beams, none);
    for (const auto& [actors, members] : byActors(uncertain))
      of_pose_sensitive.addTones(members, kNoFarSkirt * strongest);
    result.pose_sensitive = of_pose_sensitive.take();
  }
  if (mixture) return result;
  own.echoes = result;
  (kept[0].echoes.groups.empty() ? kept[0] : kept[1]) = std::move(own);
  return result;
}

std::vector<PoseEchoes> ExpectedEchoes::echoes(const std::vector<NamedParameters>& mechanisms,
                                               const std::vector<double>& actor_range_m) {
  return echoes(mechanisms, paths_.everyPose(), actor_range_m);
}

void ExpectedEchoes::pointBeams(ChannelData& data, const std::vector<NamedParameters>& mechanisms, int first_bin) {
  const Twin twin = base_.changed(mechanisms);
  tbb::parallel_for(std::size_t{0}, data.poses.size(), [&](std::size_t i) {
    PoseChannels& p = data.poses[i];
    const Eigen::Isometry3d& T = p.pose.T_map_radar;
    p.beams = chooseBeams(base_.radar(), twin.receivedPaths(T, twin.trace(T), p.pose.stamp_ns), first_bin);
    for (EchoBeam& beam : p.beams) {
      beam.y = formBeam(beam, p.range_spectra);
      const int channels = base_.radar().channels();
      PackedHermitian clutter(channels);
      clutter.add(p.clutter.at(middleBin(beam, channels), static_cast<std::size_t>(clutter.size())), 1);
      beam.clutter = clutter.quadratic(beam.weights.data());
    }
  });
  paths_.clearBaseline();  // pose-sensitive paths are to be collected in the beams, too
  kept_groups_.clear();
  kept_poses_.clear();
  mixed_.clear();
}

}  // namespace mmradartwin::diagnosis::echoes
