#include "law_screen.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "echo_field.h"
#include "empirical_hypothesis.h"
#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin {
namespace {

constexpr double kDominant = 0.5;       ///< share of what a cell is expected to hold that a measured path has at least
constexpr double kAlone = 0.7;          ///< the same of all that the channels hold, where these are compared
constexpr double kLeastPower = 1e-5;    ///< of the pose's strongest path's
constexpr double kFarthest_bins = 2.2;  ///< from where it is expected that a path is looked for
constexpr double kHuber = 2;            ///< standard deviations from which on a path counts less
constexpr int kReweighings = 3;
constexpr int kFine = 48;              ///< nodes of the finest table
constexpr double kPricePerNumber = 4;  ///< nats, by which fewer numbers are preferred
constexpr double kShortest = 3.5;      ///< fine steps in a ripple's period
constexpr double kMostPeriods = 10;
constexpr double kSettling[] = {0.05, 0.1, 0.2, 0.4};  ///< of the variable's span, in which an exponential falls by e
constexpr int kSectorStep = 2;                         ///< fine steps between edges that are tried,
constexpr double kFewestPlaces = 3;                    ///< that tell of a sector or a bump
constexpr int kNarrowestBump = 8;                      ///< and between a bump's ends
constexpr double kPlanGrid_m = 0.3, kPlanFineGrid_m = 0.1;
constexpr double kPlanRadii_m[] = {0.4, 0.8, 1.4};
constexpr int kBearings = 24;         ///< that half a turn is divided into
constexpr int kOften = 12;            ///< paths of an actor
constexpr double kLeastShare = 0.02;  ///< of the paths that lie beyond a table's first and last node
constexpr double kMaxInflation = 50;
constexpr double kWeakest_db = -45;  ///< echoes below this are one for a law over amplitudes

struct Observable {
  const char* parameter;
  const char* unit;
  double typical, limit;
  double usual;   ///< standard deviation that a law's values are given beforehand
  double floor;   ///< least scatter of a path that is believed
  bool constant;  ///< a constant of it is fitted along: the session's gain is free already
};
constexpr Observable kOfPaths[] = {{"gain_db", "dB", 2.0, 60, 10, 0.5, false},
                                   {"delay_m", "m", 0.02, 1, 0.2, 0.003, true},
                                   {"angle_deg", "deg", 1.0, 45, 10, 0.2, true},
                                   {"angle_deg", "deg", 1.0, 45, 10, 0.1, true}};
// Of some channels against the others.
constexpr Observable kOfChannels[] = {{"gain_db", "dB", 2.0, 60, 10, 0.2, true},
                                      {"phase_deg", "deg", 10, 360, 60, 1, true}};
enum Kind { kGain, kDelay, kAngle, kAngleOfPose, kFirstOfChannels };
const std::string kPoseVariables[] = {"time_s", "heading_deg", "height_m"};  ///< alike for all paths of a pose
const std::string kOfPlaces[] = {"passing_m", "distance_m"};
const std::string kChannelVariables[] = {"range_m", "azimuth_deg", "time_s", "amplitude_db"};

/// Channels that an error is likely to have in common: those of one transmitter, but the first one's, or one receiver.
std::vector<std::vector<double>> channelGroups(const RadarConfig& radar) {
  const int receivers = static_cast<int>(radar.rx_position_m.size());
  std::vector<std::vector<double>> groups;
  const auto add = [&](auto belongs) {
    std::vector<double> group;
    for (int k = 0; k < radar.channels(); ++k) {
      if (belongs(k)) group.push_back(k);
    }
    if (static_cast<int>(group.size()) < radar.channels()) groups.push_back(std::move(group));
  };
  for (int t = 1; t * receivers < radar.channels(); ++t) {
    add([=](int k) { return k / receivers == t; });
  }
  for (int r = 0; r < receivers; ++r) {
    add([=](int k) { return k % receivers == r; });
  }
  return groups;
}

/// A path that stands out where it is expected, and how far off it is there.
struct MeasuredPath {
  PathRecord record;        ///< as received
  double share = 1;         ///< of the cell's expected power: so much of a law on the path shows
  bool alone = false;       ///< its channels hold little else
  std::vector<double> off;  ///< [kinds]
};
struct MeasuredPose {
  int location = 0;
  LawVariable::Where where;
  std::vector<MeasuredPath> paths;
};

/// One observable of all paths, in units of its scatter, robustly weighted.
struct Sample {
  Eigen::VectorXd off, weight;  // [P], 0 where a path does not show it
  Eigen::MatrixXd latent;       // [P][G] a constant and the actors' errors
  Eigen::LDLT<Eigen::MatrixXd> latent_solver;
  Eigen::VectorXd latent_prior;  // [G] precision
};

struct Promise {
  double raw = 0;         ///< nats by which the law explains the paths
  double inflation = 1;   ///< of the scores' scatter over places
  Eigen::VectorXd value;  ///< of the directions, in the observable's unit
  double constant = 0;    ///< beside them
};

class LawScreen {
 public:
  LawScreen(const Twin& base, const SessionModel& model, const ModelState& null, const std::vector<int>& poses);
  /// What a law is over, and whose paths.
  struct Over {
    std::string variable, actor = "";  ///< all paths where no actor is given
    double bearing_deg = 0;            ///< of standing_m
  };
  std::optional<Screened> best(int kind, const Over& over) const;
  int kinds() const { return static_cast<int>(kinds_.size()); }
  /// Over where the radar stands, along the direction that promises most.
  std::optional<Screened> bestBearing() const;
  /// Over how near to a place paths pass, or the radar stands: the place that promises most.
  std::optional<Screened> bestPlace(const std::string& variable) const;
  /// Actors of whom enough paths are measured for a law of their own.
  std::vector<std::string> oftenSeen() const;

