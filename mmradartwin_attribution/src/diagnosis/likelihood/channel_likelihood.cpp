#include "diagnosis/likelihood/channel_likelihood.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace mmradartwin::diagnosis::likelihood {
namespace {

/// Share of a beam's power that keeps its covariance positive definite in single precision: neighbouring bins of a Hann
/// window are almost equal.
constexpr double kBeamShare = 3e-6;

/// Relative change of a cell's covariance below which a group of echoes has no slope in the cell, and the range error
/// for which the change is evaluated.
constexpr double kNegligibleShare = 3e-4, kMoved_m = 0.03;

/// Phases 2 pi y_k / lambda of the virtual elements.
std::vector<double> elementPhases(const RadarConfig& radar) {
  std::vector<double> phases;
  for (int k = 0; k < radar.channels(); ++k) {
    phases.push_back(2 * M_PI / radar.wavelength_m() * radar.virtual_element_m(k).y());
  }
  return phases;
}

double groupGain(const EchoGroup& group, const SessionLatents& latents) {
  double sum = 0;
  for (int a : group.actors) sum += latents.actor_gain[errorOf(a, latents.actor_gain.size())];
  return std::exp(sum);
}

/// One-way range that a group's actors add beyond the range of its fields.
double groupShift_m(const EchoGroup& group, const SessionLatents& latents) {
  double sum = -group.added_range_m;
  for (int a : group.actors) sum += latents.actor_range_m[errorOf(a, latents.actor_range_m.size())];
  return sum;
}

}  // namespace

ChannelLikelihood::ChannelLikelihood(const ChannelData& data, int actors, const PoseAccuracy& accuracy,
                                     const LatentSpread& spread)
    : data_(data),
      errors_(actors + 1),
      accuracy_(accuracy),
      spread_(spread),
      channels_(data.radar.channels()),
      samples_(data.radar.samples_per_chirp),
      size_(static_cast<std::size_t>(channels_) * (channels_ + 1) / 2),
      apart_(elementPhases(data.radar)) {}

void ChannelLikelihood::addClutter(const SessionLatents& latents, int pose, int cell, double factor,
                                   PackedHermitian& to) const {
  const PoseChannels& channels = data_.poses[pose];
  const int bin = binOf(pose, cell);
  const double level = factor * clutterLevel(latents, bin);
  if (isBeam(cell)) {
    addApart(cell, level * channels.beams[static_cast<std::size_t>(cell - samples_)].clutter, to);
  } else {
    to.add(channels.clutter.at(bin, size_), level);
  }
}

double ChannelLikelihood::clutterLevel(const SessionLatents& latents, int bin) const {
  const auto [at, share] = shapeAt(bin);
  const auto* shape = &latents.floor_shape[static_cast<std::size_t>(at)];
  return std::exp(latents.log_floor + (1 - share) * shape[0] + share * shape[1]);
}

std::pair<int, double> ChannelLikelihood::shapeAt(int bin) const {
  const double first = firstBin(), octaves = std::log2((samples_ - 1) / first);
  const int nodes = static_cast<int>(SessionLatents().floor_shape.size());
  const int most = std::clamp(static_cast<int>(std::lround(octaves)), 1, nodes - 1);
  const double along = std::log2(std::max<double>(bin, first) / first) / octaves;
  const int at = std::clamp(static_cast<int>(most * along), 0, most - 1);
  return {at, most * along - at};
}

int ChannelLikelihood::binOf(int pose, int cell) const {
  return isBeam(cell) ? middleBin(data_.poses[pose].beams[static_cast<std::size_t>(cell - samples_)], channels_) : cell;
}

double ChannelLikelihood::noiseOf(int pose, int cell) const {
  const PoseChannels& p = data_.poses[pose];
  if (p.unsteadiness.empty()) return p.noise_power;
  if (!isBeam(cell)) return p.noise_power * p.unsteadiness[static_cast<std::size_t>(cell)];
  const auto first = p.unsteadiness.begin() + p.beams[static_cast<std::size_t>(cell - samples_)].first_bin;
  return p.noise_power * *std::max_element(first, first + channels_);
}

