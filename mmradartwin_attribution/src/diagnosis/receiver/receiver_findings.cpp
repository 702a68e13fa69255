#include "diagnosis/receiver/receiver_findings.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iomanip>
#include <numeric>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/receiver/strongest_echo.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr double kLeastGain_db = -60;       ///< least gain of a tone's channel that is written
constexpr double kFarthestLeakage_m = 0.3;  ///< range up to which there is leakage

}  // namespace

Finding findingOf(const FrameFinding& frames) {
  Finding finding;
  finding.cause = frames.cause;
  finding.parameters = frames.parameters;
  finding.candidates = {{finding.cause, 1.0}};
  finding.evidence.log_likelihood_gain = frames.log_likelihood_gain;
  finding.evidence.false_alarm_rate = frames.false_alarm_rate;
  finding.where = frames.where;
  if (finding.where.empty()) finding.where.emplace_back();
  for (FindingPlace& place : finding.where) {
    if (place.poses.empty()) place.poses = frames.poses;
  }
  finding.description = frames.description;
  finding.mechanism = frames.mechanism;
  if (finding.cause == "unknown") return finding;
  NamedParameters m = defaultMechanism(finding.cause);
  for (const FindingParameter& p : finding.parameters) {
    const double* number = std::get_if<double>(&p.value);
    if (number && std::isnan(*number)) continue;
    if (m.values.has(p.name)) m.values.set(p.name, p.value);
  }
  finding.mechanism = m;
  return finding;
}

bool differsFromStated(const Finding& finding, const std::vector<NamedParameters>& stated) {
  if (!finding.mechanism) return true;
  const Parameters& found = finding.mechanism->values;
  const bool placed = found.has("x_m") && found.has("y_m");
  const auto differs = [](double is, const std::array<double, 2>& ci95, double states) {
    return std::abs(is - states) > bounds::kSameValue_intervals * (ci95[1] - ci95[0]);
  };
  return std::none_of(stated.begin(), stated.end(), [&](const NamedParameters& mechanism) {
    // Other numbers belong to one walk and one session.
    if (placed && mechanism.mechanism == finding.mechanism->mechanism) {
      return std::hypot(mechanism.values.number("x_m") - found.number("x_m"),
                        mechanism.values.number("y_m") - found.number("y_m")) < bounds::kSameWalker_m;
    }
    if (!excludeEachOther(mechanism, *finding.mechanism)) return false;
    return std::none_of(finding.parameters.begin(), finding.parameters.end(), [&](const FindingParameter& p) {
      if (p.ci95.empty() || !mechanism.values.has(p.name)) return false;
      if (mechanism.values.all().at(p.name).index() != p.value.index()) return true;  // a number, and a list
      if (const double* is = std::get_if<double>(&p.value))
        return differs(*is, p.ci95[0], mechanism.values.number(p.name));
      const auto* list = std::get_if<std::vector<double>>(&p.value);
      if (list == nullptr) return false;
      const std::vector<double>& states = mechanism.values.numbers(p.name);
      for (std::size_t k = 0; k < list->size(); ++k) {
        if (k >= states.size() || differs((*list)[k], p.ci95[k], states[k])) return true;
      }
      return false;
    });
  });
}

namespace {

/// True for the order M-1 ... 0.
bool isReversed(const NamedParameters& mechanism, const RadarConfig& radar) {
  if (mechanism.mechanism != "channel_permutation") return false;
  std::vector<double> reversed(static_cast<std::size_t>(radar.channels()));
  std::iota(reversed.rbegin(), reversed.rend(), 0.0);
  return mechanism.values.numbers("order") == reversed;
}

/// Parameters of a convention's finding.
std::vector<FindingParameter> parametersOf(const NamedParameters& mechanism) {
  if (mechanism.mechanism != "channel_permutation") return {};
  return {{"order", "1", mechanism.values.numbers("order"), {}}};
}

/// All conventions that are not told apart, each with its probability. A reversed order and conjugated channels are the
/// same data, so that each stands for both.
std::vector<CauseProbability> candidatesOf(const SampleConvention& convention, const RadarConfig& radar) {
  std::vector<std::pair<NamedParameters, double>> alike = convention.alike;
  if (alike.empty()) alike.emplace_back(convention.mechanism, 1.0);
  std::vector<CauseProbability> all;
  const auto add = [&all](const CauseProbability& candidate) {
    const auto same = std::find_if(all.begin(), all.end(), [&](const CauseProbability& c) {
      return c.cause == candidate.cause && c.parameters.empty() == candidate.parameters.empty() &&
             (c.parameters.empty() || c.parameters.front().value == candidate.parameters.front().value);
    });
    if (same == all.end()) {
      all.push_back(candidate);
    } else {
      same->probability += candidate.probability;
    }
  };
  for (const auto& [mechanism, probability] : alike) {
    if (mechanism.mechanism == "channel_conjugation" || isReversed(mechanism, radar)) {
      std::vector<double> reversed(static_cast<std::size_t>(radar.channels()));
      std::iota(reversed.rbegin(), reversed.rend(), 0.0);
      add({"channel_conjugation", probability / 2});
      add({"channel_permutation", probability / 2, {{"order", "1", reversed, {}}}});
    } else {
      add({mechanism.mechanism, probability, parametersOf(mechanism)});
    }
  }
  // What tells candidates apart is written where their names do not.
  for (CauseProbability& candidate : all) {
    const auto named =
        std::count_if(all.begin(), all.end(), [&](const CauseProbability& c) { return c.cause == candidate.cause; });
    if (named < 2) candidate.parameters.clear();
  }
  return all;
}

}  // namespace