 private:
  MeasuredPose measured(const Twin& twin, int pose, double session_s) const;
  void prepare(int kind);
  /// Of directions [P][K], beyond what a constant and the actors' own errors explain.
  Promise promise(int kind, const Eigen::MatrixXd& directions) const;
  Hypothesis law(int kind, const Over& over, const std::vector<double>& at) const;

  const Twin& base_;
  const SessionModel& model_;
  const ModelState& null_;
  std::vector<MeasuredPose> poses_;
  std::vector<int> location_;  // [P]
  struct KindOfLaw {
    Observable observable;
    std::vector<double> channels;  // all where none are given
  };
  std::vector<KindOfLaw> kinds_;
  std::vector<double> scatter_;  // [kinds]
  std::vector<Sample> samples_;  // [kinds]
  double whole_ = 1;             // poses of the session over those measured
};

LawScreen::LawScreen(const Twin& base, const SessionModel& model, const ModelState& null, const std::vector<int>& poses)
    : base_(base), model_(model), null_(null) {
  for (const Observable& o : kOfPaths) kinds_.push_back({o, {}});
  for (const std::vector<double>& group : channelGroups(base.radar())) {
    for (const Observable& o : kOfChannels) kinds_.push_back({o, group});
  }
  scatter_.assign(kinds_.size(), 1.0);
  samples_.resize(kinds_.size());
  const Twin twin = base.changed(null.mechanisms);
  std::int64_t first_ns = model.data().poses.front().pose.stamp_ns;
  for (const PoseChannels& p : model.data().poses) first_ns = std::min(first_ns, p.pose.stamp_ns);
  std::vector<std::optional<MeasuredPose>> each(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) {
    const std::int64_t stamp_ns = model.data().poses[static_cast<std::size_t>(poses[j])].pose.stamp_ns;
    each[j].emplace(measured(twin, poses[j], 1e-9 * static_cast<double>(stamp_ns - first_ns)));
  });
  double strongest_amplitude = 0;
  for (std::optional<MeasuredPose>& p : each) {
    strongest_amplitude = std::max(strongest_amplitude, p->where.strongest_amplitude);
    location_.insert(location_.end(), p->paths.size(), p->location);
    poses_.push_back(std::move(*p));
  }
  for (MeasuredPose& p : poses_) p.where.strongest_amplitude = strongest_amplitude;
  whole_ = static_cast<double>(null.echoes.size()) / static_cast<double>(poses.size());
  for (int kind = 0; kind < kinds(); ++kind) prepare(kind);
}

