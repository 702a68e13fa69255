#include <cmath>
#include <random>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kTxRxLeakage = "tx_rx_leakage";

/// Coupling from transmitters into receivers: one echo fixed to the radar's body, the same at every pose, with an
/// arbitrary but fixed complex vector over the channels.
class TxRxLeakage : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kTxRxLeakage; }
  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec phase = numberSpec("phase_deg", "deg", -360, 360,
                                     "per virtual channel; without it and gain_db a fixed arbitrary vector");
    phase.kind = ParameterKind::kNumbers;
    phase.required = false;
    phase.default_value = std::vector<double>();
    ParameterSpec gain = numberSpec("gain_db", "dB", -60, 60, "per virtual channel, against each other");
    gain.kind = ParameterKind::kNumbers;
    gain.required = false;
    gain.default_value = std::vector<double>();
    return {numberSpec("range_m", "m", 0, 100, "one-way range at which the coupling appears"),
            numberSpec("level_db", "dB", -200, 100,
                       "over the session's strongest echo, rms over channels, after the IF filter"),
            phase, gain};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig& radar) override {
    range_m_ = values.number("range_m");
    level_ = std::pow(10.0, values.number("level_db") / 20);
    vector_.assign(static_cast<std::size_t>(radar.channels()), 1.0);
    const std::vector<double>&phase_deg = values.numbers("phase_deg"), &gain_db = values.numbers("gain_db");
    // Fixed numbers, not the session's seed: the coupling belongs to the device.
    std::mt19937 random(20240607);
    const auto draw = [&random] { return (random() >> 8) * 0x1.0p-24; };
    if (phase_deg.empty() && gain_db.empty()) {
      for (auto& v : vector_) {
        const double magnitude = 0.5 + draw();
        v = std::polar(magnitude, 2 * M_PI * draw());
      }
    }
    scale(phase_deg, "phase_deg", [](double deg) { return std::polar(1.0, deg * M_PI / 180); });
    scale(gain_db, "gain_db", [](double db) { return std::complex<double>(std::pow(10.0, db / 20)); });
    double power = 0;
    for (const auto& v : vector_) power += std::norm(v);
    for (auto& v : vector_) v /= std::sqrt(power / static_cast<double>(vector_.size()));
  }
  bool needsStrongestAmplitude() const override { return true; }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const double filtered = level_ * context.strongest_amplitude();
    const double gain = context.receiver_gain(2 * range_m_);
    if (!(filtered > 0) || !(gain > 0)) return;
    PathRecord record;
    record.event = &kTxRxLeakage;
    record.departure = record.arrival = Eigen::Vector3d::UnitX();
    record.bounces = 0;
    record.length_m.assign(vector_.size(), 2 * range_m_);
    setContribution(context.radar, filtered / gain, record);
    for (std::size_t k = 0; k < vector_.size(); ++k) record.c[k] *= vector_[k];
    record.phase_rad = std::arg(record.c[0]);
    records.push_back(std::move(record));
  }

 private:
  template <typename Factor>
  void scale(const std::vector<double>& values, const char* key, Factor factor) {
    if (values.empty()) return;
    if (values.size() != vector_.size()) {
      throw InputError("mechanism tx_rx_leakage: key " + std::string(key) + ": has " + std::to_string(values.size()) +
                       " numbers; the radar has " + std::to_string(vector_.size()) + " virtual channels");
    }
    for (std::size_t k = 0; k < values.size(); ++k) vector_[k] *= factor(values[k]);
  }

  double range_m_ = 0, level_ = 0;
  std::vector<std::complex<double>> vector_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(TxRxLeakage)

}  // namespace mmradartwin
