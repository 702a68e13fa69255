#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/law_variable.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kEmpiricalLaw = "empirical_law";

/// A law that was read off the data and has no name: gain, delay or angle of paths, or gain and phase of some virtual
/// channels, tabulated over one variable. Between the table's points it is linear, beyond its ends constant.
class EmpiricalLaw : public Mechanism, public WeightStage {
 public:
  const std::string& name() const override { return kEmpiricalLaw; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec at = optionalNumbersSpec("at", "of the variable", -1e6, 1e6, "where the law is given, ascending");
    at.required = true;
    std::vector<ParameterSpec> all = {
        textSpec("variable", true, "", LawVariable::meaning().c_str()),
        at,
        optionalNumbersSpec("gain_db", "dB", -200, 200, "of the echo, per point"),
        optionalNumbersSpec("delay_m", "m", -10, 10, "added to the one-way range, per point"),
        optionalNumbersSpec("angle_deg", "deg", -90, 90, "added to azimuths of departure and arrival, per point"),
        optionalNumbersSpec("phase_deg", "deg", -1e4, 1e4, "of the echo in channels, per point"),
        optionalNumbersSpec("channels", "1", 0, 1e4,
                            "virtual channels that gain_db and phase_deg are of, from 0; all where none are given"),
        numberSpec("x_m", "m", -1e4, 1e4, 0, "place in map that passing_m and distance_m are about"),
        numberSpec("y_m", "m", -1e4, 1e4, 0, "place in map that passing_m and distance_m are about"),
        numberSpec("bearing_deg", "deg", -360, 360, 0, "direction in map that standing_m is along"),
        textSpec("actor", false, "", "only paths that meet this actor"),
        textSpec("material", false, "", "only paths that meet this material"),
        textSpec("event", false, "", "only paths of this mechanism")};
    for (ParameterSpec& s : all) s = weighing(s);
    return all;
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig& radar) override {
    const std::string& variable = values.text("variable");
    by_amplitude_ = variable == "amplitude_db" || variable == "total_power_db";
    at_ = values.numbers("at");
    if (at_.empty() || std::adjacent_find(at_.begin(), at_.end(), std::greater_equal<double>()) != at_.end()) {
      throw InputError("mechanism empirical_law: key at: needs one ascending number or more");
    }
    gain_db_ = column(values, "gain_db");
    delay_m_ = column(values, "delay_m");
    angle_deg_ = column(values, "angle_deg");
    phase_deg_ = column(values, "phase_deg");
    if (gain_db_.empty() && delay_m_.empty() && angle_deg_.empty() && phase_deg_.empty()) {
      throw InputError(
          "mechanism empirical_law: gives no law; add gain_db, delay_m, angle_deg or, with channels, phase_deg, one "
          "number per point");
    }
    channels_.clear();
    for (double k : values.numbers("channels")) {
      if (k != std::floor(k) || k >= radar.channels()) {
        throw InputError("mechanism empirical_law: key channels: " + std::to_string(k) +
                         " is no virtual channel; allowed: 0 to " + std::to_string(radar.channels() - 1));
      }
      channels_.push_back(static_cast<std::size_t>(k));
    }
    const bool of_channels = !gain_db_.empty() || !phase_deg_.empty(),
               of_all = !delay_m_.empty() || !angle_deg_.empty();
    if (channels_.empty() ? !phase_deg_.empty() : of_all || !of_channels) {
      throw InputError(
          "mechanism empirical_law: phase_deg needs channels, and channels take gain_db and phase_deg alone; give "
          "delay_m and angle_deg as a law of their own");
    }
    event_ = values.text("event");
    affected_.clear();
    if (!values.text("material").empty()) affected_ = requireMaterial(scene, kEmpiricalLaw, values.text("material"));
    if (!values.text("actor").empty()) {
      if (!affected_.empty()) throw InputError("mechanism empirical_law: give at most one of material and actor");
      affected_.assign(scene.actors.size(), false);
      affected_[requireActor(scene, kEmpiricalLaw, values.text("actor"))] = true;
    }
    variable_.emplace(values.text("variable"), LawVariable::ReferencePlace{values.number("x_m"), values.number("y_m"),
                                                                           values.number("bearing_deg"),
                                                                           scene.actorIndex(values.text("actor"))});
  }
  int rank() const override { return -1; }  // on geometry's lengths and angles
  void reweight(const PoseContext& context, PathRecord& record) const override {
    if (!event_.empty() && *record.event != event_) return;
    if (!affected_.empty() &&
        std::none_of(record.actors.begin(), record.actors.end(), [this](int a) { return a >= 0 && affected_[a]; })) {
      return;
    }
    const LawVariable::Values x =
        variable_->of({context.scene, context.T_map_radar, context.session_s,
                       by_amplitude_ ? context.strongest_amplitude() : 0, context.paths_power},
                      record);
    if (x.count == 0) return;
    if (!channels_.empty()) {
      const double gain_db = gain_db_.empty() ? 0 : look(gain_db_, x);
      const double phase_deg = phase_deg_.empty() ? 0 : look(phase_deg_, x);
      scaleChannels(std::polar(std::pow(10.0, gain_db / 20), phase_deg * M_PI / 180), record);
    } else if (!gain_db_.empty()) {
      scaleRecord(std::pow(10.0, look(gain_db_, x) / 20), record);
    }
    if (!angle_deg_.empty()) turn(context.radar, look(angle_deg_, x) * M_PI / 180, record);
    if (!delay_m_.empty()) lengthen(context.radar, 2 * look(delay_m_, x), record);
  }
  bool needsStrongestAmplitude() const override { return by_amplitude_; }