MeasuredPose LawScreen::measured(const Twin& twin, int pose, double session_s) const {
  const PoseChannels& data = model_.data().poses[static_cast<std::size_t>(pose)];
  const RadarConfig& radar = base_.radar();
  const Eigen::Isometry3d& T = data.pose.T_map_radar;
  std::vector<PathRecord> records = twin.receivedPaths(T, twin.trace(T, data.pose.stamp_ns), data.pose.stamp_ns);
  double most = 0;
  for (const PathRecord& r : records) most = std::max(most, r.amplitude);
  MeasuredPose result{data.location, {base_.scene(), T, session_s, most}, {}};
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const double gain = std::exp(null_.nuisance.log_gain), wave = 2 * M_PI / radar.wavelength_m();
  std::map<int, Eigen::MatrixXcd> expected;  // by bin
  for (PathRecord& r : records) {
    if (r.bounces == 0 || r.amplitude * r.amplitude < kLeastPower * most * most) continue;
    const double place = 0.5 * meanLength_m(r) / radar.range_bin_m();
    const int bin = static_cast<int>(std::lround(place));
    if (bin < model_.firstBin() || bin >= samples) continue;
    const Eigen::VectorXcd a = Eigen::Map<const Eigen::VectorXcd>(r.c.data(), channels).normalized();
    Eigen::MatrixXcd& sigma = expected[bin];
    if (sigma.size() == 0) {
      sigma =
          model_.whitened(null_.echoes[static_cast<std::size_t>(pose)], null_.nuisance, pose, bin).inverse.inverse();
    }
    double latent = 0;  // what the state has as this path's own: it is fitted anew beside the law
    for (int actor : r.actors) latent += null_.nuisance.actor_gain[errorOf(actor, null_.nuisance.actor_gain.size())];
    const double response = hannResponse(bin - place), all = a.dot(sigma * a).real();
    const double own = gain * std::exp(latent) * channels * r.amplitude * r.amplitude * response * response;
    MeasuredPath path;
    path.share = std::min(1.0, own / all);
    if (path.share < kDominant) continue;
    path.alone = own >= kAlone * sigma.trace().real();
    path.off.assign(kinds_.size(), 0.0);
    path.off[kGain] = 10 / std::log(10.0) * (std::log(std::norm(a.dot(data.y.col(bin))) / all) + path.share * latent);
    // Where it peaks: of a Hann window's two highest bins the ratio tells.
    const auto height = [&](int k) { return k < 0 || k >= samples ? 0.0 : std::abs(a.dot(data.y.col(k))); };
    int peak = bin;
    for (int k = bin - 2; k <= bin + 2; ++k) peak = height(k) > height(peak) ? k : peak;
    const int side = height(peak + 1) > height(peak - 1) ? 1 : -1;
    const double ratio = height(peak + side) / std::max(1e-30, height(peak));
    const double apart = peak + side * std::clamp((2 * ratio - 1) / (1 + ratio), -0.5, 0.5) - place;
    if (std::abs(apart) > kFarthest_bins) continue;
    path.off[kDelay] = apart * radar.range_bin_m();
    // And whence: phases between neighbours, turned back by what is expected.
    double turn = 0, information = 0;
    for (int k = 0; k + 1 < channels; ++k) {
      const double span = wave * (radar.virtual_element_m(k + 1).y() - radar.virtual_element_m(k).y());
      const std::complex<double> step = data.y(k + 1, peak) * std::conj(a[k + 1]) * std::conj(data.y(k, peak)) * a[k];
      turn -= span * std::abs(step) * std::arg(step);
      information += span * span * std::abs(step);
    }
    const double cosine = std::max(0.2, std::hypot(r.departure.x(), r.departure.z()));
    path.off[kAngleOfPose] = -null_.nuisance.yaw_rad[static_cast<std::size_t>(pose)] * 180 / M_PI;
    path.off[kAngle] = information > 0 ? turn / information / cosine * 180 / M_PI : 0;
    for (int kind = kFirstOfChannels; kind < kinds(); kind += 2) {
      const std::vector<double>& of = kinds_[static_cast<std::size_t>(kind)].channels;
      std::complex<double> those = 0, others = 0;
      for (int k = 0; k < channels; ++k) {
        (std::count(of.begin(), of.end(), k) > 0 ? those : others) += data.y(k, peak) * std::conj(a[k]);
      }
      const double share_of = static_cast<double>(of.size()) / (channels - static_cast<double>(of.size()));
      const std::complex<double> ratio = those * std::conj(others) / (share_of * std::norm(others) + 1e-300);
      path.off[static_cast<std::size_t>(kind)] = 20 * std::log10(std::abs(ratio) + 1e-300);
      path.off[static_cast<std::size_t>(kind) + 1] = std::arg(ratio) * 180 / M_PI;
    }
    path.record = std::move(r);
    result.paths.push_back(std::move(path));
  }
  return result;
}