const std::complex<double>* ChannelLikelihood::dataOf(int pose, int cell) const {
  if (isBeam(cell)) return data_.poses[pose].beams[static_cast<std::size_t>(cell - samples_)].y.data();
  return data_.poses[pose].range_spectra.col(cell).data();
}

void ChannelLikelihood::addApart(int cell, double power, PackedHermitian& to) const {
  for (int k = 0; k < channels_; ++k) {
    const std::size_t at = static_cast<std::size_t>(PackedHermitian::diagonal(k));
    to.re[at] += power;
    if (!isBeam(cell)) continue;
    // White noise in neighbouring bins is correlated through the Hann window: sum w^2 exp(j 2 pi n/N) / sum w^2.
    if (k > 0) to.re[at - 1] += 2.0 / 3 * power;
    if (k > 1) to.re[at - 2] += 1.0 / 6 * power;
  }
}

void ChannelLikelihood::addRelative(const SessionLatents& latents, int cell, PackedHermitian& to) const {
  const double mean = to.trace() / channels_;
  addApart(cell, std::exp(latents.log_relative) * mean, to);
  if (!isBeam(cell)) return;
  for (int k = 0; k < channels_; ++k) {
    to.re[static_cast<std::size_t>(PackedHermitian::diagonal(k))] += kBeamShare * mean;
  }
}

ChannelLikelihood::PoseModel ChannelLikelihood::modelOf(const PoseEchoes& echoes, const SessionLatents& latents,
                                                        int pose) const {
  PoseModel model{echoes, latents, pose, {}, {}, {}};
  const double gain = std::exp(latents.log_gain);
  const double pose_sensitive = std::exp(latents.log_pose_sensitive);
  for (std::size_t i = 0; i < echoes.all(); ++i) {
    const EchoGroup& group = echoes.at(i);
    model.levels.push_back({gain * groupGain(group, latents) * (echoes.isPoseSensitive(i) ? pose_sensitive : 1),
                            groupShift_m(group, latents)});
  }
  findStrongest(model);
  return model;
}

double ChannelLikelihood::rangeVariance_m2(const SessionLatents& latents) const {
  return accuracy_.path_range_m * accuracy_.path_range_m * std::exp(latents.log_range);
}

PackedHermitian ChannelLikelihood::sigma(const PoseModel& model, int cell) const {
  const SessionLatents& latents = model.latents;
  PackedHermitian covariance(channels_);
  PackedTurn turn;
  const double range_variance = rangeVariance_m2(latents);
  for (std::size_t i = 0; i < model.echoes.all(); ++i) {
    const auto fields = fieldsOf(model.echoes.at(i), cell);
    if (!fields) continue;
    const auto [u, shift] = model.levels[i];
    turn.set(apart_, turnOf(latents.yaw_rad[model.pose], *fields));
    covariance.addTurned({fields->power, fields->shift, fields->curvature},
                         {u, u * shift, u * (shift * shift + range_variance)}, turn);
  }
  // The independent share of channels keeps the matrix definite where the first-order terms alone would not.
  if (covariance.trace() > 0) addRelative(latents, cell, covariance);
  addApart(cell, noiseOf(model.pose, cell), covariance);
  addClutter(latents, model.pose, cell, 1, covariance);
  return covariance;
}

std::optional<EchoGroup::Cell> ChannelLikelihood::fieldsOf(const EchoGroup& group, int cell) const {
  return isBeam(cell) ? group.beams.at(cell - samples_, size_) : group.bins.at(cell, size_);
}

double ChannelLikelihood::prior(const SessionLatents& latents) const {
  double sum = 0;
  for (double v : latents.actor_gain) sum -= 0.5 * v * v / (spread_.actor_gain * spread_.actor_gain);
  for (double v : latents.actor_range_m) sum -= 0.5 * v * v / (spread_.actor_range_m * spread_.actor_range_m);
  for (double v : latents.yaw_rad) sum -= 0.5 * v * v / (accuracy_.heading_rad * accuracy_.heading_rad);
  return sum;
}

