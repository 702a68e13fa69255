#include "diagnosis/receiver/channel_errors.h"

#include <Eigen/SVD>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <set>

#include "diagnosis/catalogue/bounds.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

/// Steps of sin(azimuth) from -1 to 1: half a step turns the array's ends by 1.2 degrees.
constexpr int kDirections = 512;
constexpr double kFirst_m = 0.3;            ///< range up to which there is leakage
constexpr double kLeftShare = 0.002;        ///< share of a real echo's power that no array response explains
constexpr std::size_t kMostEchoes = 200;    ///< echoes that are used, the strongest
constexpr int kRounds = 40;                 ///< alternations between directions and factors
constexpr double kGroup_m = 0.6;            ///< range span of echoes of one body, which are held out together
constexpr std::size_t kMostOrders = 200;    ///< orders of channels that are tried
constexpr double kLeastNoisePower = 1e-30;  ///< floor of the noise, against division by zero
/// Number of locations from which echoes are held out by location, not by range.
constexpr std::size_t kFewestPlaces = 3;

/// Echo whose channels are compared with array responses.
struct Echo {
  Eigen::VectorXcd y;   ///< [M] as delivered
  double turn_rad = 0;  ///< phase from one slot to the next
  double power = 0;     ///< ratio to the noise
  int group = 0;        ///< echoes of one group are held out together
};

using Factors = Eigen::VectorXcd;

/// Array responses of all directions that are tried, [M][directions].
Eigen::MatrixXcd responses(const RadarConfig& radar) {
  Eigen::MatrixXcd v(radar.channels(), kDirections + 1);
  for (int i = 0; i <= kDirections; ++i) {
    const double u = 2.0 * i / kDirections - 1;
    for (int k = 0; k < radar.channels(); ++k) {
      v(k, i) = std::polar(1.0, -2 * M_PI * radar.virtual_element_m(k).y() * u / radar.wavelength_m());
    }
  }
  return v;
}

/// Fits factors on the channels to the echoes of a session, each with its own direction.
class EchoFit {
 public:
  explicit EchoFit(const ChannelData& data) : radar_(data.radar), directions_(responses(data.radar)) {
    const int first = static_cast<int>(std::ceil(kFirst_m / radar_.range_bin_m()));
    const bool by_place = data.locations.size() >= kFewestPlaces;
    for (const PoseChannels& channels : data.poses) {
      const Eigen::VectorXd power = channels.range_spectra.colwise().squaredNorm().transpose() /
                                    static_cast<double>(channels.range_spectra.rows());
      const auto group = [&](int bin) {
        return by_place ? channels.location : static_cast<int>(bin * radar_.range_bin_m() / kGroup_m);
      };
      for (int r = std::max(1, first); r + 1 < static_cast<int>(power.size()); ++r) {
        if (power[r] < power[r - 1] || power[r] < power[r + 1] ||
            power[r] < bounds::kLeastEchoOverNoise * channels.noise_power)
          continue;
        echoes_.push_back(
            {channels.range_spectra.col(r), 0, power[r] / std::max(channels.noise_power, kLeastNoisePower), group(r)});
      }
      for (const MovingCell& cell : channels.moving) {
        if (cell.bin < first || cell.power < bounds::kLeastEchoOverNoise) continue;
        echoes_.push_back({cell.channels, cell.turn_rad, cell.power, group(cell.bin)});
      }
    }
    std::stable_sort(echoes_.begin(), echoes_.end(), [](const Echo& a, const Echo& b) { return a.power > b.power; });
    if (echoes_.size() > kMostEchoes) echoes_.resize(kMostEchoes);
    for (const Echo& e : echoes_) groups_.insert(e.group);
  }

  bool enough() const { return echoes_.size() >= bounds::kFewestEchoes && groups_.size() >= bounds::kFewestEchoGroups; }
  int echoes() const { return static_cast<int>(echoes_.size()); }
  const std::set<int>& groups() const { return groups_; }

  /// Puts channels into the order `order`, and removes the phase of moving echoes from slot to slot.
  void arrange(const std::vector<int>& order) {
    const Eigen::Index channels = radar_.channels();
    y_.resize(channels, static_cast<Eigen::Index>(echoes_.size()));
    for (std::size_t e = 0; e < echoes_.size(); ++e) {
      for (Eigen::Index i = 0; i < channels; ++i) {
        const int k = order[static_cast<std::size_t>(i)];
        y_(k, static_cast<Eigen::Index>(e)) =
            echoes_[e].y[i] * std::polar(1.0, -echoes_[e].turn_rad * (k / radar_.receivers()));
      }
      y_.col(static_cast<Eigen::Index>(e)).normalize();
    }
  }

