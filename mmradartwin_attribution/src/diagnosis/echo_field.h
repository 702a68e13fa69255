#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

/// Lower triangles of Hermitian [M][M] matrices, one per range bin from `first` on: element (k, l), k >= l, stands at
/// k(k+1)/2 + l. Single precision keeps a session in memory.
struct BinCovariance {
  int first = 0, bins = 0;
  std::vector<std::complex<float>> packed;
  const std::complex<float>* at(int bin, std::size_t size) const {
    return bin < first || bin >= first + bins ? nullptr : packed.data() + static_cast<std::size_t>(bin - first) * size;
  }
  std::complex<float>* at(int bin, std::size_t size) {
    return const_cast<std::complex<float>*>(static_cast<const BinCovariance*>(this)->at(bin, size));
  }
};

/// Echoes that meet the same actors, summed as powers: the phase between separate paths carries nothing (DESIGN
/// section 4), so that the channels of a range bin have the covariance sum |W|^2 c c^H over paths.
struct EchoGroup {
  std::vector<int> actors;  ///< one per interaction, in order; empty where a path meets none
  BinCovariance power;      ///< |W|^2 c c^H
  BinCovariance shift;      ///< its derivative by the one-way range, per metre
  BinCovariance bend;       ///< W'^2 c c^H per m^2: half the second derivative, and what a random range adds
  BinCovariance cosine;     ///< |W|^2 cos(azimuth) c c^H: what a turn of the radar acts on
};

/// The expected channels of one pose.
struct PoseEchoes {
  std::vector<EchoGroup> groups;
  BinCovariance graze;  ///< power of paths that come, go or change within the accuracy of the pose
};

/// Collects paths into groups.
class EchoCollector {
 public:
  EchoCollector(const RadarConfig& radar, double angle_error_rad);
  /// A path as its tone stands on the channels. weak: only its main lobe counts.
  void add(const PathRecord& record, bool weak);
  /// A path whose response the receiver has changed: y [M][N] instead of the tone; range and direction are the path's.
  void add(const PathRecord& record, const Eigen::MatrixXcd& y);
  /// Power without an actor, direction or range of its own.
  void addGraze(const PathRecord& record, double share);
  PoseEchoes take();

 private:
  EchoGroup& group(const std::vector<int>& actors);
  void outer(const std::complex<double>* c, double cosine, std::vector<std::complex<float>>& packed) const;

  const RadarConfig& radar_;
  double angle_error_rad_;
  int channels_, samples_;
  std::size_t size_;
  double bin_m_;
  std::vector<double> element_phase_;  ///< 2 pi y_k / lambda of the virtual elements
  PoseEchoes echoes_;
};

/// Hann's response at `offset` bins from a tone, 1 at 0, and its derivative per bin: sinc(d)/(1 - d^2), the limit for
/// many samples (error below 1e-3 within three bins of 64).
double hannResponse(double offset);
double hannSlope(double offset);

}  // namespace mmradartwin