void LawScreen::prepare(int kind) {
  const Observable& o = kinds_[static_cast<std::size_t>(kind)].observable;
  const Eigen::Index count = static_cast<Eigen::Index>(location_.size());
  const Eigen::Index actors = static_cast<Eigen::Index>(base_.scene().actors.size());
  Sample& s = samples_[static_cast<std::size_t>(kind)];
  s.off.resize(count);
  Eigen::VectorXd shows(count);
  s.latent = Eigen::MatrixXd::Zero(count, 1 + actors);
  Eigen::Index at = 0;
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      const double share = kind == kGain ? p.share : 1;
      s.off[at] = p.off[static_cast<std::size_t>(kind)];
      // What a pose's likelihood has found of its heading is one number, however many paths it has.
      shows[at] = kind == kAngleOfPose ? 1 / static_cast<double>(pose.paths.size()) : kind < kAngle || p.alone ? 1 : 0;
      s.latent(at, 0) = share;
      for (int a : p.record.actors) {
        if (a >= 0 && kind < kAngle) s.latent(at, 1 + a) += share;
      }
      ++at;
    }
  }
  const double own = kind == kGain ? 10 / std::log(10.0) * model_.spread().actor_gain : model_.spread().actor_range_m;
  s.weight = shows;
  if (shows.sum() == 0) return;
  const auto median = [&](const Eigen::VectorXd& of) {
    std::vector<double> v;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (shows[i] > 0) v.push_back(of[i]);
    }
    const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
    std::nth_element(v.begin(), middle, v.end());
    return *middle;
  };
  double scatter = std::max(o.floor, 1.4826 * median((s.off.array() - median(s.off)).abs().matrix()));
  Eigen::MatrixXd information;
  for (int i = 0; i < kReweighings; ++i) {
    s.latent_prior = Eigen::VectorXd::Constant(1 + actors, scatter * scatter / (own * own));
    s.latent_prior[0] = 1e-9;
    information = s.latent.transpose() * s.weight.asDiagonal() * s.latent;
    information.diagonal() += s.latent_prior;
    s.latent_solver.compute(information);
    const Eigen::VectorXd rest =
        s.off - s.latent * s.latent_solver.solve(s.latent.transpose() * s.weight.cwiseProduct(s.off));
    scatter = std::max(o.floor, 1.4826 * median(rest.cwiseAbs()));
    s.weight = shows.cwiseProduct((kHuber * scatter / rest.array().abs().max(1e-12)).min(1.0).matrix());
  }
  information = s.latent.transpose() * s.weight.asDiagonal() * s.latent;
  information.diagonal() += s.latent_prior;
  s.latent_solver.compute(information);
  scatter_[static_cast<std::size_t>(kind)] = scatter;
}

Promise LawScreen::promise(int kind, const Eigen::MatrixXd& directions) const {
  const Sample& s = samples_[static_cast<std::size_t>(kind)];
  const double scatter = scatter_[static_cast<std::size_t>(kind)];
  const double usual = kinds_[static_cast<std::size_t>(kind)].observable.usual;
  const Eigen::Index n = directions.cols();
  // Latents eliminated: what of a direction they cannot follow.
  const Eigen::MatrixXd weighted = s.weight.asDiagonal() * directions;
  const Eigen::MatrixXd follow = s.latent_solver.solve(s.latent.transpose() * weighted);  // [G][K]
  Eigen::MatrixXd information = directions.transpose() * weighted - (weighted.transpose() * s.latent) * follow;
  information.diagonal().array() += std::pow(scatter / usual, 2);
  const Eigen::VectorXd latents = s.latent_solver.solve(s.latent.transpose() * s.weight.cwiseProduct(s.off));
  const Eigen::VectorXd before = s.off - s.latent * latents;
  const Eigen::VectorXd total = weighted.transpose() * before;
  const Eigen::LDLT<Eigen::MatrixXd> solver(information);
  Promise p;
  p.value = solver.solve(total);
  const Eigen::VectorXd latents_after = latents - follow * p.value;
  const Eigen::VectorXd after = s.off - s.latent * latents_after - directions * p.value;
  p.constant = latents_after[0];
  const auto squares = [&](const Eigen::VectorXd& rest, const Eigen::VectorXd& latent) {
    return rest.dot(s.weight.cwiseProduct(rest)) + latent.cwiseProduct(s.latent_prior).dot(latent);
  };
  // The scatter is as free as the law: its likelihood's maximum.
  const double left = squares(after, latents_after) + std::pow(scatter / usual, 2) * p.value.squaredNorm();
  p.raw = whole_ * 0.5 * s.weight.sum() * std::log(std::max(1.0, squares(before, latents) / left));
  const double locations = static_cast<double>(model_.data().locations.size());
  if (locations > 1) {
    const Eigen::MatrixXd seen = directions - s.latent * follow;
    Eigen::MatrixXd by_location = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(model_.data().locations.size()), n);
    for (Eigen::Index i = 0; i < after.size(); ++i) {
      by_location.row(location_[static_cast<std::size_t>(i)]) += s.weight[i] * after[i] * seen.row(i);
    }
    const double own = left / std::max(1.0, s.weight.sum());
    const Eigen::MatrixXd spread = by_location.transpose() * by_location * (locations / (locations - 1) / own);
    p.inflation = std::clamp(solver.solve(spread).trace() / static_cast<double>(n), 1.0, kMaxInflation);
  }
  return p;
}