double ChannelLikelihood::poseLikelihood(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const {
  double sum = 0;
  InverseFactor factor;
  std::array<std::complex<double>, kMaxChannels> y;
  const PoseModel model = modelOf(echoes, latents, pose);
  for (int cell = firstBin(); cell < cells(pose); ++cell) {
    if (!factor.compute(sigma(model, cell))) return -1e9;
    factor.apply(dataOf(pose, cell), y.data());
    sum += CellLikelihood(factor, y.data(), strongestEcho(model, cell)).logLikelihood();
  }
  return weight() * sum;
}

std::vector<double> ChannelLikelihood::byPose(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                                              const std::vector<int>& poses) const {
  std::vector<double> each(poses.size());
  tbb::parallel_for(std::size_t{0}, each.size(),
                    [&](std::size_t i) { each[i] = poseLikelihood(echoes[i], latents, poses[i]); });
  return each;
}

double ChannelLikelihood::logLikelihood(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                                        std::vector<double>* by_pose) const {
  std::vector<int> all(data_.poses.size());
  std::iota(all.begin(), all.end(), 0);
  std::vector<double> each = byPose(echoes, latents, all);
  const double sum = std::accumulate(each.begin(), each.end(), 0.0);
  if (by_pose != nullptr) *by_pose = std::move(each);
  return sum + prior(latents);
}

SessionCovariance ChannelLikelihood::covariance(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                                                const std::vector<int>& poses) const {
  SessionCovariance result(poses.size());
  const double gain = std::exp(latents.log_gain);
  const double range_variance = rangeVariance_m2(latents);
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t i) {
    result[i].assign(static_cast<std::size_t>(cells(poses[i])) * size_, {});
    PackedHermitian own(channels_);
    PackedTurn turn;
    for (const auto& group : echoes[i].groups) {
      const EchoGroup& g = *group;
      const double u = gain * groupGain(g, latents), shift = groupShift_m(g, latents);
      for (const EchoGroup::Fields* fields : {&g.bins, &g.beams}) {
        for (int at = fields->first; at < fields->first + fields->cells; ++at) {
          const EchoGroup::Cell f = *fields->at(at, size_);
          turn.set(apart_, turnOf(latents.yaw_rad[poses[i]], f));
          own.setZero();
          own.addTurned({f.power, f.shift, f.curvature}, {u, u * shift, u * (shift * shift + range_variance)}, turn);
          const int cell = fields == &g.beams ? samples_ + at : at;
          std::complex<float>* to = result[i].data() + static_cast<std::size_t>(cell) * size_;
          for (std::size_t j = 0; j < size_; ++j) {
            to[j] += std::complex<float>(static_cast<float>(own.re[j]), static_cast<float>(own.im[j]));
          }
        }
      }
    }
  });
  return result;
}

/// Changes of one cell's covariance along the globals and the heading. Only directions that act in the cell enter its
/// products. The memory is reused from cell to cell.
struct ChannelLikelihood::CellDirections {
  CellDirections(int count, int channels)
      : acts(static_cast<std::size_t>(count)),
        raw(static_cast<std::size_t>(count), PackedHermitian(channels)),
        whitened(channels * channels + 1, count),
        products(static_cast<std::size_t>(count * count)) {}
  void clear() {
    for (int j : active) acts[j] = 0;
    active.clear();
  }
  PackedHermitian& touch(int j) {
    if (!acts[j]) {
      acts[j] = 1;
      active.push_back(j);
      raw[j].setZero();
    }
    return raw[j];
  }

  std::vector<int> active;
  std::vector<char> acts;
  std::vector<PackedHermitian> raw;
  Eigen::MatrixXd whitened;      ///< [M^2 + 1][count] the active directions, in the first columns
  std::vector<double> products;  ///< of pairs of the active directions
};

