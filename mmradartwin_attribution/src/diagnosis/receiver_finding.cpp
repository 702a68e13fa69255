#include "receiver_finding.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "echo_source.h"
#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/ledger.h"

namespace mmradartwin {
namespace {

/// Amplitude of the strongest tone of all poses.
double strongestMeasured(const ChannelData& data) {
  double strongest = 0;
  for (const PoseChannels& p : data.poses) {
    const Eigen::VectorXd power = p.y.colwise().squaredNorm().transpose() / static_cast<double>(p.y.rows());
    for (Eigen::Index r = 2; r + 2 < power.size(); ++r) {
      // A tone's power summed over Hann's lobe is 1.5 times its own, wherever it lies between the bins.
      if (power[r] >= power[r - 1] && power[r] >= power[r + 1]) {
        strongest = std::max(strongest, power.segment(r - 2, 5).sum() / 1.5);
      }
    }
  }
  return std::sqrt(strongest);
}

}  // namespace

Finding findingOf(const FrameFinding& frames) {
  Finding f;
  f.cause = frames.cause;
  f.parameters = frames.parameters;
  f.candidates = {{f.cause, 1.0}};
  f.evidence.log_likelihood_gain = frames.log_likelihood_gain;
  f.evidence.false_alarm_rate = frames.false_alarm_rate;
  f.where = frames.where;
  if (f.where.empty()) f.where.emplace_back();
  for (FindingPlace& place : f.where) {
    if (place.poses.empty()) place.poses = frames.poses;
  }
  f.description = frames.description;
  if (f.cause == "unknown") return f;
  NamedParameters m = defaultMechanism(f.cause);
  for (const FindingParameter& p : f.parameters) {
    if (m.values.has(p.name)) m.values.set(p.name, p.value);
  }
  f.mechanism = m;
  return f;
}

void addUnexplained(const FrameExaminer& frames, std::vector<Finding>& findings) {
  for (const FrameFinding& f : frames.unexplained()) {
    if (findings.empty() || findings.back().cause != "unknown") {
      findings.push_back(findingOf(f));
    } else {
      findings.back().description = findings.back().description.value_or("") + "; besides: " + f.description;
    }
  }
}

Finding findingOf(const Delivery& delivery, const RadarConfig& radar) {
  Finding f;
  f.cause = delivery.mechanism.mechanism;
  f.mechanism = delivery.mechanism;
  f.candidates = {{f.cause, 1.0}};
  std::vector<double> reversed(static_cast<std::size_t>(radar.channels()));
  std::iota(reversed.rbegin(), reversed.rend(), 0.0);
  const bool is_reversed = f.cause == "channel_permutation" && f.mechanism->values.numbers("order") == reversed;
  if (f.cause == "channel_permutation") {
    f.parameters.push_back({"order", "1", f.mechanism->values.numbers("order"), {}});
  }
  if (f.cause == "channel_conjugation" || is_reversed) {
    f.cause = "channel_conjugation";  // the same data; the convention is the likelier mistake
    f.mechanism = defaultMechanism(f.cause);
    f.parameters.clear();
    f.candidates = {{"channel_conjugation", 0.5}, {"channel_permutation", 0.5}};
    f.experiment =
        "look into the order of the receivers' lanes (self-test pattern): data alone cannot tell a reversed order of "
        "all channels from conjugated channels";
  }
  f.evidence.log_likelihood_gain = delivery.gain;
  f.evidence.false_alarm_rate = std::min(1.0, 50 * std::exp(-delivery.gain));
  f.evidence.margin = delivery.margin;
  return f;
}

Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest) {
  const double rms = std::sqrt(tone.channels.squaredNorm() / static_cast<double>(tone.channels.size()));
  const double level_db = 20 * std::log10(rms / strongestMeasured(rest));
  const double error_db = 8.686 / std::sqrt(2 * std::max(1.0, tone.gain));
  Finding f;
  // A constant has no range at all; leakage travels some centimetres.
  const bool constant = tone.range_m < std::max(0.01, 3 * tone.range_error_m);
  f.cause = constant ? "dc_offset" : "tx_rx_leakage";
  NamedParameters m = defaultMechanism(f.cause);
  m.values.set("level_db", level_db);
  if (!constant) {
    std::vector<double> phase_deg, gain_db;
    for (Eigen::Index k = 0; k < tone.channels.size(); ++k) {
      phase_deg.push_back(std::arg(tone.channels[k] / tone.channels[0]) * 180 / M_PI);
      gain_db.push_back(std::max(-60.0, 20 * std::log10(std::abs(tone.channels[k]) / rms)));
    }
    m.values.set("range_m", tone.range_m);
    m.values.set("phase_deg", phase_deg);
    m.values.set("gain_db", gain_db);
    f.parameters.push_back({"range_m",
                            "m",
                            tone.range_m,
                            {{tone.range_m - 1.96 * tone.range_error_m, tone.range_m + 1.96 * tone.range_error_m}}});
  }
  f.parameters.push_back({"level_db", "dB", level_db, {{level_db - 1.96 * error_db, level_db + 1.96 * error_db}}});
  f.mechanism = m;
  f.candidates = {{f.cause, 1.0}};
  f.evidence.log_likelihood_gain = tone.gain;
  f.evidence.false_alarm_rate = tone.false_alarm_rate;
  f.where.push_back({{{0.0, tone.range_m + 2 * rest.radar.range_bin_m()}}, {}, {}, {}, {}, {}});
  return f;
}

