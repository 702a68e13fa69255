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

constexpr double kLeastGain_db = -60;  ///< of a channel of a tone, that is written

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
  f.mechanism = frames.mechanism;
  if (f.cause == "unknown") return f;
  NamedParameters m = defaultMechanism(f.cause);
  for (const FindingParameter& p : f.parameters) {
    if (m.values.has(p.name)) m.values.set(p.name, p.value);
  }
  f.mechanism = m;
  return f;
}

bool differsFromStated(const Finding& f, const std::vector<NamedParameters>& stated) {
  if (!f.mechanism) return true;
  const Parameters& found = f.mechanism->values;
  const bool placed = found.has("x_m") && found.has("y_m");
  const auto differs = [](double is, const std::array<double, 2>& ci95, double states) {
    return std::abs(is - states) > bounds::kSameValue_intervals * (ci95[1] - ci95[0]);
  };
  return std::none_of(stated.begin(), stated.end(), [&](const NamedParameters& m) {
    if (placed && m.mechanism == f.mechanism->mechanism) {  // other numbers are of one walk and one session
      return std::hypot(m.values.number("x_m") - found.number("x_m"), m.values.number("y_m") - found.number("y_m")) <
             bounds::kSameWalker_m;
    }
    if (!excludeEachOther(m, *f.mechanism)) return false;
    return std::none_of(f.parameters.begin(), f.parameters.end(), [&](const FindingParameter& p) {
      if (p.ci95.empty() || !m.values.has(p.name)) return false;
      if (const double* is = std::get_if<double>(&p.value)) return differs(*is, p.ci95[0], m.values.number(p.name));
      const auto* list = std::get_if<std::vector<double>>(&p.value);
      if (list == nullptr) return false;
      const std::vector<double>& states = m.values.numbers(p.name);
      for (std::size_t k = 0; k < list->size(); ++k) {
        if (k >= states.size() || differs((*list)[k], p.ci95[k], states[k])) return true;
      }
      return false;
    });
  });
}

Finding findingOf(const SampleConvention& convention, const RadarConfig& radar) {
  Finding f;
  f.cause = convention.mechanism.mechanism;
  f.mechanism = convention.mechanism;
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
  f.evidence.log_likelihood_gain = convention.gain;
  f.evidence.false_alarm_rate = std::min(1.0, bounds::kConventionTries * std::exp(-convention.gain));
  f.evidence.margin = convention.margin;
  return f;
}

Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest) {
  const double rms = std::sqrt(tone.channels.squaredNorm() / static_cast<double>(tone.channels.size()));
  const double level_db = 20 * std::log10(rms / strongestMeasured(rest));
  const double error_db = 8.686 / std::sqrt(2 * std::max(1.0, tone.gain));
  Finding f;
  // A constant has no range at all; leakage travels some centimetres.
  const bool constant = tone.range_m < std::max(bounds::kMostConstantRange_m, 3 * tone.range_error_m);
  f.cause = constant ? "dc_offset" : "tx_rx_leakage";
  NamedParameters m = defaultMechanism(f.cause);
  m.values.set("level_db", level_db);
  if (!constant) {
    std::vector<double> phase_deg, gain_db;
    for (Eigen::Index k = 0; k < tone.channels.size(); ++k) {
      phase_deg.push_back(std::arg(tone.channels[k] / tone.channels[0]) * 180 / M_PI);
      gain_db.push_back(std::max(kLeastGain_db, 20 * std::log10(std::abs(tone.channels[k]) / rms)));
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
  std::ostringstream text;
  text << std::setprecision(3) << "a tone of the radar's own, "
       << (rest.poses.size() > 1 ? "the same at all poses" : "") << (rest.poses.size() > 1 ? ", " : "")
       << "and no array response: the direction that fits best has " << 100 * tone.array_share << " % of its power";
  f.description = text.str();
  f.evidence.log_likelihood_gain = tone.gain;
  f.evidence.false_alarm_rate = tone.false_alarm_rate;
  f.where.push_back({{{0.0, tone.range_m + 2 * rest.radar.range_bin_m()}}, {}, {}, {}, {}, {}});
  return f;
}

Finding findingOf(const ChannelErrors& errors) {
  Finding f;
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
    f.cause = "tx_imbalance";
    const Eigen::Index last = phase_deg.size() - 1;
    const auto number = [&](const char* name, const char* unit, double value, double error) {
      f.parameters.push_back({name, unit, value, {{value - wide * error, value + wide * error}}});
    };
    number("phase_deg", "deg", phase_deg[last], error_deg[last]);
    number("gain_db", "dB", errors.gain_db[last], errors.gain_error_db[last]);
    text << "transmitters differ, receivers do not";
  } else {
    f.cause = "channel_phase_error";
    f.parameters = {list("phase_deg", "deg", phase_deg, error_deg),
                    list("gain_db", "dB", errors.gain_db, errors.gain_error_db)};
    if (errors.tie == ChannelTie::kReceivers) {
      text << "each receiver's error is the same under all transmitters, within " << errors.apart_rad / kDegree
           << " deg where every channel is left free";
    } else {
      text << "receivers' errors differ between transmitters";
    }
    text << "; a slope over the array is taken as a turn of the radar, which no echo tells from it";
  }
  f.description = text.str();
  NamedParameters m = defaultMechanism(f.cause);
  for (const FindingParameter& p : f.parameters) m.values.set(p.name, p.value);
  f.mechanism = m;
  f.candidates = {{f.cause, 1.0}};
  f.evidence.log_likelihood_gain = errors.gain;
  f.evidence.false_alarm_rate = std::min(1.0, std::exp(-errors.held_out_gain));
  f.where.emplace_back();
  return f;
}

}  // namespace mmradartwin::diagnosis::receiver
