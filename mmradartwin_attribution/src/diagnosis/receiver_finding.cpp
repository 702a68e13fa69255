#include "receiver_finding.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <complex>
#include <iomanip>
#include <numeric>
#include <sstream>

#include "echo_source.h"
#include "finding_figure.h"
#include "held_out_gain.h"
#include "hypothesis_fit.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_dsp/range_angle.h"
#include "pose_time_lag.h"

namespace mmradartwin {
namespace {

constexpr double kDbPerNeper = 8.685889638065035;
constexpr double kSameValue = 1;                             ///< widths of an interval of 95 %
constexpr double kSamePlace_m = 0.5;                         ///< of someone who walks
constexpr double kLevelError_db = 0.3, kSharedError_db = 3;  ///< of an echo alone in its cell, and by the others there

/// By bin, mean over the channels.
Eigen::VectorXd measuredPower(const PoseChannels& pose) {
  return pose.y.colwise().squaredNorm().transpose() / static_cast<double>(pose.y.rows());
}

/// Of a tone about that bin: its power summed over Hann's lobe is 1.5 times its own, wherever it lies between the bins.
double tonePower(const Eigen::VectorXd& power, Eigen::Index bin) { return power.segment(bin - 2, 5).sum() / 1.5; }

/// Amplitude of the strongest tone of all poses.
double strongestMeasured(const ChannelData& data) {
  double strongest = 0;
  for (const PoseChannels& p : data.poses) {
    const Eigen::VectorXd power = measuredPower(p);
    for (Eigen::Index r = 2; r + 2 < power.size(); ++r) {
      if (power[r] >= power[r - 1] && power[r] >= power[r + 1]) strongest = std::max(strongest, tonePower(power, r));
    }
  }
  return std::sqrt(strongest);
}

}  // namespace

ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage) {
  return [&options, stage](std::size_t done, std::size_t all) {
    if (options.cancelled && options.cancelled()) throw DiagnosisCancelled("the diagnosis was cancelled");
    if (options.on_progress) options.on_progress({stage, static_cast<double>(done) / static_cast<double>(all)});
  };
}

ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress) {
  ReceivedSession session;
  FrameExaminer examiner(recording.radar);
  session.data = readChannels(recording, examiner, on_progress);
  session.frames = examiner.findings();
  session.unexplained = examiner.unexplained();
  if (by_echoes) session.deliveries = findDeliveryByEchoes(session.data);
  if (session.deliveries.empty()) return session;
  // Bytes are judged as they came, what moves where it is.
  FrameExaminer repaired(recording.radar);
  session.data = readChannels(recording, repaired, on_progress, [&](AdcCube& frame) {
    for (const Delivery& d : session.deliveries) undoDelivery(d, recording.radar, frame);
  });
  const auto moves = [](const FrameFinding& f) { return f.cause == "moving_target"; };
  std::vector<FrameFinding>& frames = session.frames;
  frames.erase(std::remove_if(frames.begin(), frames.end(), moves), frames.end());
  for (FrameFinding& f : repaired.findings()) {
    if (moves(f)) frames.push_back(std::move(f));
  }
  return session;
}

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