Hypothesis LawScreen::law(int kind, const Over& over, const std::vector<double>& at) const {
  const auto& [o, channels] = kinds_[static_cast<std::size_t>(kind)];
  Hypothesis h;
  h.mechanism = defaultMechanism("empirical_law");
  h.mechanism.values.set("variable", over.variable);
  h.mechanism.values.set("at", at);
  h.mechanism.values.set(o.parameter, std::vector<double>(at.size(), 0.0));
  h.mechanism.values.set("actor", over.actor);
  h.mechanism.values.set("bearing_deg", over.bearing_deg);
  h.mechanism.values.set("channels", channels);
  h.subject = std::string(o.parameter) + " over " + over.variable + (over.actor.empty() ? "" : " of " + over.actor) +
              channelsInWords(h.mechanism);
  return h;
}

/// Weights of a table's nodes at x; beyond its ends the first or last alone.
void addHat(const std::vector<double>& at, double x, double weight, Eigen::Ref<Eigen::RowVectorXd> row) {
  const Eigen::Index last = static_cast<Eigen::Index>(at.size()) - 1;
  if (x <= at.front() || last == 0) {
    row[0] += weight;
  } else if (x >= at.back()) {
    row[last] += weight;
  } else {
    const Eigen::Index i = std::upper_bound(at.begin(), at.end(), x) - at.begin();
    const double low = at[static_cast<std::size_t>(i - 1)], high = at[static_cast<std::size_t>(i)];
    const double share = (x - low) / (high - low);
    row[i - 1] += weight * (1 - share);
    row[i] += weight * share;
  }
}

/// [fine][nodes]: the coarser table's hats at the finer one's nodes.
Eigen::MatrixXd hats(const std::vector<double>& fine, const std::vector<double>& nodes) {
  Eigen::MatrixXd m =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fine.size()), static_cast<Eigen::Index>(nodes.size()));
  for (std::size_t i = 0; i < fine.size(); ++i) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(m.cols());
    addHat(nodes, fine[i], 1, row);
    m.row(static_cast<Eigen::Index>(i)) = row;
  }
  return m;
}

/// Nodes that the sorted numbers lie evenly between.
std::vector<double> evenNodes(const std::vector<double>& sorted, int count) {
  std::vector<double> nodes;
  for (int k = 0; k < count; ++k) {
    const double share = std::clamp(static_cast<double>(k) / (count - 1), kLeastShare, 1 - kLeastShare);
    const double x = sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
    if (nodes.empty() || x > nodes.back() + 1e-6) nodes.push_back(x);
  }
  return nodes;
}