void ChannelLikelihood::addEchoDirections(const PoseModel& model, int cell, const PackedHermitian& inverse,
                                          CellDirections& to) const {
  const SessionLatents& latents = model.latents;
  const int heading = latents.globals();
  const double range_variance = rangeVariance_m2(latents);
  PackedTurn turn;
  PackedHermitian own(channels_);  // covariance of one group
  for (std::size_t i = 0; i < model.echoes.all(); ++i) {
    const EchoGroup& group = model.echoes.at(i);
    const auto fields = fieldsOf(group, cell);
    if (!fields) continue;
    const std::complex<float>*power = fields->power, *shift = fields->shift, *curvature = fields->curvature;
    const auto [f, moved] = model.levels[i];
    const double share = inverse.traceOfProduct(power) + kMoved_m * kMoved_m * inverse.traceOfProduct(curvature);
    if (f * share < kNegligibleShare) continue;
    turn.set(apart_, turnOf(latents.yaw_rad[model.pose], *fields));
    own.setZero();
    own.addTurned({power, shift, curvature}, {f, f * moved, f * (moved * moved + range_variance)}, turn);
    for (int actor : group.actors) {
      const int a = static_cast<int>(errorOf(actor, static_cast<std::size_t>(errors_)));
      to.touch(kActors + a).add(own, 1);
      to.touch(kActors + errors_ + a).addTurned({nullptr, shift, curvature}, {0, f, 2 * f * moved}, turn);
    }
    if (model.echoes.isPoseSensitive(i)) to.touch(kPoseSensitive).add(own, 1);
    to.touch(kRange).addTurned({curvature, nullptr, nullptr}, {f * range_variance, 0, 0}, turn);
    const double by_yaw = turnOf(1, *fields);
    if (by_yaw != 0) to.touch(heading).addTurnDerivative(own, by_yaw, apart_);
  }
  for (int j : to.active) {  // the trace of a heading is 0
    if (j != heading) addRelative(latents, cell, to.raw[j]);
  }
}

void ChannelLikelihood::addLevelDirections(const PoseModel& model, int cell, const PackedHermitian& covariance,
                                           CellDirections& to) const {
  const SessionLatents& latents = model.latents;
  const double relative = std::exp(latents.log_relative);
  PackedHermitian& floor = to.touch(kFloor);
  addClutter(latents, model.pose, cell, 1, floor);
  const auto [shape_at, shape_share] = shapeAt(binOf(model.pose, cell));
  to.touch(kShape + shape_at).add(floor, 1 - shape_share);
  to.touch(kShape + shape_at + 1).add(floor, shape_share);
  PackedHermitian& level = to.touch(kGain);
  level.add(covariance, 1);
  level.add(floor, -1);
  addApart(cell, -noiseOf(model.pose, cell), level);
  const double mean = level.trace() / channels_ / (1 + relative + (isBeam(cell) ? kBeamShare : 0));
  addApart(cell, relative * mean, to.touch(kRelative));
}

void ChannelLikelihood::addProducts(CellDirections& directions, BinBasis& basis, PoseBasis& out) const {
  const int numbers = channels_ * channels_ + 1, count = static_cast<int>(directions.active.size());
  const std::vector<int>& active = directions.active;
  Eigen::MatrixXd& whitened = directions.whitened;
  std::vector<double>& products = directions.products;
  for (int a = 0; a < count; ++a) whiten(basis, directions.raw[active[a]], whitened.col(a).data());
  const Eigen::VectorXd score = whitened.leftCols(count).transpose() * basis.data;
  pairProducts(whitened.data(), numbers, count, products.data());
  basis.traces.resize(count);
  for (std::size_t a = 0; a < active.size(); ++a) {
    const Eigen::Index ia = static_cast<Eigen::Index>(a);
    basis.traces[ia] = traceOfWhitened(whitened.col(ia).data(), channels_);
    out.score[active[a]] += weight() * score[ia];
    for (std::size_t b = 0; b <= a; ++b) {
      const Eigen::Index ib = static_cast<Eigen::Index>(b);
      const double v =
          weight() * tInformation(channels_, products[a * active.size() + b], basis.traces[ia], basis.traces[ib]);
      out.information(active[a], active[b]) += v;
      if (a != b) out.information(active[b], active[a]) += v;
    }
  }
}

void ChannelLikelihood::whiten(const BinBasis& basis, const PackedHermitian& change, double* to) const {
  basis.factor.whiten(change, to);
  const Eigen::Index numbers = basis.level.size();
  to[numbers] = basis.level.dot(Eigen::Map<const Eigen::VectorXd>(to, numbers));
}

