#include "mmradartwin_sim/mechanism.h"

#include <algorithm>
#include <cmath>

#include "mechanisms/base/builtin.h"
#include "mechanisms/base/propagation_builtin.h"
#include "mechanisms/base/receiver_builtin.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

void Parameters::set(const std::string& name, Value value) { values_[name] = std::move(value); }
bool Parameters::has(const std::string& name) const { return values_.count(name) > 0; }
double Parameters::number(const std::string& name) const { return std::get<double>(values_.at(name)); }
const std::string& Parameters::text(const std::string& name) const { return std::get<std::string>(values_.at(name)); }
const std::vector<double>& Parameters::numbers(const std::string& name) const {
  return std::get<std::vector<double>>(values_.at(name));
}
const std::vector<std::string>& Parameters::texts(const std::string& name) const {
  return std::get<std::vector<std::string>>(values_.at(name));
}

namespace {
const double kSine = std::sin(20 * M_PI / 180);
}

bool inFieldOfView(const Eigen::Vector3d& direction_radar) {
  return direction_radar.x() > 0 && std::abs(direction_radar.z()) <= kSine * direction_radar.norm();
}

bool PoseContext::inFieldOfView(const Eigen::Vector3d& direction_radar) const {
  return mmradartwin::inFieldOfView(direction_radar);
}

namespace {
constexpr double kMargin_m = 0.02;  // of an actor's bounds: what touches its faces, gaps at the ends of rays
}

void SceneChange::addBounds(const Eigen::AlignedBox3d& box) {
  bounds.emplace_back(box.min().array() - kMargin_m, box.max().array() + kMargin_m);
}

bool SceneChange::crosses(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
  const Eigen::Vector3d way = b - a, inverse = way.cwiseInverse();
  for (const Eigen::AlignedBox3d& box : bounds) {
    double from = 0, to = 1;
    for (int i = 0; i < 3 && from <= to; ++i) {
      if (way[i] == 0) {
        if (a[i] < box.min()[i] || a[i] > box.max()[i]) to = -1;
        continue;
      }
      const double one = (box.min()[i] - a[i]) * inverse[i], other = (box.max()[i] - a[i]) * inverse[i];
      from = std::max(from, std::min(one, other));
      to = std::min(to, std::max(one, other));
    }
    if (from <= to) return true;
  }
  return false;
}

bool SceneChange::touches(const Eigen::Vector3d& radar, const PathRecord& record) const {
  for (int actor : record.actors) {
    if (moved(actor)) return true;
  }
  Eigen::Vector3d from = radar;
  for (const Eigen::Vector3d& v : record.vertices) {
    if (crosses(from, v)) return true;
    from = v;
  }
  // The way back from a single point is the way there.
  return record.vertices.size() > 1 && crosses(from, radar);
}

Eigen::Array3d CloudCells::placeOf(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d way = T_map_radar.linear().transpose() * (point - T_map_radar.translation());
  const double r = std::max(1e-6, way.norm());
  return {r / range_m, way.y() / r / sine, way.z() / r / elevation_sine};
}

CloudCells::Cell CloudCells::cellOf(int facet, const Eigen::Vector3d& point) const {
  const Eigen::Array3i at = placeOf(point).floor().cast<int>();
  return {facet, at.x(), at.y(), at.z()};
}

MechanismRegistry& MechanismRegistry::instance() {
  static MechanismRegistry registry = [] {
    MechanismRegistry r;
    r.add("specular", makeSpecular);
    r.add("corner", makeCorner);
    r.add("diffuse", makeDiffuse);
    r.add("radar_yaw_offset", makeRadarYawOffset);
    r.add("radar_position_offset", makeRadarPositionOffset);
    r.add("range_bias", makeRangeBias);
    r.add("range_scale", makeRangeScale);
    r.add("material_reflectivity", makeMaterialReflectivity);
    r.add("actor_absent", makeActorAbsent);
    r.add("actor_moved", makeActorMoved);
    r.add("element_pattern", makeElementPattern);
    r.add("elevation_pattern", makeElevationPattern);
    r.add("tx_rx_leakage", makeTxRxLeakage);
    r.add("channel_phase_error", makeChannelPhaseError);
    r.add("tx_imbalance", makeTxImbalance);
    r.add("if_highpass", makeIfHighpass);
    r.add("if_lowpass", makeIfLowpass);
    r.add("iq_conjugation", makeIqConjugation);
    r.add("channel_conjugation", makeChannelConjugation);
    r.add("channel_permutation", makeChannelPermutation);
    r.add("mutual_coupling", makeMutualCoupling);
    r.add("transmitter_coupling", makeTransmitterCoupling);
    r.add("iq_imbalance", makeIqImbalance);
    r.add("dc_offset", makeDcOffset);
    r.add("second_harmonic", makeSecondHarmonic);
    r.add("chirp_nonlinearity", makeChirpNonlinearity);
    r.add("gain_drift", makeGainDrift);
    r.add("moving_target", makeMovingTarget);
    r.add("phase_noise", makePhaseNoise);
    r.add("phase_drift", makePhaseDrift);
    r.add("empirical_frame_gain", makeEmpiricalFrameGain);
    r.add("empirical_tone", makeEmpiricalTone);
    r.add("interference", makeInterference);
    r.add("noise_floor", makeNoiseFloor);
    r.add("adc_saturation", makeAdcSaturation);
    r.add("quantisation", makeQuantisation);
    r.add("packet_loss", makePacketLoss);
    r.add("packet_misalignment", makePacketMisalignment);
    addPropagationMechanisms(r);
    return r;
  }();
  return registry;
}

void MechanismRegistry::add(const std::string& name, Factory factory) { factories_[name] = std::move(factory); }

std::unique_ptr<Mechanism> MechanismRegistry::create(const std::string& name) const {
  const auto found = factories_.find(name);
  if (found != factories_.end()) return found->second();
  std::string known;
  for (const auto& [k, factory] : factories_) known += (known.empty() ? "" : ", ") + k;
  throw InputError("unknown mechanism " + name + "; known: " + known);
}

std::vector<std::string> MechanismRegistry::names() const {
  std::vector<std::string> names;
  for (const auto& [k, factory] : factories_) names.push_back(k);
  return names;
}

int requireActor(const Scene& scene, const std::string& mechanism, const std::string& actor) {
  const int index = scene.actorIndex(actor);
  if (index >= 0) return index;
  std::string known;
  for (const Actor& a : scene.actors) known += (known.empty() ? "" : ", ") + a.name;
  if (known.size() > 400) known = known.substr(0, 400) + ", ...";
  throw InputError("mechanism " + mechanism + ": key actor: " + scene.file + " has no actor " + actor +
                   "; known: " + known);
}

ElementsInMap::ElementsInMap(const PoseContext& context)
    : p(context.T_map_radar.translation()), up(context.T_map_radar.linear().col(2)) {
  for (const auto& t : context.radar.tx_position_m) tx.push_back(context.T_map_radar * t);
  for (const auto& r : context.radar.rx_position_m) rx.push_back(context.T_map_radar * r);
}

PerChannel<double> ElementsInMap::lengthsVia(const Eigen::Vector3d& point) const {
  PerChannel<double> lengths;
  lengths.reserve(tx.size() * rx.size());
  for (const auto& t : tx) {
    const double out = (point - t).norm();
    for (const auto& r : rx) lengths.push_back(out + (point - r).norm());
  }
  return lengths;
}

}  // namespace mmradartwin