  /// Log-likelihood [echoes] with these factors on the channels, maximised over direction and amplitude. An echo's
  /// errors have equal variance in all channels, at least that of kLeftShare.
  Eigen::VectorXd logLikelihood(const Factors& factors) const {
    const Directed d = direct(factors);
    return -static_cast<double>(radar_.channels()) * (1 - d.share.array() + kLeftShare).log().matrix();
  }

  /// Factors of maximum likelihood, without the echoes of one group. Directions, amplitudes and weights alternate with
  /// least squares of the factors.
  Factors fit(ChannelTie tie, std::optional<int> without = std::nullopt) const {
    const int channels = radar_.channels(), receivers = radar_.receivers();
    Factors factors = Factors::Ones(channels);
    for (int round = 0; round < kRounds; ++round) {
      const Directed d = direct(factors);
      Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(channels);
      double total = 0;
      for (std::size_t e = 0; e < echoes_.size(); ++e) {
        if (without && echoes_[e].group == *without) continue;
        const auto i = static_cast<Eigen::Index>(e);
        const double weight = 1 / (1 - d.share[i] + kLeftShare);
        sum += weight * std::conj(d.amplitude[i]) * y_.col(i).cwiseProduct(directions_.col(d.direction[i]).conjugate());
        total += weight * std::norm(d.amplitude[i]);
      }
      sum /= total;
      if (tie == ChannelTie::kTransmitters) {
        for (int t = 0; t < channels / receivers; ++t) {
          sum.segment(t * receivers, receivers).setConstant(sum.segment(t * receivers, receivers).mean());
        }
      } else if (tie == ChannelTie::kReceivers) {
        // The nearest rank-one table of receivers and transmitters.
        const Eigen::Map<const Eigen::MatrixXcd> table(sum.data(), receivers, channels / receivers);
        const Eigen::JacobiSVD<Eigen::MatrixXcd> svd(table, Eigen::ComputeThinU | Eigen::ComputeThinV);
        const Eigen::MatrixXcd nearest =
            svd.singularValues()[0] * svd.matrixU().col(0) * svd.matrixV().col(0).adjoint();
        sum = Eigen::Map<const Eigen::VectorXcd>(nearest.data(), channels);
      }
      factors = sum / sum[0];
    }
    return factors;
  }

  /// Phases [M] of factors without jumps, relative to channel 0 and without the slope of a turned radar.
  Eigen::VectorXd phases(const Factors& factors, ChannelTie tie) const {
    if (tie == ChannelTie::kTransmitters) return factors.array().arg();
    Eigen::VectorXd phase(factors.size()), place = places();
    phase[0] = 0;
    for (Eigen::Index k = 1; k < phase.size(); ++k) {
      phase[k] = phase[k - 1] + std::arg(factors[k] * std::conj(factors[k - 1]));
    }
    const Eigen::VectorXd centred = place.array() - place.mean();
    phase -= place * (centred.dot(phase) / centred.squaredNorm());
    return phase.array() - phase[0];
  }

  /// Positions [M] along the array, m.
  Eigen::VectorXd places() const {
    Eigen::VectorXd place(radar_.channels());
    for (int k = 0; k < radar_.channels(); ++k) place[k] = radar_.virtual_element_m(k).y();
    return place;
  }

  /// Nats of the echoes of one group, `with` over `base`.
  double heldOut(const Eigen::VectorXd& with, const Eigen::VectorXd& base, int group) const {
    double sum = 0;
    for (std::size_t e = 0; e < echoes_.size(); ++e) {
      const auto i = static_cast<Eigen::Index>(e);
      if (echoes_[e].group == group) sum += with[i] - base[i];
    }
    return sum;
  }

 private:
  /// Best direction of each echo, [echoes].
  struct Directed {
    Eigen::VectorXd share;       ///< share of the echo's power
    Eigen::VectorXcd amplitude;  ///< of the response
    Eigen::VectorXi direction;   ///< index
  };

  Directed direct(const Factors& factors) const {
    const Eigen::MatrixXcd match = directions_.adjoint() * (factors.conjugate().asDiagonal() * y_);
    const double norm = factors.squaredNorm();
    Directed d{Eigen::VectorXd(y_.cols()), Eigen::VectorXcd(y_.cols()), Eigen::VectorXi(y_.cols())};
    for (Eigen::Index i = 0; i < y_.cols(); ++i) {
      Eigen::Index best = 0;
      d.share[i] = std::min(1.0, match.col(i).cwiseAbs2().maxCoeff(&best) / norm);
      d.amplitude[i] = match(best, i) / norm;
      d.direction[i] = static_cast<int>(best);
    }
    return d;
  }