bool isNews(const Finding& f, const std::vector<NamedParameters>& stated) {
  if (!f.mechanism) return true;
  const Parameters& found = f.mechanism->values;
  const bool placed = found.has("x_m") && found.has("y_m");
  const auto differs = [](double is, const std::array<double, 2>& ci95, double states) {
    return std::abs(is - states) > kSameValue * (ci95[1] - ci95[0]);
  };
  return std::none_of(stated.begin(), stated.end(), [&](const NamedParameters& m) {
    if (placed && m.mechanism == f.mechanism->mechanism) {  // its numbers are of one walk and one session
      return std::hypot(m.values.number("x_m") - found.number("x_m"), m.values.number("y_m") - found.number("y_m")) <
             kSamePlace_m;
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

void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& f) {
  if (data.locations.size() < 2) return;
  if (!f.gain) f.gain.emplace();
  if (by_pose.empty()) {
    const double poses = static_cast<double>(data.poses.size());
    f.gain->log_likelihood_per_pose = {0, f.evidence.log_likelihood_gain / poses, {}};
    return;
  }
  std::vector<double> nats;
  for (const PoseChannels& p : data.poses) {
    const auto at = by_pose.find(p.pose.name);
    nats.push_back(at == by_pose.end() ? 0 : at->second);
  }
  f.gain->log_likelihood_per_pose = likelihoodGain(data, std::vector<double>(nats.size(), 0.0), nats);
}

void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended) {
  for (const FrameFinding& frame : frames) {
    Finding f = findingOf(frame);
    if (f.mechanism && f.mechanism->values.has("level_db")) {
      // Of full scale, as the data are, and over the strongest echo.
      const double over_db = 20 * std::log10(32768 * strongestMeasured(data));
      f.mechanism->values.set("level_db", f.mechanism->values.number("level_db") - over_db);
    }
    if (!isNews(f, stated)) continue;
    if (f.mechanism) putIn(*f.mechanism, extended);
    if (!findings.findings.empty() && findings.findings.back().cause == "unknown") {
      std::optional<std::string>& said = findings.findings.back().description;
      said = said.value_or("") + "; besides: " + frame.description;
      continue;
    }
    addGainInNats(data, frame.nats_by_pose, f);
    findings.findings.push_back(std::move(f));
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

namespace {

void changeLevel(Finding& f, double by_db, double error_db) {
  const auto level = std::find_if(f.parameters.begin(), f.parameters.end(),
                                  [](const FindingParameter& p) { return p.name == "level_db"; });
  if (level == f.parameters.end()) return;
  const double was_db = std::get<double>(level->value), half_db = level->ci95[0][1] - was_db;
  const double level_db = was_db + by_db, both_db = std::hypot(half_db, 1.96 * error_db);
  level->value = level_db;
  level->ci95 = {{level_db - both_db, level_db + both_db}};
  f.mechanism->values.set("level_db", level_db);
}

/// The session's strongest echo: what was measured where the twin has one, and of that the share that the twin gives it
/// beside the others there. What the twin has and the room has not is weak in the data.
struct MeasuredEcho {
  double amplitude = 0, share = 1;
};

MeasuredEcho strongestMeasured(const Twin& twin, const ChannelData& data) {
  constexpr double kReach = 2.5;  // bins
  double strongest = 0;
  MeasuredEcho echo;
  for (const PoseChannels& p : data.poses) {
    const Eigen::Isometry3d& T = p.pose.T_map_radar;
    const Eigen::VectorXd measured = measuredPower(p);
    std::vector<std::pair<double, double>> expected;  // bin and power
    for (const PathRecord& r : twin.receivedPaths(T, twin.trace(T), p.pose.stamp_ns)) {
      double power = 0;
      for (const std::complex<double>& c : r.c) power += std::norm(c);
      expected.emplace_back(0.5 * r.length_m[0] / data.radar.range_bin_m(), power);
    }
    for (const auto& [place, power] : expected) {
      const Eigen::Index bin = std::lround(place);
      if (bin < 2 || bin + 2 >= measured.size()) continue;
      const double lobe = tonePower(measured, bin);
      if (lobe <= strongest) continue;
      double all = 0;
      for (const auto& [other, other_power] : expected) all += std::abs(other - place) < kReach ? other_power : 0;
      const double own = lobe * power / all;
      if (own <= strongest) continue;
      strongest = own;
      echo = {std::sqrt(own), power / all};
    }
  }
  return echo;
}

/// Of the strongest echo's level: how it adds to others in its cell is chance.
double errorOf_db(const MeasuredEcho& echo) { return kLevelError_db + kSharedError_db * (1 - echo.share); }

}  // namespace

void referToStrongestEcho(const Twin& twin, const ChannelData& data, Finding& f) {
  const MeasuredEcho echo = strongestMeasured(twin, data);
  if (!(echo.amplitude > 0)) return;
  changeLevel(f, kDbPerNeper * std::log(strongestMeasured(data) / echo.amplitude), errorOf_db(echo));
}

void referToStrongestHost(const Twin& twin, const ChannelData& data, double log_gain, double amplitude, Finding& f) {
  const MeasuredEcho echo = strongestMeasured(twin, data);
  if (!(echo.amplitude > 0)) return;
  changeLevel(f, kDbPerNeper * (std::log(echo.amplitude / amplitude) - 0.5 * log_gain), errorOf_db(echo));
}

bool measureImage(const ChannelData& data, Finding& f) {
  constexpr double kHost = 10;        // times the power beside its image
  constexpr Eigen::Index kFirst = 2;  // leakage and offset stand below, their images at the end
  constexpr int kIterations = 6;
  constexpr double kLeastError_db = 0.03;
  const std::size_t locations = data.locations.size();
  if (locations < 3) return false;
  std::vector<std::complex<double>> shared;
  std::vector<double> host;
  std::complex<double> beta = 0;
  double hosts = 0;
  // Cells count by what stands there beside the image: by all power there, those that echoes of the room make weaker
  // would count most.
  for (int i = 0; i < kIterations; ++i) {
    shared.assign(locations, 0.0);
    host.assign(locations, 0.0);
    for (const PoseChannels& p : data.poses) {
      const std::size_t l = static_cast<std::size_t>(p.location);
      for (Eigen::Index k = kFirst; k <= p.y.cols() - kFirst; ++k) {
        const Eigen::VectorXcd there = p.y.col(p.y.cols() - k).conjugate();
        const double beside = (p.y.col(k) - beta * there).squaredNorm();
        if (!(beside > 0) || there.squaredNorm() < kHost * beside) continue;
        shared[l] += there.dot(p.y.col(k)) / beside;
        host[l] += there.squaredNorm() / beside;
      }
    }
    hosts = std::accumulate(host.begin(), host.end(), 0.0);
    if (!(hosts > 0)) return false;
    beta = std::accumulate(shared.begin(), shared.end(), std::complex<double>()) / hosts;
  }
  double scatter = 0;
  for (std::size_t l = 0; l < locations; ++l) {
    scatter += std::pow(std::real((shared[l] - beta * host[l]) * std::conj(beta)) / std::norm(beta) / hosts, 2);
  }
  const double n = static_cast<double>(locations);
  const double width = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  const double half_db = width * std::max(kLeastError_db, kDbPerNeper * std::sqrt(scatter * n / (n - 1)));
  const double image_db = kDbPerNeper * std::log(std::abs(beta));
  f.mechanism->values.set("image_db", image_db);
  f.mechanism->values.set("phase_deg", std::arg(beta) * 180 / M_PI);
  for (FindingParameter& p : f.parameters) {
    if (p.name != "image_db") continue;
    p.value = image_db;
    p.ci95 = {{image_db - half_db, image_db + half_db}};
  }
  return true;
}

void subtractImage(const NamedParameters& m, ChannelData& data) {
  const std::complex<double> beta =
      std::polar(std::pow(10.0, m.values.number("image_db") / 20), m.values.number("phase_deg") * M_PI / 180);
  const SignalChain chain(data.radar);
  for (PoseChannels& p : data.poses) {
    p.grid.x -= beta * p.grid.x.conjugate().eval();
    transformGrid(chain, p);
  }
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
  const TimedRecording timed = inTime(recording, {}, readingProgress(options, "frames on the way"));
  ReceivedSession session = receiveSession(timed.recording, true, readingProgress(options, "reading captures"));
  ChannelData& data = session.data;
  Diagnosis result;
  const auto add = [&](Finding finding, const std::map<std::string, double>& nats_by_pose = {}) {
    addGainInNats(data, nats_by_pose, finding);
    result.extended.mechanisms.push_back(*finding.mechanism);
    result.findings.findings.push_back(std::move(finding));
  };
  if (timed.finding) add(findingOf(*timed.finding));
  for (const FrameFinding& f : session.frames) add(findingOf(f), f.nats_by_pose);
  for (const Delivery& d : session.deliveries) add(findingOf(d, data.radar));
  if (const BodyFixedTone tone = findBodyFixedTone(data); isPlain(tone)) {
    subtractTone(tone, data);
    add(findingOf(tone, data));
  }
  if (const std::optional<ChannelErrors> errors = findChannelErrors(data)) add(findingOf(*errors));
  addUnexplained(session.unexplained, data, {}, result.findings, result.extended.mechanisms);
  result.findings.poses = static_cast<int>(data.poses.size());
  result.findings.locations = static_cast<int>(data.locations.size());
  result.findings.held_out = "nothing: without a scene only frames and channels are judged";
  result.has_twin = false;
  result.extended.radar = recording.radar;
  result.problems = data.problems;
  result.plan = surveyPlan(nullptr, timed.recording.poses);
  return result;
}

}  // namespace mmradartwin
