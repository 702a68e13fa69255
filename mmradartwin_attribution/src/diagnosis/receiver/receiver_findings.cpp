#include "diagnosis/receiver/receiver_findings.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iomanip>
#include <numeric>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/receiver/strongest_echo.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr double kLeastGain_db = -60;  ///< least gain of a tone's channel that is written

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

Finding findingOf(const SampleConvention& convention, const RadarConfig& radar) {
  Finding finding;
  finding.cause = convention.mechanism.mechanism;
  finding.mechanism = convention.mechanism;
  finding.candidates = {{finding.cause, 1.0}};
  std::vector<double> reversed(static_cast<std::size_t>(radar.channels()));
  std::iota(reversed.rbegin(), reversed.rend(), 0.0);
  const bool is_reversed =
      finding.cause == "channel_permutation" && finding.mechanism->values.numbers("order") == reversed;
  if (finding.cause == "channel_permutation") {
    finding.parameters.push_back({"order", "1", finding.mechanism->values.numbers("order"), {}});
  }
  if (finding.cause == "channel_conjugation" || is_reversed) {
    finding.cause = "channel_conjugation";  // the data are the same; this convention is the likelier mistake
    finding.mechanism = defaultMechanism(finding.cause);
    finding.parameters.clear();
    finding.candidates = {{"channel_conjugation", 0.5}, {"channel_permutation", 0.5}};
    finding.experiment =
        "look into the order of the receivers' lanes (self-test pattern): data alone cannot tell a reversed order of "
        "all channels from conjugated channels";
  }
  finding.evidence.log_likelihood_gain = convention.gain;
  finding.evidence.false_alarm_rate = std::min(1.0, bounds::kConventionTries * std::exp(-convention.gain));
  finding.evidence.margin = convention.margin;
  return finding;
}

Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest) {
  const double rms = std::sqrt(tone.channels.squaredNorm() / static_cast<double>(tone.channels.size()));
  const double level_db = 20 * std::log10(rms / strongestMeasured(rest));
  const double error_db = 8.686 / std::sqrt(2 * std::max(1.0, tone.gain));
  Finding finding;
  // A constant has no range; leakage travels some centimetres.
  const bool constant = tone.range_m < std::max(bounds::kMostConstantRange_m, 3 * tone.range_error_m);
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
  finding.candidates = {{finding.cause, 1.0}};
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
  constexpr double kDegree = M_PI / 180;
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
  finding.evidence.log_likelihood_gain = errors.gain;
  finding.evidence.false_alarm_rate = std::min(1.0, std::exp(-errors.held_out_gain));
  finding.where.emplace_back();
  return finding;
}

}  // namespace mmradartwin::diagnosis::receiver