  const RadarConfig& radar_;
  Eigen::MatrixXcd directions_;
  std::vector<Echo> echoes_;
  std::set<int> groups_;
  Eigen::MatrixXcd y_;  ///< [M][echoes] of power 1
};

/// Whether all channels are on the line along y: elements beside it see an echo's elevation, which a response over
/// azimuth does not have.
bool allOnALine(const RadarConfig& radar) {
  return static_cast<int>(radar.virtualLine().channels.size()) == radar.channels();
}

/// Delivered order of channels.
std::vector<int> asItIs(const RadarConfig& radar) {
  std::vector<int> order(static_cast<std::size_t>(radar.channels()));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

/// Orders of channels: receivers in any order, the same for all transmitters, and transmitters in any order. Empty
/// where there are too many.
std::vector<std::vector<int>> orders(const RadarConfig& radar) {
  const int receivers = radar.receivers(), slots = radar.slots();
  std::vector<std::vector<int>> all;
  std::vector<int> slot(static_cast<std::size_t>(slots));
  std::iota(slot.begin(), slot.end(), 0);
  do {
    std::vector<int> receiver(static_cast<std::size_t>(receivers));
    std::iota(receiver.begin(), receiver.end(), 0);
    do {
      std::vector<int> order;
      for (int t : slot) {
        for (int r : receiver) order.push_back(t * receivers + r);
      }
      all.push_back(std::move(order));
      if (all.size() > kMostOrders) return {};
    } while (std::next_permutation(receiver.begin(), receiver.end()));
  } while (std::next_permutation(slot.begin(), slot.end()));
  return all;
}

}  // namespace

double student95(double freedom) {
  return boost::math::quantile(boost::math::students_t_distribution<double>(freedom), 0.975);
}