std::optional<Screened> LawScreen::best(int kind, const Over& over) const {
  const std::string& variable = over.variable;
  const int actor = base_.scene().actorIndex(over.actor);
  const LawVariable of(variable, {0, 0, over.bearing_deg, actor});
  const Observable& o = kinds_[static_cast<std::size_t>(kind)].observable;
  std::vector<LawVariable::Values> values;
  std::vector<double> all;
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      LawVariable::Values v = of.of(pose.where, p.record);
      if (actor >= 0 && std::count(p.record.actors.begin(), p.record.actors.end(), actor) == 0) v.count = 0;
      for (int i = 0; i < v.count; ++i) {
        double& x = v.of[static_cast<std::size_t>(i)];
        if (variable == "amplitude_db") x = std::max(x, kWeakest_db);
        all.push_back(x);
      }
      values.push_back(v);
    }
  }
  const Sample& s = samples_[static_cast<std::size_t>(kind)];
  if (all.empty() || s.weight.sum() == 0) return std::nullopt;
  std::sort(all.begin(), all.end());
  double low = all.front(), high = all.back();
  if (!(high - low > 1e-3 * std::max(1.0, std::abs(high)))) return std::nullopt;
  const bool turns = variable == "heading_deg" || variable == "bearing_deg";
  if (turns) {
    low = -180;
    high = 180;
  }
  std::vector<double> fine;
  for (int i = 0; i < kFine; ++i) fine.push_back(low + (high - low) * i / (kFine - 1));
  Eigen::MatrixXd basis = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(values.size()), kFine);
  for (std::size_t p = 0; p < values.size(); ++p) {
    Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(kFine);
    for (int i = 0; i < values[p].count; ++i) {
      addHat(fine, values[p].of[static_cast<std::size_t>(i)], 1.0 / values[p].count, row);
    }
    basis.row(static_cast<Eigen::Index>(p)) = s.latent(static_cast<Eigen::Index>(p), 0) * row;
  }

  double best = 0;
  Screened result;
  const auto offer = [&](const Eigen::MatrixXd& combined, int numbers, int searched, auto make) {
    const Promise p = promise(kind, basis * combined);
    const double worth = p.raw / p.inflation - kPricePerNumber * (numbers + searched);
    if (worth <= best) return;
    best = worth;
    result.hypothesis = make();
    result.hypothesis.searched = searched + 1;  // and the variable
    result.promised = p.raw / p.inflation - 0.5 * (numbers + searched);
    result.starts = {{}};
    for (std::size_t k = 0; k < result.hypothesis.coordinates.size(); ++k) {
      // Of a curve all values have the constant, of another shape the first one is it.
      const bool has_constant = o.constant && (k == 0 || result.hypothesis.variant.empty());
      const double value = p.value[static_cast<Eigen::Index>(k)] + (has_constant ? p.constant : 0);
      result.starts.front().push_back(std::clamp(value / o.typical, -8.0, 8.0));
    }
  };
  // Curves of a few nodes.
  for (int count = 2; count <= 8; ++count) {
    std::vector<double> nodes = evenNodes(all, count);
    if (turns) {
      nodes.clear();
      for (int k = 0; k <= count; ++k) nodes.push_back(-180 + 360.0 * k / count);
    }
    if (static_cast<int>(nodes.size()) < std::max(2, count)) continue;
    Eigen::MatrixXd combined = hats(fine, nodes);
    if (turns) {  // both ends are one direction
      combined.col(0) += combined.col(combined.cols() - 1);
      combined = combined.leftCols(combined.cols() - 1).eval();
    }
    if (!o.constant) combined = combined.rightCols(combined.cols() - 1).eval();  // the session's gain is free already
    const int numbers = static_cast<int>(combined.cols());
    offer(combined, numbers - (o.constant ? 1 : 0), 0, [&] {
      Hypothesis h = law(kind, over, nodes);
      for (int k = o.constant ? 0 : 1; k < static_cast<int>(nodes.size()) - (turns ? 1 : 0); ++k) {
        Coordinate c{o.parameter, o.unit, k, 0, o.typical, -o.limit, o.limit};
        if (turns) {
          c.element = -1;
          c.shape.assign(nodes.size(), 0.0);
          c.shape[static_cast<std::size_t>(k)] = 1;
          if (k == 0) c.shape.back() = 1;
        }
        h.coordinates.push_back(std::move(c));
      }
      return h;
    });
  }
  const auto shaped = [&](const std::vector<double>& at, const std::vector<std::vector<double>>& shapes,
                          const std::string& expression) {
    Hypothesis h = law(kind, over, at);
    h.variant = expression;
    for (const std::vector<double>& shape : shapes) {
      Coordinate c{o.parameter, o.unit, -1, 0, o.typical, -o.limit, o.limit};
      c.shape = shape;
      h.coordinates.push_back(std::move(c));
    }
    return h;
  };
  if (kind >= kFirstOfChannels) return best > 0 ? std::optional<Screened>(result) : std::nullopt;
  const std::vector<double> ones(kFine, 1.0);
  const auto columns = [&](const std::vector<std::vector<double>>& shapes) {
    Eigen::MatrixXd m(kFine, static_cast<Eigen::Index>(shapes.size()));
    for (std::size_t k = 0; k < shapes.size(); ++k) {
      m.col(static_cast<Eigen::Index>(k)) = Eigen::Map<const Eigen::VectorXd>(shapes[k].data(), kFine);
    }
    return m;
  };
  // Ripples: over an azimuth in its sine, too, as interference at an aperture goes.
  const auto ripples = [&](bool in_sine) {
    const auto place = [&](double x) { return in_sine ? std::sin(x * M_PI / 180) : x; };
    const double span = place(high) - place(low);
    const double shortest =
        std::max(kShortest * (high - low) / (kFine - 1) * (in_sine ? M_PI / 180 : 1), span / kMostPeriods);
    for (double periods = 1; span / periods > shortest; periods += 0.25) {
      std::vector<std::vector<double>> shapes;
      if (o.constant) shapes.push_back(ones);
      for (int quarter : {0, 1}) {
        std::vector<double> shape;
        for (double x : fine) shape.push_back(std::cos(2 * M_PI * place(x) * periods / span - 0.5 * M_PI * quarter));
        shapes.push_back(std::move(shape));
      }
      offer(columns(shapes), 2, 1, [&] {
        std::ostringstream expression;
        expression << std::setprecision(3) << "a ripple of period " << span / periods;
        if (in_sine) expression << " of the sine";
        return shaped(fine, shapes, expression.str());
      });
    }
  };
  if (!turns) ripples(false);
  if (variable == "azimuth_deg") ripples(true);
  // What settles, or grows, exponentially.
  for (double share : kSettling) {
    for (bool grows : {false, true}) {
      if (turns) break;
      std::vector<double> shape;
      for (int i = 0; i < kFine; ++i) {
        shape.push_back(std::exp(-(grows ? kFine - 1 - i : i) / (share * (kFine - 1))));
      }
      std::vector<std::vector<double>> shapes;
      if (o.constant) shapes.push_back(ones);
      shapes.push_back(std::move(shape));
      offer(columns(shapes), 1, 1, [&] {
        std::ostringstream expression;
        expression << std::setprecision(3) << "an exponential that " << (grows ? "grows" : "falls") << " by e in "
                   << share * (high - low);
        return shaped(fine, shapes, expression.str());
      });
    }
  }
  // How many places tell of a shape, each by its paths' share in it.
  const auto places = [&](const std::vector<double>& shape) {
    const Eigen::VectorXd direction = basis * Eigen::Map<const Eigen::VectorXd>(shape.data(), kFine);
    Eigen::VectorXd by_location = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model_.data().locations.size()));
    for (Eigen::Index i = 0; i < direction.size(); ++i) {
      by_location[location_[static_cast<std::size_t>(i)]] += s.weight[i] * direction[i] * direction[i];
    }
    return std::pow(by_location.sum(), 2) / std::max(1e-300, by_location.squaredNorm());
  };
  // Sectors, steps among them, and bumps.
  const auto between = [&](int from, int to, bool bump) {
    std::vector<double> shape(kFine, 0.0);
    for (int i = from; i < to; ++i) {
      shape[static_cast<std::size_t>(i)] = bump ? 0.5 - 0.5 * std::cos(2 * M_PI * (i - from + 1) / (to - from + 1)) : 1;
    }
    if (places(shape) < kFewestPlaces) return;
    std::vector<std::vector<double>> shapes;
    if (o.constant) shapes.push_back(ones);
    shapes.push_back(std::move(shape));
    offer(columns(shapes), 1, from == 0 || to >= kFine ? 1 : 2, [&] {
      std::ostringstream expression;
      expression << std::setprecision(3) << (bump ? "a bump from " : "one value from ")
                 << fine[static_cast<std::size_t>(from)] << " to " << fine[static_cast<std::size_t>(to - 1)];
      return shaped(fine, shapes, expression.str());
    });
  };
  for (int from = 0; from < kFine; from += kSectorStep) {
    for (int to = from + kSectorStep; to <= kFine; to += kSectorStep) {
      if (from > 0 || to < kFine) between(from, to, false);
      if (to - from >= kNarrowestBump) between(from, to, true);
    }
  }
  if (!(best > 0)) return std::nullopt;
  return result;
}