std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated) {
  // A sample's noise from that of a cell of the average: Hann's sums over N samples, N/2 and 3N/8.
  std::vector<double> levels_db;
  for (const PoseChannels& p : data.poses) {
    if (!(p.noise_power > 0)) continue;
    levels_db.push_back(10 * std::log10(p.noise_power * p.shots * 2.0 / 3 * data.radar.samples_per_chirp));
  }
  if (levels_db.size() < 2) return std::nullopt;
  const double stated_db = stated.values.number("level_dbfs") + stated.values.number("delta_db");
  const double delta_db = quantile(levels_db, 0.5) - stated_db;
  const double scatter = (quantile(levels_db, 0.84) - quantile(levels_db, 0.16)) / 2;
  const double error = std::max(0.02, scatter / std::sqrt(static_cast<double>(levels_db.size())));
  if (std::abs(delta_db) < std::max(0.3, 6 * error)) return std::nullopt;
  Finding f;
  f.cause = "noise_floor";
  f.mechanism = stated;
  f.mechanism->values.set("delta_db", stated.values.number("delta_db") + delta_db);
  f.parameters = {{"delta_db", "dB", delta_db, {{delta_db - 1.96 * error, delta_db + 1.96 * error}}}};
  f.candidates = {{f.cause, 1.0}};
  f.evidence.log_likelihood_gain = 0.5 * delta_db * delta_db / (error * error);
  f.evidence.false_alarm_rate = std::min(1.0, std::exp(-f.evidence.log_likelihood_gain));
  return f;
}

Diagnosis diagnoseReceiver(const Recording& recording, const DiagnosisOptions& options) {
  FrameExaminer examiner(recording.radar);
  const ChannelData data = readChannels(recording, examiner, [&](std::size_t done, std::size_t all) {
    if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options.on_progress) {
      options.on_progress({"reading captures", static_cast<double>(done) / static_cast<double>(all)});
    }
  });
  Diagnosis result;
  for (const FrameFinding& f : examiner.findings()) {
    result.findings.findings.push_back(findingOf(f));
    result.extended.mechanisms.push_back(*result.findings.findings.back().mechanism);
  }
  addUnexplained(examiner, result.findings.findings);
  result.findings.poses = static_cast<int>(data.poses.size());
  result.findings.locations = static_cast<int>(data.locations.size());
  result.findings.held_out = "nothing: without a scene only frames are judged";
  result.has_twin = false;
  result.extended.radar = recording.radar;
  result.problems = data.problems;
  return result;
}

}  // namespace mmradartwin
