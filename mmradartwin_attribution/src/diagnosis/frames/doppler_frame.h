#pragma once

#include <Eigen/Core>
#include <complex>
#include <unsupported/Eigen/FFT>
#include <vector>

#include "diagnosis/frames/residual_spectra.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::frames {

/// Cell of range and Doppler; `turns` are those of the phase over a frame, signed.
struct DopplerCell {
  int bin = 0, doppler = 0, turns = 0;
};

/// Doppler spectra of one frame's loops, with Hann's window and unit noise.
class DopplerFrame {
 public:
  DopplerFrame(int channels, int bins, int loops);
  int loops() const { return loops_; }
  float power(int bin, int doppler) const { return power_(bin, doppler); }
  Eigen::Map<const Eigen::VectorXcf> cell(int bin, int doppler) const {
    return Eigen::Map<const Eigen::VectorXcf>(&spectra_[static_cast<std::size_t>((doppler * bins_ + bin) * channels_)],
                                              channels_);
  }
  /// Transforms the shots from begin to end, all of one frame. Loops without a shot count as zero.
  void transform(const ResidualSpectra& s, std::size_t begin, std::size_t end);
  /// Cells of range and Doppler that exceed the noise and their neighbours.
  std::vector<DopplerCell> movingPeaks() const;

 private:
  int channels_, bins_, loops_;
  float least_;  ///< power that noise in all channels does not reach
  std::vector<float> window_;
  float window_power_ = 0;
  Eigen::FFT<float> fft_;
  std::vector<std::complex<float>> spectra_;  ///< [doppler][bin][channel]
  Eigen::ArrayXXf power_;                     ///< [bin][doppler]
};

}  // namespace mmradartwin::diagnosis::frames