std::optional<ChannelOrder> findChannelOrder(const ChannelData& data) {
  if (!allOnALine(data.radar)) return std::nullopt;
  EchoFit fit(data);
  if (!fit.enough() || data.radar.channels() < 4) return std::nullopt;
  const std::vector<int> same = asItIs(data.radar);
  double as_it_is = 0;
  std::vector<std::pair<double, std::vector<int>>> tried;
  for (const std::vector<int>& order : orders(data.radar)) {
    fit.arrange(order);
    const double nats = fit.logLikelihood(fit.fit(ChannelTie::kFree)).sum();
    if (order == same) as_it_is = nats;
    tried.emplace_back(nats, order);
  }
  if (tried.size() < 2) return std::nullopt;
  std::stable_sort(tried.begin(), tried.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  const double gain = tried[0].first - as_it_is;
  if (gain < bounds::kLeastNatsOfChannelOrder) return std::nullopt;
  // Mirrored orders fit alike where nothing moves. The one that keeps the transmitters in place is stated.
  const std::size_t chosen =
      tried[0].first - tried[1].first < bounds::kSameOrder_nats && tried[1].second < tried[0].second ? 1 : 0;
  ChannelOrder found{tried[chosen].second, gain, tried[0].first - tried[1].first, {}};
  std::swap(tried[0], tried[chosen]);
  const double most = std::max(tried[0].first, tried[1].first);
  for (const auto& [nats, order] : tried) {
    if (most - nats <= bounds::kNotToldApart_nats) found.alike.emplace_back(order, most - nats);
  }
  return found;
}

namespace {

/// Fit of factors under one constraint, and the same without each group.
struct TiedFit {
  ChannelTie tie;
  Factors factors;
  std::vector<Factors> without;   ///< [groups] fitted without one group each
  double gain = 0, held_out = 0;  ///< nats over no errors
};

TiedFit fitTied(const EchoFit& fit, ChannelTie tie, const Eigen::VectorXd& base) {
  TiedFit t{tie, fit.fit(tie), {}, 0, 0};
  t.gain = fit.logLikelihood(t.factors).sum() - base.sum();
  for (int group : fit.groups()) {
    t.without.push_back(fit.fit(tie, group));
    t.held_out += fit.heldOut(fit.logLikelihood(t.without.back()), base, group);
  }
  return t;
}

/// Sets the standard errors by the jackknife over groups.
void setStandardErrors(const EchoFit& fit, const TiedFit& best, ChannelErrors& errors) {
  const auto groups = static_cast<double>(best.without.size());
  Eigen::ArrayXd phase2 = Eigen::ArrayXd::Zero(errors.phase_rad.size()), gain2 = phase2;
  for (const Factors& f : best.without) {
    phase2 += (fit.phases(f, best.tie) - errors.phase_rad).array().square();
    gain2 += (20 * f.cwiseAbs().array().log10() - errors.gain_db.array()).square();
  }
  if (best.tie != ChannelTie::kTransmitters) {
    const Eigen::VectorXd place = fit.places();
    const Eigen::ArrayXd centred = place.array() - place.mean();
    const double freedom = std::max(1.0, static_cast<double>(place.size()) - 2);
    const double rms = std::sqrt((errors.phase_rad.array() - errors.phase_rad.mean()).square().sum() / freedom);
    // The slope of so few errors follows Student's t. Its error is scaled so that the 95 % interval by the number of
    // groups has the right width.
    const double wide = rms * student95(freedom) / student95(groups - 1);
    phase2 += ((place.array() - place[0]) * wide).square() / centred.square().sum() * groups / (groups - 1);
  }
  errors.phase_error_rad = (phase2 * (groups - 1) / groups).sqrt();
  errors.gain_error_db = (gain2 * (groups - 1) / groups).sqrt();
}

}  // namespace

std::optional<ChannelErrors> findChannelErrors(const ChannelData& data) {
  if (!allOnALine(data.radar)) return std::nullopt;
  EchoFit fit(data);
  if (!fit.enough()) return std::nullopt;
  fit.arrange(asItIs(data.radar));
  const Eigen::VectorXd base = fit.logLikelihood(Factors::Ones(data.radar.channels()));
  // The fewest numbers that predict as well as more numbers.
  const TiedFit tied = fitTied(fit, ChannelTie::kReceivers, base), free = fitTied(fit, ChannelTie::kFree, base);
  TiedFit best = fitTied(fit, ChannelTie::kTransmitters, base);
  const double receivers = data.radar.receivers(), slots = data.radar.slots();
  if (tied.held_out > best.held_out + receivers - 1) best = tied;
  if (free.held_out > best.held_out + (receivers - 1) * (slots - 1)) best = free;
  if (best.gain < bounds::kLeastNatsOfChannelErrors || best.held_out < bounds::kLeastHeldOutNatsOfChannelErrors) {
    return std::nullopt;
  }
  ChannelErrors errors;
  errors.tie = best.tie;
  errors.gain = best.gain;
  errors.held_out_gain = best.held_out;
  errors.receivers = data.radar.receivers();
  errors.echoes = fit.echoes();
  errors.groups = static_cast<int>(fit.groups().size());
  errors.phase_rad = fit.phases(best.factors, best.tie);
  errors.gain_db = 20 * best.factors.cwiseAbs().array().log10();
  setStandardErrors(fit, best, errors);
  const Eigen::VectorXd each = fit.phases(free.factors, free.tie), common = fit.phases(tied.factors, tied.tie);
  errors.apart_rad = 2 * (each - common).cwiseAbs().maxCoeff();
  return errors;
}

void widenGains(const ChannelData& data, const Hypothesis& hypothesis, std::vector<double>& standard_error) {
  const std::optional<ChannelErrors> errors = findChannelErrors(data);
  if (!errors) return;
  for (std::size_t j = 0; j < hypothesis.coordinates.size(); ++j) {
    const Coordinate& c = hypothesis.coordinates[j];
    if (c.parameter == "gain_db" && c.element >= 0) {
      standard_error[j] = std::max(standard_error[j], errors->gain_error_db[c.element]);
    }
  }
}

double arrayShare(const RadarConfig& radar, const Eigen::VectorXcd& channels) {
  const VirtualLine line = radar.virtualLine();
  const Eigen::MatrixXcd all = responses(radar);
  Eigen::MatrixXcd of_line(static_cast<Eigen::Index>(line.channels.size()), all.cols());
  Eigen::VectorXcd on_line(of_line.rows());
  for (Eigen::Index i = 0; i < of_line.rows(); ++i) {
    of_line.row(i) = all.row(line.channels[static_cast<std::size_t>(i)]);
    on_line[i] = channels[line.channels[static_cast<std::size_t>(i)]];
  }
  return (of_line.adjoint() * on_line).cwiseAbs2().maxCoeff() /
         (static_cast<double>(on_line.size()) * on_line.squaredNorm());
}

}  // namespace mmradartwin::diagnosis::receiver