std::vector<std::string> LawScreen::oftenSeen() const {
  std::vector<int> paths(base_.scene().actors.size(), 0);
  for (const MeasuredPose& pose : poses_) {
    for (const MeasuredPath& p : pose.paths) {
      for (int a : std::set<int>(p.record.actors.begin(), p.record.actors.end())) {
        if (a >= 0) ++paths[static_cast<std::size_t>(a)];
      }
    }
  }
  std::vector<std::string> names;
  for (std::size_t a = 0; a < paths.size(); ++a) {
    if (paths[a] >= kOften) names.push_back(base_.scene().actors[a].name);
  }
  return names;
}

std::optional<Screened> LawScreen::bestBearing() const {
  std::optional<Screened> best_of_all;
  for (int i = 0; i < kBearings; ++i) {
    std::optional<Screened> s = best(kGain, {"standing_m", "", 180.0 * i / kBearings});
    if (s && (!best_of_all || s->promised > best_of_all->promised)) best_of_all = std::move(s);
  }
  if (best_of_all) {
    ++best_of_all->hypothesis.searched;
    best_of_all->promised -= 0.5;
  }
  return best_of_all;
}

std::optional<Screened> LawScreen::bestPlace(const std::string& variable) const {
  if (location_.empty()) return std::nullopt;
  Eigen::AlignedBox3d bounds;
  for (const Actor& a : base_.scene().actors) bounds.extend(a.bounds);
  const Observable& o = kOfPaths[kGain];
  struct Spot {
    double x_m = 0, y_m = 0, radius_m = 0;
    Promise promise;
  };
  const auto spotAt = [&](double x_m, double y_m, double radius_m) {
    const LawVariable passing(variable, {x_m, y_m});
    Eigen::MatrixXd direction(static_cast<Eigen::Index>(location_.size()), 1);
    Eigen::Index at = 0;
    for (const MeasuredPose& pose : poses_) {
      for (const MeasuredPath& p : pose.paths) {
        const LawVariable::Values v = passing.of(pose.where, p.record);
        direction(at++, 0) = v.count > 0 ? p.share * std::max(0.0, 1 - v.of[0] / radius_m) : 0;
      }
    }
    return Spot{x_m, y_m, radius_m, promise(kGain, direction)};
  };
  std::vector<Spot> spots;
  for (double x = bounds.min().x() + 0.5 * kPlanGrid_m; x < bounds.max().x(); x += kPlanGrid_m) {
    for (double y = bounds.min().y() + 0.5 * kPlanGrid_m; y < bounds.max().y(); y += kPlanGrid_m) {
      for (double radius : kPlanRadii_m) spots.push_back({x, y, radius, {}});
      if (spots.size() > 10000) return std::nullopt;  // no room: a hall's cells are too many to tell apart
    }
  }
  const auto better = [](const Spot& a, const Spot& b) {
    return a.promise.raw / a.promise.inflation < b.promise.raw / b.promise.inflation;
  };
  const auto bestOf = [&](std::vector<Spot>& all) {
    tbb::parallel_for(std::size_t{0}, all.size(),
                      [&](std::size_t i) { all[i] = spotAt(all[i].x_m, all[i].y_m, all[i].radius_m); });
    return *std::max_element(all.begin(), all.end(), better);
  };
  if (spots.empty()) return std::nullopt;
  const Spot coarse = bestOf(spots);
  std::vector<Spot> near;
  for (int i = -2; i <= 2; ++i) {
    for (int j = -2; j <= 2; ++j) {
      for (double factor : {0.75, 1.0, 1.35}) {
        near.push_back(
            {coarse.x_m + i * kPlanFineGrid_m, coarse.y_m + j * kPlanFineGrid_m, coarse.radius_m * factor, {}});
      }
    }
  }
  const Spot best = bestOf(near);
  const double nats = best.promise.raw / best.promise.inflation;
  if (!(nats > kPricePerNumber * 4)) return std::nullopt;
  Screened result;
  result.hypothesis = law(kGain, {variable}, {0, best.radius_m});
  result.hypothesis.mechanism.values.set("x_m", best.x_m);
  result.hypothesis.mechanism.values.set("y_m", best.y_m);
  result.hypothesis.coordinates = {{o.parameter, o.unit, 0, 0, o.typical, -o.limit, o.limit}};
  result.hypothesis.searched = 4;  // place, radius and the variable
  result.promised = nats - 0.5 * 4;
  result.starts = {{std::clamp(best.promise.value[0] / o.typical, -8.0, 8.0)}};
  return result;
}

}  // namespace

