#include "diagnosis/frames/frame_examiner.h"

#include <algorithm>
#include <boost/math/distributions/beta.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <set>
#include <sstream>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/frames/frame_stack.h"
#include "diagnosis/frames/law_findings.h"
#include "diagnosis/frames/motion_locator.h"
#include "diagnosis/frames/payload_defects.h"
#include "diagnosis/frames/shot_examiner.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/statistics.h"

namespace mmradartwin::diagnosis::frames {
namespace {

using Complex = std::complex<float>;

constexpr int kMostSlips = 3;              ///< slips of one pose that are closed
constexpr double kLeastScatter_db = 1e-4;  ///< of a frame's level over poses: floor, against division by zero

/// 95 % interval of a share of `trials` by Clopper and Pearson.
std::array<double, 2> shareInterval(double hits, double trials) {
  const auto quantile = [](double a, double b, double p) {
    return boost::math::quantile(boost::math::beta_distribution<double>(a, b), p);
  };
  return {hits > 0 ? quantile(hits, trials - hits + 1, 0.025) : 0.0,
          hits < trials ? quantile(hits + 1, trials - hits, 0.975) : 1.0};
}

FindingParameter number(const char* name, const char* unit, double value, const std::array<double, 2>& ci95) {
  return {name, unit, value, {ci95}};
}

/// Statistics of one pose that findings() judges.
struct PoseJudgement {
  std::string pose;
  ZeroedPackets packets;
  double slip_gain = 0;
  Rails rails;
  ClippedCount values;
  Bursts bursts;
  double turn_rad_per_frame = 0, turn_variance = 0;
  int turn_cells = 0, frames = 0;
  std::vector<double> frame_gain_db;  ///< common to all channels and samples
  double unsteady_share = 0, unsteady_nats = 0;
  std::vector<FrameLaw> laws;
};

}  // namespace

struct FrameExaminer::State {
  explicit State(const RadarConfig& config) : radar(config), order(payloadOrder(config)), examiner(config) {}

  RadarConfig radar;
  std::vector<int> order;
  ShotExaminer examiner;
  std::vector<PoseJudgement> judged;
  std::vector<PoseMotion> motion;
  std::vector<PoseFrames> poses;
  mutable std::optional<LocatedMotion> located;  ///< motion at the poses so far, once it was computed