void ChannelLikelihood::addBasis(const PoseEchoes& echoes, const SessionLatents& latents, int pose, bool keep,
                                 PoseBasis& out) const {
  const int globals = latents.globals();
  out.score = Eigen::VectorXd::Zero(globals + 1);
  out.information = Eigen::MatrixXd::Zero(globals + 1, globals + 1);
  out.log_likelihood = 0;
  out.astray = Eigen::VectorXd::Zero(errors_);
  out.bins.clear();
  const PoseModel model = modelOf(echoes, latents, pose);
  CellDirections directions(globals + 1, channels_);
  std::array<std::complex<double>, kMaxChannels> y;
  BinBasis basis;
  for (int cell = firstBin(); cell < cells(pose); ++cell) {
    directions.clear();
    const PackedHermitian covariance = sigma(model, cell);
    basis.cell = cell;
    if (!basis.factor.compute(covariance)) continue;
    basis.factor.apply(dataOf(pose, cell), y.data());
    const CellLikelihood likelihood(basis.factor, y.data(), strongestEcho(model, cell));
    out.log_likelihood += likelihood.logLikelihood();
    if (const int group = model.strongest[static_cast<std::size_t>(cell)]; group >= 0) {
      for (int actor : model.echoes.at(static_cast<std::size_t>(group)).actors) {
        out.astray[static_cast<Eigen::Index>(errorOf(actor, static_cast<std::size_t>(errors_)))] +=
            weight() * likelihood.astray();
      }
    }
    out.score[kSpread] += weight() * likelihood.spreadScore();
    out.information(kSpread, kSpread) += weight() * likelihood.spreadInformation();
    addEchoDirections(model, cell, basis.factor.inverse(), directions);
    addLevelDirections(model, cell, covariance, directions);
    basis.active = directions.active;
    const int numbers = channels_ * channels_;
    basis.data.setZero(numbers + 1);
    basis.level.resize(numbers);
    likelihood.score(basis.data.data());
    likelihood.level(basis.level.data());
    addProducts(directions, basis, out);
    if (!keep) continue;
    basis.whitened = directions.whitened.leftCols(static_cast<Eigen::Index>(basis.active.size())).cast<float>();
    out.bins.push_back(std::exchange(basis, {}));
  }
  out.log_likelihood *= weight();
}

Basis ChannelLikelihood::basis(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                               bool further) const {
  Basis b;
  b.latents = latents;
  b.poses.resize(echoes.size());
  tbb::parallel_for(std::size_t{0}, echoes.size(),
                    [&](std::size_t i) { addBasis(echoes[i], latents, static_cast<int>(i), further, b.poses[i]); });
  return b;
}

Basis ChannelLikelihood::basisAt(int pose, const PoseEchoes& echoes, const SessionLatents& latents) const {
  Basis b;
  b.latents = latents;
  b.poses.resize(data_.poses.size());
  addBasis(echoes, latents, pose, false, b.poses[static_cast<std::size_t>(pose)]);
  return b;
}

/// Score and information of one pose along globals, further directions and, last, its heading.
struct ChannelLikelihood::PoseScores {
  Eigen::VectorXd score;
  Eigen::MatrixXd information;
};

ChannelLikelihood::PoseScores ChannelLikelihood::poseScores(const Basis& basis, std::size_t pose,
                                                            const std::vector<const PoseCovariance*>& further) const {
  const int globals = basis.latents.globals(), all = globals + static_cast<int>(further.size());
  const PoseBasis& pose_basis = basis.poses[pose];
  PoseScores own;
  own.score = Eigen::VectorXd::Zero(all + 1);
  own.score.head(globals) = pose_basis.score.head(globals);
  own.score[all] = pose_basis.score[globals];
  own.information = Eigen::MatrixXd::Zero(all + 1, all + 1);
  own.information.topLeftCorner(globals, globals) = pose_basis.information.topLeftCorner(globals, globals);
  own.information.col(all).head(globals) = pose_basis.information.col(globals).head(globals);
  own.information.row(all).head(globals) = pose_basis.information.row(globals).head(globals);
  own.information(all, all) = pose_basis.information(globals, globals);
  for (const BinBasis& bin : pose_basis.bins) addFurther(bin, basis.latents, further, own);
  return own;
}