 private:
  std::vector<double> column(const Parameters& values, const char* key) const {
    const std::vector<double>& v = values.numbers(key);
    if (!v.empty() && v.size() != at_.size()) {
      throw InputError("mechanism empirical_law: key " + std::string(key) + ": has " + std::to_string(v.size()) +
                       " numbers; at has " + std::to_string(at_.size()));
    }
    return v;
  }

  double look(const std::vector<double>& law, double x) const {
    if (x <= at_.front()) return law.front();
    if (x >= at_.back()) return law.back();
    const std::size_t i = static_cast<std::size_t>(std::upper_bound(at_.begin(), at_.end(), x) - at_.begin());
    const double share = (x - at_[i - 1]) / (at_[i] - at_[i - 1]);
    return law[i - 1] + share * (law[i] - law[i - 1]);
  }

  double look(const std::vector<double>& law, const LawVariable::Values& x) const {
    double sum = 0;
    for (int i = 0; i < x.count; ++i) sum += look(law, x.value[static_cast<std::size_t>(i)]);
    return sum / x.count;
  }

  /// The amplitude stays the rms over all channels.
  void scaleChannels(std::complex<double> factor, PathRecord& record) const {
    double before = 0, after = 0;
    for (const auto& c : record.c) before += std::norm(c);
    for (std::size_t k : channels_) record.c[k] *= factor;
    for (const auto& c : record.c) after += std::norm(c);
    if (before > 0) record.amplitude *= std::sqrt(after / before);
    record.phase_rad = std::arg(record.c[0]);
  }

  /// Turns both directions about the radar's z; the ways of the elements change as those of a plane wave do.
  static void turn(const RadarConfig& radar, double angle_rad, PathRecord& record) {
    const Eigen::AngleAxisd R(angle_rad, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d departure = R * record.departure, arrival = R * record.arrival;
    PerChannel<double> extra_m;
    for (const auto& t : radar.tx_position_m) {
      for (const auto& r : radar.rx_position_m) {
        extra_m.push_back(-(departure - record.departure).dot(t) - (arrival - record.arrival).dot(r));
      }
    }
    lengthenChannels(radar, extra_m, record);
    record.departure = departure;
    record.arrival = arrival;
  }

  std::optional<LawVariable> variable_;
  bool by_amplitude_ = false;
  std::string event_;
  std::vector<double> at_, gain_db_, delay_m_, angle_deg_, phase_deg_;
  std::vector<std::size_t> channels_;
  std::vector<bool> affected_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EmpiricalLaw)

}  // namespace mmradartwin