Finding findingOf(const SampleConvention& convention, const RadarConfig& radar) {
  Finding finding;
  finding.cause = convention.mechanism.mechanism;
  finding.mechanism = convention.mechanism;
  finding.candidates = candidatesOf(convention, radar);
  if (isReversed(convention.mechanism, radar)) {
    finding.cause = "channel_conjugation";  // the data are the same; this convention is the likelier mistake
    finding.mechanism = defaultMechanism(finding.cause);
  }
  finding.parameters = parametersOf(*finding.mechanism);
  if (finding.candidates.size() > 1) {
    finding.experiment =
        finding.cause == "channel_conjugation" && finding.candidates.size() == 2
            ? "look into the order of the receivers' lanes (self-test pattern): data alone cannot tell a reversed "
              "order "
              "of all channels from conjugated channels"
            : "record a strong target on a known side of the radar, such as a corner reflector on its left, or someone "
              "who walks, in frames of several loops: an order and its mirror image show the same echoes on either "
              "side; or look into the order of transmitters (tx_enable) and lanes (self-test pattern)";
  }
  finding.evidence.log_likelihood_gain = convention.gain;
  finding.evidence.false_alarm_rate = std::min(1.0, bounds::kConventionTries * std::exp(-convention.gain));
  finding.evidence.margin = convention.margin;
  return finding;
}

namespace {

/// Probability that a tone is constant: evidence of a constant, whose range is 0 within kMostConstantRange_m, against
/// that of leakage, whose range may be any beyond.
double probabilityOfConstant(const BodyFixedTone& tone) {
  const double error_m = std::max(tone.range_error_m, bounds::kToneRangeError_m), near_m = bounds::kMostConstantRange_m;
  const double far_m = std::max(kFarthestLeakage_m, tone.range_m);
  const auto below = [&](double range_m) {
    return 0.5 * std::erfc((tone.range_m - range_m) / error_m / std::sqrt(2.0));
  };
  const double constant = (below(near_m) - below(-near_m)) / (2 * near_m);
  const double leakage = (below(far_m) - below(near_m)) / (far_m - near_m);
  return constant + leakage > 0 ? constant / (constant + leakage) : tone.range_m < near_m;
}

}  // namespace

Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest) {
  const double rms = std::sqrt(tone.channels.squaredNorm() / static_cast<double>(tone.channels.size()));
  const double level_db = 20 * std::log10(rms / strongestMeasured(rest));
  const double error_db = 8.686 / std::sqrt(2 * std::max(1.0, tone.gain));
  Finding finding;
  // A constant has no range; leakage travels some centimetres.
  const double probability = probabilityOfConstant(tone);
  const bool constant = probability >= 0.5;
  finding.cause = constant ? "dc_offset" : "tx_rx_leakage";
  NamedParameters mechanism = defaultMechanism(finding.cause);
  mechanism.values.set("level_db", level_db);
  if (!constant) {
    std::vector<double> phase_deg, gain_db;
    for (Eigen::Index k = 0; k < tone.channels.size(); ++k) {
      phase_deg.push_back(std::arg(tone.channels[k] / tone.channels[0]) * 180 / M_PI);
      gain_db.push_back(std::max(kLeastGain_db, 20 * std::log10(std::abs(tone.channels[k]) / rms)));
    }
    mechanism.values.set("range_m", tone.range_m);
    mechanism.values.set("phase_deg", phase_deg);
    mechanism.values.set("gain_db", gain_db);
    finding.parameters.push_back(
        {"range_m",
         "m",
         tone.range_m,
         {{tone.range_m - 1.96 * tone.range_error_m, tone.range_m + 1.96 * tone.range_error_m}}});
  }
  finding.parameters.push_back(
      {"level_db", "dB", level_db, {{level_db - 1.96 * error_db, level_db + 1.96 * error_db}}});
  finding.mechanism = mechanism;
  const double own = std::max(probability, 1 - probability);
  if (std::log(own / (1 - own)) < bounds::kNotToldApart_nats) {
    finding.candidates = {{finding.cause, own}, {constant ? "tx_rx_leakage" : "dc_offset", 1 - own}};
    finding.experiment =
        "record with all transmitters off: a constant offset stays, leakage goes; or with a steeper ramp, which tells "
        "its range";
  } else {
    finding.candidates = {{finding.cause, 1.0}};
  }
  std::ostringstream text;
  text << std::setprecision(3) << "a tone of the radar's own, "
       << (rest.poses.size() > 1 ? "the same at all poses" : "") << (rest.poses.size() > 1 ? ", " : "")
       << "and no array response: the direction that fits best has " << 100 * tone.array_share << " % of its power";
  finding.description = text.str();
  finding.evidence.log_likelihood_gain = tone.gain;
  finding.evidence.false_alarm_rate = tone.false_alarm_rate;
  finding.where.push_back({{{0.0, tone.range_m + 2 * rest.radar.range_bin_m()}}, {}, {}, {}, {}, {}});
  return finding;
}