void ChannelLikelihood::addFurther(const BinBasis& bin, const SessionLatents& latents,
                                   const std::vector<const PoseCovariance*>& further, PoseScores& own) const {
  const int globals = latents.globals(), more = static_cast<int>(further.size()), all = globals + more;
  Eigen::MatrixXd v(channels_ * channels_ + 1, more);
  PackedHermitian change(channels_);
  std::vector<int> active;
  Eigen::VectorXd traces(more);
  for (int h = 0; h < more; ++h) {
    const PoseCovariance& field = *further[static_cast<std::size_t>(h)];
    if (field.empty()) continue;
    const auto* from = field.data() + static_cast<std::size_t>(bin.cell) * size_;
    if (std::all_of(from, from + size_, [](auto x) { return x == 0.0f; })) continue;
    change.setZero();
    change.add(from, 1);
    addRelative(latents, bin.cell, change);
    whiten(bin, change, v.col(h).data());
    traces[h] = traceOfWhitened(v.col(h).data(), channels_);
    active.push_back(h);
  }
  for (int h : active) {
    own.score[globals + h] += weight() * v.col(h).dot(bin.data);
    const Eigen::VectorXf single = v.col(h).cast<float>();
    const Eigen::VectorXf products = bin.whitened.transpose() * single;
    for (std::size_t a = 0; a < bin.active.size(); ++a) {
      const int g = bin.active[a] == globals ? all : bin.active[a];
      const Eigen::Index ia = static_cast<Eigen::Index>(a);
      const double x = weight() * tInformation(channels_, products[ia], bin.traces[ia], traces[h]);
      own.information(globals + h, g) += x;
      own.information(g, globals + h) += x;
    }
    for (int k : active) {
      if (k > h) continue;
      const double x = weight() * tInformation(channels_, v.col(h).dot(v.col(k)), traces[h], traces[k]);
      own.information(globals + h, globals + k) += x;
      if (k != h) own.information(globals + k, globals + h) += x;
    }
  }
}

void ChannelLikelihood::addWithoutHeading(const PoseScores& p, const SessionLatents& latents, std::size_t pose,
                                          Scores& scores) const {
  const Eigen::Index all = p.score.size() - 1;
  const double heading_prior = 1 / (accuracy_.heading_rad * accuracy_.heading_rad);
  const double own = p.information(all, all) + heading_prior;
  const double yaw = p.score[all] - heading_prior * latents.yaw_rad[pose];
  const Eigen::VectorXd coupling = p.information.col(all).head(all) / own;
  scores.by_location.row(data_.poses[pose].location) += (p.score.head(all) - coupling * yaw).transpose();
  scores.information += p.information.topLeftCorner(all, all) - own * coupling * coupling.transpose();
  scores.yaw_step[pose] = yaw / own;
  scores.yaw_coupling.row(static_cast<Eigen::Index>(pose)) = coupling.transpose();
}

void ChannelLikelihood::addPriors(const SessionLatents& latents, Scores& scores) const {
  scores.prior = Eigen::VectorXd::Zero(latents.globals());
  for (int a = 0; a < errors_; ++a) {
    const double gain = 1 / (spread_.actor_gain * spread_.actor_gain);
    const double range = 1 / (spread_.actor_range_m * spread_.actor_range_m);
    scores.prior[kActors + a] = gain;
    scores.prior[kActors + errors_ + a] = range;
    scores.information(kActors + a, kActors + a) += gain;
    scores.total[kActors + a] -= gain * latents.actor_gain[a];
    scores.information(kActors + errors_ + a, kActors + errors_ + a) += range;
    scores.total[kActors + errors_ + a] -= range * latents.actor_range_m[a];
  }
  // Levels of errors that no data shows have no information. A little holds their steps, not their values.
  constexpr double kHeld = 1 / (2.3 * 2.3);
  for (int j = kRelative; j < kActors; ++j) scores.information(j, j) += kHeld;
}