std::vector<Screened> screenLaws(const Twin& base, const SessionModel& model, const ModelState& null,
                                 const std::vector<int>& poses) {
  std::vector<Screened> result;
  for (const NamedParameters& m : null.mechanisms) {
    if (m.mechanism == "empirical_law") return result;  // what it leaves is of its own shape
  }
  if (poses.empty()) return result;
  const LawScreen screen(base, model, null, poses);
  for (int kind = 0; kind < kFirstOfChannels; ++kind) {
    for (const std::string& variable : LawVariable::names()) {
      const bool of_pose = std::count(std::begin(kPoseVariables), std::end(kPoseVariables), variable) > 0;
      if ((kind == kAngle && of_pose) || (kind == kAngleOfPose && !of_pose)) continue;
      if (variable == "standing_m" || std::count(std::begin(kOfPlaces), std::end(kOfPlaces), variable) > 0) continue;
      if (auto s = screen.best(kind, {variable})) result.push_back(std::move(*s));
    }
  }
  // An error of directions looks like one of each channel: the best stands for all.
  for (const std::string& variable : kChannelVariables) {
    std::optional<Screened> best;
    for (int kind = kFirstOfChannels; kind < screen.kinds(); ++kind) {
      std::optional<Screened> s = screen.best(kind, {variable});
      if (s && (!best || s->promised > best->promised)) best = std::move(s);
    }
    if (best) result.push_back(std::move(*best));
  }
  for (const std::string& actor : screen.oftenSeen()) {
    for (const char* variable : {"foot_m", "time_s"}) {
      if (auto s = screen.best(kGain, {variable, actor})) result.push_back(std::move(*s));
    }
  }
  if (auto s = screen.bestBearing()) result.push_back(std::move(*s));
  for (const std::string& variable : kOfPlaces) {
    if (auto s = screen.bestPlace(variable)) result.push_back(std::move(*s));
  }
  std::stable_sort(result.begin(), result.end(),
                   [](const Screened& a, const Screened& b) { return a.promised > b.promised; });
  return result;
}

}  // namespace mmradartwin