Finding findingOf(const ChannelErrors& errors) {
  Finding finding;
  const double wide = student95(errors.groups - 1);
  const auto list = [wide](const char* name, const char* unit, const Eigen::VectorXd& values,
                           const Eigen::VectorXd& error) {
    FindingParameter p{name, unit, std::vector<double>(values.data(), values.data() + values.size()), {}};
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      p.ci95.push_back({values[k] - wide * error[k], values[k] + wide * error[k]});
    }
    return p;
  };
  const Eigen::VectorXd phase_deg = errors.phase_rad / kDegree, error_deg = errors.phase_error_rad / kDegree;
  std::ostringstream text;
  text << std::setprecision(2) << std::fixed << "read from " << errors.echoes << " echoes, each from one direction: ";
  if (errors.tie == ChannelTie::kTransmitters) {
    finding.cause = "tx_imbalance";
    const Eigen::Index last = phase_deg.size() - 1;
    const auto number = [&](const char* name, const char* unit, double value, double error) {
      finding.parameters.push_back({name, unit, value, {{value - wide * error, value + wide * error}}});
    };
    number("phase_deg", "deg", phase_deg[last], error_deg[last]);
    number("gain_db", "dB", errors.gain_db[last], errors.gain_error_db[last]);
    text << "transmitters differ, receivers do not";
  } else {
    finding.cause = "channel_phase_error";
    finding.parameters = {list("phase_deg", "deg", phase_deg, error_deg),
                          list("gain_db", "dB", errors.gain_db, errors.gain_error_db)};
    if (errors.tie == ChannelTie::kReceivers) {
      text << "each receiver's error is the same under all transmitters, within " << errors.apart_rad / kDegree
           << " deg where every channel is left free";
    } else {
      text << "receivers' errors differ between transmitters";
    }
    text << "; a slope over the array is taken as a turn of the radar, which no echo tells from it";
  }
  finding.description = text.str();
  NamedParameters m = defaultMechanism(finding.cause);
  for (const FindingParameter& p : finding.parameters) m.values.set(p.name, p.value);
  finding.mechanism = m;
  finding.candidates = {{finding.cause, 1.0}};
  if (errors.receivers == 1) {
    // Every transmitter is one channel: both causes are the same data.
    const char* other = finding.cause == "tx_imbalance" ? "channel_phase_error" : "tx_imbalance";
    finding.candidates = {{finding.cause, 0.5}, {other, 0.5}};
    finding.experiment =
        "record with a second receiver: with one, an error of a transmitter and an error of its channel are the same "
        "data";
  }
  finding.evidence.log_likelihood_gain = errors.gain;
  finding.evidence.false_alarm_rate = std::min(1.0, std::exp(-errors.held_out_gain));
  finding.where.emplace_back();
  return finding;
}

}  // namespace mmradartwin::diagnosis::receiver
