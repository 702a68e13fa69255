#include "diagnosis/echoes/receiver_mixture.h"

#include <algorithm>
#include <boost/functional/hash.hpp>
#include <cmath>
#include <limits>

#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::echoes {
namespace {

/// Power over that of the pose's strongest echo from which a path is sent through the receiver. Products of weaker
/// paths lie below the clutter.
constexpr double kStrongEchoShare = 1e-2;
constexpr std::size_t kMostPaired = 8;    ///< paths that are also sent in pairs
constexpr double kRoundingShare = 1e-12;  ///< share of a path's power that is rounding
constexpr std::size_t kMostKept = 64;     ///< responses of a pose

/// Derivative of a path's samples by its one-way range, per metre, with the phase in the window's middle fixed.
ComplexGrid byRange(const RadarConfig& radar, const ComplexGrid& x) {
  const double samples = static_cast<double>(x.cols());
  ComplexGrid slope = x;
  for (Eigen::Index n = 0; n < x.cols(); ++n) {
    const double turn = 2 * M_PI * (static_cast<double>(n) - 0.5 * samples) / (samples * radar.range_bin_m());
    slope.col(n) *= std::complex<double>(0, turn);
  }
  return slope;
}

/// Record of a product of two paths, with the errors of the actors of both.
PathRecord productOf(const PathRecord& a, const PathRecord& b) {
  PathRecord product = a;
  product.actors.insert(product.actors.end(), b.actors.begin(), b.actors.end());
  return product;
}

}  // namespace

ReceiverMixture::ReceiverMixture(const Twin& twin, const Twin& linear, std::size_t receiver, const Pose& pose,
                                 Cache& cache, std::size_t call)
    : twin_(twin),
      linear_(linear),
      radar_(twin.radar()),
      pose_(pose),
      cache_(cache),
      call_(call),
      receiver_(receiver),
      nothing_(through(twin, {})) {
  if (!linear.hasReceiveStage()) return;
  const std::optional<Eigen::MatrixXcd> matrix = linear.channelMatrix(pose.T_map_radar, pose.stamp_ns);
  for (Eigen::Index k = 0; matrix && k < matrix->size(); ++k) {
    boost::hash_combine(receiver_, matrix->data()[k].real());
    boost::hash_combine(receiver_, matrix->data()[k].imag());
  }
}

ComplexGrid ReceiverMixture::through(const Twin& receiver, const std::vector<PathRecord>& paths) const {
  return receiver.weigh(pose_.T_map_radar, paths, pose_.stamp_ns).grid.x;
}

void ReceiverMixture::send(Alone& path) const {
  if (path.sent) return;
  path.sent = true;
  path.x = through(twin_, {path.path}) - nothing_;
  // The part along the path's own tone belongs to the path; the rest is a separate echo.
  const ComplexGrid tone = through(linear_, {path.path});
  const std::complex<double> kept =
      tone.conjugate().cwiseProduct(path.x).sum() / std::max(tone.squaredNorm(), std::numeric_limits<double>::min());
  path.tone = std::abs(kept);
  path.rest = path.x - kept * tone;
}

void ReceiverMixture::scaleTones(std::vector<PathRecord>& paths, const EchoCollector& collector) {
  std::sort(paths.begin(), paths.end(),
            [](const PathRecord& a, const PathRecord& b) { return a.amplitude > b.amplitude; });
  const double least = paths.empty() ? 0 : std::sqrt(kStrongEchoShare) * paths.front().amplitude;
  for (PathRecord& record : paths) {
    if (record.amplitude <= least) break;
    Alone path{record, receiver_};
    for (double& l : path.path.length_m) l += 2 * collector.addedRange_m(record.actors);
    boost::hash_combine(path.signature, collector.addedRange_m(record.actors));
    boost::hash_range(path.signature, record.actors.begin(), record.actors.end());
    const std::vector<PathRecord> received = linear_.receivedPaths(pose_.T_map_radar, {path.path}, pose_.stamp_ns);
    if (received.empty()) continue;
    for (const PathRecord& part : received) addToSignature(part, path.signature);
    path.received = received.front();
    Kept& kept = cache_[path.signature];
    if (kept.used == 0) {
      send(path);
      kept.tone = path.tone;
    }
    kept.used = call_;
    scaleRecord(kept.tone, record);
    alone_.push_back(std::move(path));
  }
}

std::shared_ptr<const EchoGroup> ReceiverMixture::groupOf(const PathRecord& record, const ComplexGrid& x,
                                                          EchoCollector& collector) const {
  const SignalChain chain(radar_);
  const double window = 0.5 * radar_.samples_per_chirp;  // sum of the Hann window
  const auto spectra = [&](const ComplexGrid& grid) -> Eigen::MatrixXcd { return chain.rangeSpectra(grid) / window; };
  collector.add(record, spectra(x), spectra(byRange(radar_, x)));
  return collector.finishGroup();
}

void ReceiverMixture::addTo(EchoCollector& collector) {
  const auto add = [&](std::size_t signature, const auto& collected) {
    Kept& kept = cache_[signature];
    if (kept.used == 0) {
      kept.rest = collected();
    } else if (kept.rest) {
      collector.add(kept.rest);
    }
    kept.used = call_;
    return kept.rest != nullptr;
  };
  bool products = false;
  for (std::size_t b = 1; b < std::min(alone_.size(), kMostPaired); ++b) {
    for (std::size_t a = 0; a < b && (products || b == 1); ++a) {
      std::size_t signature = alone_[a].signature;
      boost::hash_combine(signature, alone_[b].signature);
      products = add(signature,
                     [&]() -> std::shared_ptr<const EchoGroup> {
                       send(alone_[a]);
                       send(alone_[b]);
                       const ComplexGrid x =
                           through(twin_, {alone_[a].path, alone_[b].path}) - nothing_ - alone_[a].x - alone_[b].x;
                       if (x.squaredNorm() <= kRoundingShare * alone_[a].x.norm() * alone_[b].x.norm()) return nullptr;
                       return groupOf(productOf(alone_[a].received, alone_[b].received), x, collector);
                     }) ||
                 products;
    }
  }
  for (Alone& path : alone_) {
    std::size_t signature = path.signature;
    boost::hash_combine(signature, products);
    add(signature, [&]() -> std::shared_ptr<const EchoGroup> {
      send(path);
      if (path.rest.squaredNorm() <= kRoundingShare * path.x.squaredNorm()) return nullptr;
      return groupOf(products ? productOf(path.received, path.received) : path.received, path.rest, collector);
    });
  }
  if (nothing_.squaredNorm() > 0) {
    PathRecord fixed;  // fixed to the radar: turns with it and has no range
    fixed.departure = fixed.arrival = Eigen::Vector3d::UnitY();
    fixed.length_m.assign(static_cast<std::size_t>(radar_.channels()), 0.0);
    groupOf(fixed, nothing_, collector);
  }
  for (auto at = cache_.begin(); cache_.size() > kMostKept && at != cache_.end();) {
    at = at->second.used < call_ ? cache_.erase(at) : std::next(at);
  }
}

}  // namespace mmradartwin::diagnosis::echoes