void ChannelLikelihood::holdAtLimits(const SessionLatents& latents, Scores& scores) const {
  // A number at its limit whose step leads beyond it is held, and drops out of the steps of all others.
  for (int j = 0; j < latents.globals(); ++j) {
    const Limits limits = limitsOf(j, errors_, spread_);
    const double v = latents.global(j);
    if (scores.total[j] > 0 ? v < limits.high : v > limits.low) continue;
    scores.total[j] = 0;
    scores.by_location.col(j).setZero();
    scores.yaw_coupling.col(j).setZero();
    scores.information.row(j).setZero();
    scores.information.col(j).setZero();
    scores.information(j, j) = 1;
  }
}

Scores ChannelLikelihood::scores(const Basis& basis, const std::vector<SessionCovariance>& directions,
                                 const std::vector<int>& poses) const {
  Scores scores = freeScores(basis, directions, poses);
  holdAtLimits(basis.latents, scores);
  return scores;
}

Scores ChannelLikelihood::freeScores(const Basis& basis, const std::vector<SessionCovariance>& directions,
                                     const std::vector<int>& poses) const {
  const SessionLatents& latents = basis.latents;
  const Eigen::Index all = latents.globals() + static_cast<Eigen::Index>(directions.size());
  std::vector<PoseScores> each(poses.size());
  tbb::parallel_for(std::size_t{0}, poses.size(), [&](std::size_t j) {
    std::vector<const PoseCovariance*> further;
    for (const SessionCovariance& d : directions) further.push_back(&d[j]);
    each[j] = poseScores(basis, static_cast<std::size_t>(poses[j]), further);
  });
  Scores scores;
  scores.by_location = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(data_.locations.size()), all);
  scores.information = Eigen::MatrixXd::Zero(all, all);
  scores.yaw_step.assign(data_.poses.size(), 0.0);
  scores.yaw_coupling = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(data_.poses.size()), all);
  for (std::size_t j = 0; j < each.size(); ++j) {
    const std::size_t pose = static_cast<std::size_t>(poses[j]);
    scores.log_likelihood += basis.poses[pose].log_likelihood;
    addWithoutHeading(each[j], latents, pose, scores);
  }
  scores.total = scores.by_location.colwise().sum().transpose();
  addPriors(latents, scores);
  scores.log_likelihood += prior(latents);
  return scores;
}

ChannelLikelihood::Whitened ChannelLikelihood::whitened(const PoseModel& model, int bin) const {
  Whitened cell;
  const Eigen::LLT<Eigen::MatrixXcd> factor(sigma(model, bin).full());
  cell.inverse = factor.solve(Eigen::MatrixXcd::Identity(channels_, channels_));
  const Eigen::VectorXcd y = data_.poses[model.pose].range_spectra.col(bin);
  cell.solved = cell.inverse * y;
  cell.weight = (channels_ + kTailFreedom) / (kTailFreedom + y.dot(cell.solved).real());
  return cell;
}

ChannelLikelihood::Whitened ChannelLikelihood::whitened(const PoseEchoes& echoes, const SessionLatents& latents,
                                                        int pose, int bin) const {
  return whitened(modelOf(echoes, latents, pose), bin);
}

std::vector<ChannelLikelihood::Whitened> ChannelLikelihood::whitened(const PoseEchoes& echoes,
                                                                     const SessionLatents& latents, int pose) const {
  const PoseModel model = modelOf(echoes, latents, pose);
  std::vector<Whitened> cells;
  for (int bin = 0; bin < samples_; ++bin) cells.push_back(whitened(model, std::max(bin, firstBin())));
  return cells;
}

double ChannelLikelihood::gainOfPoint(const Whitened& cell, double power, double noise, double found) const {
  // Sigma + power v v^H, by the determinant lemma and Sherman and Morrison.
  const double more = 1 + power * noise, q = (channels_ + kTailFreedom) / cell.weight - kTailFreedom;
  const double after = std::max(0.0, q - power * found / more);
  return weight() * (-std::log(more) +
                     (channels_ + kTailFreedom) * (std::log1p(q / kTailFreedom) - std::log1p(after / kTailFreedom)));
}

}  // namespace mmradartwin::diagnosis::likelihood