  const LocatedMotion& locate() const {
    if (!located) located = locateMotion(radar, motion);
    return *located;
  }
  FrameFinding saturation() const;
  FrameFinding packetLoss() const;
  std::vector<FrameFinding> misalignments() const;  ///< one per pose
  FrameFinding interference() const;
  FrameFinding drift() const;
  FrameFinding frameGain() const;
  FrameFinding unsteadiness() const;
  /// Checks the shape of a pose's frames; throws InputError.
  void requireShape(const Pose& pose, const std::vector<AdcCube>& frames) const;
  /// Repairs the byte stream of a pose as far as possible.
  FrameStack repairBytes(const std::vector<AdcCube>& frames, PoseJudgement& judged) const;
  /// Levels in dB of a frame at all poses except those of one location.
  std::vector<double> levelsOf_db(std::size_t frame, const std::string& without = "") const;
};

FrameExaminer::FrameExaminer(const RadarConfig& radar) : state_(std::make_unique<State>(radar)) {}
FrameExaminer::~FrameExaminer() = default;
FrameExaminer::FrameExaminer(FrameExaminer&&) noexcept = default;
FrameExaminer& FrameExaminer::operator=(FrameExaminer&&) noexcept = default;

const std::vector<PoseFrames>& FrameExaminer::poses() const { return state_->poses; }

void FrameExaminer::State::requireShape(const Pose& pose, const std::vector<AdcCube>& frames) const {
  for (const AdcCube& cube : frames) {
    if (cube.chirps == radar.chirps_per_frame() && cube.samples == radar.samples_per_chirp &&
        cube.receivers == radar.receivers() && cube.chirp_valid.size() == static_cast<std::size_t>(cube.chirps) &&
        cube.data.size() == static_cast<std::size_t>(cube.chirps) * cube.samples * cube.receivers * 2) {
      continue;
    }
    throw InputError("pose " + pose.name + ": frame " + std::to_string(cube.sequence) + " has " +
                     std::to_string(cube.chirps) + " chirps x " + std::to_string(cube.samples) + " samples x " +
                     std::to_string(cube.receivers) + " receivers; the radar's radar.yaml says " +
                     std::to_string(radar.chirps_per_frame()) + " x " + std::to_string(radar.samples_per_chirp) +
                     " x " + std::to_string(radar.receivers()));
  }
}

FrameStack FrameExaminer::State::repairBytes(const std::vector<AdcCube>& frames, PoseJudgement& judged) const {
  Payload payload = toPayload(frames, order);
  judged.packets = markZeroedPackets(payload, order);
  for (int slips = 0; slips < kMostSlips; ++slips) {
    const std::optional<Slip> slip = findSlip(payload);
    if (!slip) break;
    closeSlip(*slip, payload);
    judged.slip_gain += slip->log_likelihood_gain;
  }
  return FrameStack(radar, payload, order);
}

void FrameExaminer::addPose(const Pose& pose, const std::vector<AdcCube>& frames) {
  State& state = *state_;
  state.requireShape(pose, frames);
  PoseJudgement judged;
  judged.pose = pose.name;
  judged.frames = static_cast<int>(frames.size());
  // All later steps need correctly placed samples, so that bytes come first.
  FrameStack stack = state.repairBytes(frames, judged);
  judged.rails = countRails(stack);
  ClippedValues clipped = clippedValues(judged.rails, stack);
  const std::map<std::size_t, Complex> clipped_means = clippedMeans(clipped, stack);
  const double turn = state.examiner.commonTurn(stack);
  turnFrames(-turn, stack);
  std::vector<Complex> average = medianShot(stack);
  // Where the static signal itself reaches the converter's limit, clipped values are no bursts.
  dropStandingClipped(clipped, average, stack);
  Bursts bursts = dropBursts(average, differenceVariance(stack), stack);
  judged.values = countClipped(clipped, bursts, stack);
  judged.bursts = bursts;

  average = meanShot(stack);
  // A value that is clipped in every shot is closer to the truth than zero.
  for (const auto& [place, mean] : clipped_means) {
    if (average[place] == Complex(0)) average[place] = mean;
  }
  ShotStatistics residuals = state.examiner.examine(stack, average);
  judged.turn_rad_per_frame = turn + residuals.turn_rad_per_frame;
  judged.turn_variance = residuals.turn_variance;
  judged.turn_cells = residuals.turn_cells;
  judged.unsteady_share = residuals.unsteady_share;
  judged.unsteady_nats = residuals.unsteady_nats;
  judged.laws = std::move(residuals.laws);
  for (double level : residuals.frame_level) judged.frame_gain_db.push_back(20 * std::log10(std::max(level, 1e-6)));

  PoseFrames result;
  result.pose = pose.name;
  result.mean.stamp_ns = pose.stamp_ns;
  result.mean.frames = stack.frames;
  result.mean.pose_valid = true;
  result.mean.T_map_radar = pose.T_map_radar;
  result.mean.x.resize(stack.channels(), stack.samples);
  for (int k = 0; k < stack.channels(); ++k) {
    for (int n = 0; n < stack.samples; ++n) result.mean.x(k, n) = average[stack.at(0, k, n)];
  }
  result.noise_variance = std::move(residuals.noise_variance);
  result.shots = residuals.shots;
  result.unsteadiness = std::move(residuals.unsteadiness);
  result.moving = std::move(residuals.cells);
  state.poses.push_back(std::move(result));
  const std::vector<double>& noise = state.poses.back().noise_variance;
  state.motion.push_back({pose, stack.frames, std::move(residuals.evidence), std::move(residuals.echoes),
                          std::accumulate(noise.begin(), noise.end(), 0.0) / static_cast<double>(noise.size()),
                          std::move(residuals.tracks)});
  state.judged.push_back(std::move(judged));
  state.located.reset();
}

FrameFinding FrameExaminer::State::packetLoss() const {
  FrameFinding finding;
  finding.cause = "packet_loss";
  long long lost = 0, packets = 0;
  for (const PoseJudgement& p : judged) {
    packets += p.packets.packets;
    lost += p.packets.lost;
    finding.log_likelihood_gain += p.packets.log_likelihood_gain;
    finding.nats_by_pose[p.pose] = p.packets.log_likelihood_gain;
    if (p.packets.lost > 0) finding.poses.push_back(p.pose);
  }
  if (lost == 0) return finding;
  finding.false_alarm_rate = bounds::kFramesFalseAlarmRate;
  const double share = static_cast<double>(lost) / static_cast<double>(packets);
  finding.parameters = {number("lost_fraction", "1", share, shareInterval(lost, packets))};
  std::ostringstream text;
  text << lost << " of " << packets << " packets of " << kPacketBytes << " bytes are filled with zeros and not flagged";
  finding.description = text.str();
  return finding;
}

std::vector<FrameFinding> FrameExaminer::State::misalignments() const {
  std::vector<FrameFinding> all;
  for (const PoseJudgement& judgement : judged) {
    if (judgement.slip_gain <= 0) continue;
    FrameFinding finding;
    finding.cause = "packet_misalignment";
    finding.poses = {judgement.pose};
    finding.log_likelihood_gain = judgement.slip_gain;
    finding.nats_by_pose = {{judgement.pose, judgement.slip_gain}};
    finding.false_alarm_rate = bounds::kFramesFalseAlarmRate;
    finding.parameters = {{"pose", "", judgement.pose, {}}};
    finding.description =
        "packets are missing and were not filled: from there on samples belong to other channels and times";
    all.push_back(std::move(finding));
  }
  return all;
}

FrameFinding FrameExaminer::State::saturation() const {
  FrameFinding finding;
  finding.cause = "adc_saturation";
  // All poses have one converter: its limits are the outermost codes of the whole session.
  int high = 0, low = 0;
  for (const PoseJudgement& p : judged) {
    high = std::max(high, p.rails.high.code);
    low = std::min(low, p.rails.low.code);
  }
  double at_code = 0, next_codes = 0, clipped = 0, counted = 0, spread = 0;
  for (const PoseJudgement& judgement : judged) {
    counted += judgement.values.counted;
    const bool top = judgement.rails.high.code == high, bottom = judgement.rails.low.code == low;
    if ((!top && !bottom) || judgement.values.clipped <= 0) continue;
    at_code += judgement.values.clipped;
    next_codes += (top ? judgement.rails.high.next_codes : 0) + (bottom ? judgement.rails.low.next_codes : 0);
    clipped += judgement.values.clipped;
    spread += judgement.values.clipped;
    finding.poses.push_back(judgement.pose);
  }
  finding.log_likelihood_gain = pileUp({0, at_code, next_codes});
  if (finding.log_likelihood_gain > 0 && (high == INT16_MAX || low == INT16_MIN)) {
    finding.log_likelihood_gain += std::log(bounds::kOddsOfLastCode);
  }
  finding.false_alarm_rate = std::exp(-finding.log_likelihood_gain);
  if (finding.false_alarm_rate > bounds::kFramesFalseAlarmRate || counted == 0) {
    finding.log_likelihood_gain = 0;
    return finding;
  }
  const double share = clipped / counted;
  // Samples of a pose clip in all shots or in none unless noise decides. The error is 0.2 times the root of their
  // number.
  finding.parameters = {number("clipped_fraction", "1", share,
                               {std::max(0.0, share - 1.96 * std::sqrt(spread) / counted * 0.2),
                                share + 1.96 * std::sqrt(spread) / counted * 0.2})};
  std::ostringstream text;
  text << "samples pile up at the outermost codes " << low << " and " << high << ": " << 100 * share
       << " % of all I and Q values";
  finding.description = text.str();
  return finding;
}

FrameFinding FrameExaminer::State::interference() const {
  FrameFinding finding;
  finding.cause = "interference";
  double frames = 0, hit = 0;
  for (const PoseJudgement& p : judged) {
    frames += p.bursts.frames;
    hit += p.bursts.hit_frames;
    finding.log_likelihood_gain += p.bursts.log_likelihood_gain;
    finding.nats_by_pose[p.pose] = p.bursts.log_likelihood_gain;
    if (p.bursts.hit_frames > 0) finding.poses.push_back(p.pose);
  }
  if (hit == 0) return finding;
  finding.false_alarm_rate = bounds::kBurstsFalseAlarmRate;
  finding.parameters = {number("frame_fraction", "1", hit / frames, shareInterval(hit, frames))};
  std::ostringstream text;
  text << "bursts within single chirps, the same wave at all receivers, in " << hit << " of " << frames << " frames";
  finding.description = text.str();
  return finding;
}

FrameFinding FrameExaminer::State::drift() const {
  FrameFinding finding;
  finding.cause = "phase_drift";
  std::vector<const PoseJudgement*> used;
  for (const PoseJudgement& p : judged) {
    if (std::isfinite(p.turn_variance)) used.push_back(&p);
  }
  if (used.empty()) return finding;
  // Random-effects mean (DerSimonian and Laird): poses may differ by more than their own errors.
  const auto mean = [&](double between, double& weights) {
    double sum = 0;
    weights = 0;
    for (const PoseJudgement* p : used) {
      sum += p->turn_rad_per_frame / (p->turn_variance + between);
      weights += 1 / (p->turn_variance + between);
    }
    return sum / weights;
  };
  double weights = 0, squares = 0, chi2 = 0;
  const double fixed = mean(0, weights);
  for (const PoseJudgement* p : used) {
    squares += 1 / (p->turn_variance * p->turn_variance);
    chi2 += std::pow(p->turn_rad_per_frame - fixed, 2) / p->turn_variance;
  }
  const double poses = static_cast<double>(used.size());
  const double room = weights - squares / weights;
  const double between = room > 0 ? std::max(0.0, (chi2 - (poses - 1)) / room) : 0;
  const double turn = mean(between, weights);
  const double error = std::sqrt(1 / weights);
  // A drift of the radar turns the phase of all cells alike. One echo at one pose may turn by its own motion.
  int cells = 0;
  for (const PoseJudgement* p : used) cells += p->turn_cells;
  const double freedom = std::max(poses, static_cast<double>(cells)) - 1;
  if (freedom < 2) return finding;
  const double t = std::abs(turn) / error;
  const boost::math::students_t_distribution<double> student(freedom);
  finding.false_alarm_rate = 2 * boost::math::cdf(boost::math::complement(student, t));
  if (!(finding.false_alarm_rate < bounds::kFramesFalseAlarmRate)) return finding;
  finding.log_likelihood_gain = 0.5 * t * t;
  const double half = boost::math::quantile(student, 0.975) * error;
  finding.parameters = {number("rad_per_frame", "rad", turn, {turn - half, turn + half})};
  for (const PoseJudgement* p : used) {
    if (std::abs(p->turn_rad_per_frame) > 3 * std::sqrt(p->turn_variance)) finding.poses.push_back(p->pose);
  }
  std::ostringstream text;
  text << "all cells turn alike by " << turn << " rad from each frame to the next; an average over "
       << used.front()->frames << " frames loses "
       << -20 * std::log10(std::max(1e-9, std::abs(std::sin(0.5 * turn * used.front()->frames) /
                                                   (used.front()->frames * std::sin(0.5 * turn)))))
       << " dB by it";
  finding.description = text.str();
  return finding;
}

std::vector<double> FrameExaminer::State::levelsOf_db(std::size_t frame, const std::string& without) const {
  std::vector<double> levels;
  for (std::size_t i = 0; i < judged.size(); ++i) {
    const std::vector<double>& gain_db = judged[i].frame_gain_db;
    if (frame >= gain_db.size() || gain_db.size() < 3) continue;
    if (without.empty() || motion[i].pose.location != without) levels.push_back(gain_db[frame]);
  }
  return levels;
}

FrameFinding FrameExaminer::State::frameGain() const {
  FrameFinding finding;
  finding.cause = "unknown";
  std::size_t frames = 0;
  for (const PoseJudgement& p : judged) frames = std::max(frames, p.frame_gain_db.size());
  // Bursts at some poses do not affect the median over poses of each frame's level. The gain changes where the median
  // differs between frames by far more than its error over poses.
  double chi2 = 0, lowest = 0, highest = 0;
  std::size_t lowest_at = 0, highest_at = 0, counted = 0;
  std::vector<double> middle_db(frames, 0.0), scatter_db(frames, std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < frames; ++i) {
    const std::vector<double> levels = levelsOf_db(i);
    if (levels.size() < 3) continue;
    const double middle = middle_db[i] = quantile(levels, 0.5);
    std::vector<double> apart;
    for (double level : levels) apart.push_back(std::abs(level - middle));
    // The standard deviation of normal errors is 1.48 times their median size, and a median's error is 1.25 times a
    // mean's.
    scatter_db[i] = std::max(1.48 * quantile(apart, 0.5), kLeastScatter_db);
    const double error = 1.25 * scatter_db[i] / std::sqrt(static_cast<double>(levels.size()));
    chi2 += std::pow(middle / error, 2);
    ++counted;
    if (middle < lowest) {
      lowest = middle;
      lowest_at = i;
    }
    if (middle > highest) {
      highest = middle;
      highest_at = i;
    }
  }
  if (counted < 3 || highest - lowest < bounds::kLeastFrameGain_db) return finding;
  const double excess = (chi2 - static_cast<double>(counted)) / std::sqrt(2.0 * static_cast<double>(counted));
  if (excess < bounds::kLeastFrameGain_deviations) return finding;
  finding.log_likelihood_gain = 0.5 * (chi2 - static_cast<double>(counted));
  finding.false_alarm_rate = std::exp(-0.5 * excess);
  for (const PoseJudgement& p : judged) finding.poses.push_back(p.pose);
  finding.mechanism = NamedParameters{"empirical_frame_gain", {}};
  finding.mechanism->values.set("gain_db", middle_db);
  for (std::size_t i = 0; i < judged.size(); ++i) {
    double& nats = finding.nats_by_pose[judged[i].pose];
    for (std::size_t j = 0; j < judged[i].frame_gain_db.size(); ++j) {
      const std::vector<double> others = levelsOf_db(j, motion[i].pose.location);
      if (others.empty()) continue;
      const double level = judged[i].frame_gain_db[j], rest = level - quantile(others, 0.5);
      nats += 0.5 * (level * level - rest * rest) / (scatter_db[j] * scatter_db[j]);
    }
  }
  std::ostringstream text;
  text << "the common level of frames changes within a pose, at all poses alike: lowest in frame " << lowest_at << " ("
       << lowest << " dB), highest in frame " << highest_at << " (" << highest << " dB against the mean)";
  finding.description = text.str();
  return finding;
}

FrameFinding FrameExaminer::State::unsteadiness() const {
  FrameFinding finding;
  finding.cause = "unknown";
  for (const PoseJudgement& p : judged) {
    if (p.unsteady_share < bounds::kLeastUnsteadyShare) continue;
    finding.poses.push_back(p.pose);
    finding.log_likelihood_gain += p.unsteady_nats;
  }
  // No walker is in half of all bins at two thirds of the poses.
  if (finding.poses.size() < bounds::kFewestUnsteadyPoses || 3 * finding.poses.size() < 2 * judged.size()) return {};
  finding.false_alarm_rate = bounds::kFramesFalseAlarmRate;
  finding.description = "frames of one pose disagree about what stands, in most of its echoes at once, at " +
                        std::to_string(finding.poses.size()) + " of " + std::to_string(judged.size()) +
                        " poses: the radar itself changes from frame to frame";
  return finding;
}

namespace {

/// True where all poses of a finding are among these.
bool standsWithin(const FrameFinding& f, const std::set<std::string>& poses) {
  return std::all_of(f.poses.begin(), f.poses.end(), [&](const std::string& p) { return poses.count(p) > 0; });
}

}  // namespace

std::vector<FrameFinding> FrameExaminer::findings() const {
  const State& state = *state_;
  std::vector<FrameFinding> all = state.misalignments();
  all.push_back(state.saturation());
  all.push_back(state.packetLoss());
  // Moving echoes, bursts and phase drift can be found only where the radar is the same in all frames.
  const bool steady = state.unsteadiness().poses.empty();
  if (steady) {
    all.push_back(state.interference());
    all.push_back(state.drift());
  }
  // A strong walker changes the common gain of a frame, which leaves something like a burst. Remainders of bursts look
  // like moving echoes. Where all poses of one have the other as well, the other is the cause.
  const std::vector<FrameFinding> walkers = steady ? state.locate().walkers : std::vector<FrameFinding>();
  std::set<std::string> walked, hit;
  for (const FrameFinding& walker : walkers) walked.insert(walker.poses.begin(), walker.poses.end());
  all.erase(std::remove_if(all.begin(), all.end(),
                           [&](const FrameFinding& f) { return f.cause == "interference" && standsWithin(f, walked); }),
            all.end());
  for (const FrameFinding& f : all) {
    if (f.cause == "interference" && f.log_likelihood_gain > 0) hit.insert(f.poses.begin(), f.poses.end());
  }
  for (const FrameFinding& walker : walkers) {
    if (!standsWithin(walker, hit)) all.push_back(walker);
  }
  all.erase(std::remove_if(all.begin(), all.end(), [](const auto& f) { return f.log_likelihood_gain <= 0; }),
            all.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const auto& a, const auto& b) { return a.log_likelihood_gain > b.log_likelihood_gain; });
  return all;
}

std::vector<FrameFinding> FrameExaminer::unexplained() const {
  if (FrameFinding f = state_->unsteadiness(); !f.poses.empty()) return {std::move(f)};
  std::vector<FrameFinding> all = state_->locate().unexplained;
  // A tone of the radar is at most poses. A beat at only some poses with bursts is a remainder of the bursts.
  const FrameFinding bursts = state_->interference();
  const std::set<std::string> hit(bursts.poses.begin(), bursts.poses.end());
  all.erase(
      std::remove_if(all.begin(), all.end(),
                     [&](const FrameFinding& f) { return 2 * f.poses.size() < hit.size() && standsWithin(f, hit); }),
      all.end());
  FrameFinding gain = state_->frameGain();
  const bool gained = gain.log_likelihood_gain > 0;
  std::vector<PoseLaws> laws;
  for (std::size_t i = 0; i < state_->judged.size(); ++i) {
    laws.push_back({&state_->motion[i].pose, &state_->judged[i].laws});
  }
  if (gained) all.push_back(std::move(gain));
  for (FrameFinding& law : lawFindings(laws, gained)) all.push_back(std::move(law));
  return all;
}

}  // namespace mmradartwin::diagnosis::frames
