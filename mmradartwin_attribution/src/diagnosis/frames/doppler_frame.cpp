#include "diagnosis/frames/doppler_frame.h"

#include <algorithm>
#include <boost/math/special_functions/gamma.hpp>
#include <cmath>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::frames {

DopplerFrame::DopplerFrame(int channels, int bins, int loops)
    : channels_(channels),
      bins_(bins),
      loops_(loops),
      least_(static_cast<float>(
          boost::math::gamma_q_inv(static_cast<double>(channels), bounds::kDopplerCellFalseAlarmRate))),
      fft_(Eigen::FFT<float>::impl_type(), Eigen::FFT<float>::Unscaled),
      spectra_(static_cast<std::size_t>(loops) * static_cast<std::size_t>(bins * channels)),
      power_(bins, loops) {
  for (double w : hannWindow(loops)) {
    window_.push_back(static_cast<float>(w));
    window_power_ += window_.back() * window_.back();
  }
}

void DopplerFrame::transform(const ResidualSpectra& s, std::size_t begin, std::size_t end) {
  std::vector<std::complex<float>> in(static_cast<std::size_t>(loops_)), out(in);
  for (int b = 0; b < bins_; ++b) {
    for (int k = 0; k < channels_; ++k) {
      std::fill(in.begin(), in.end(), 0.0f);
      for (std::size_t i = begin; i < end; ++i) {
        const auto loop = static_cast<std::size_t>(s.shot[i] % loops_);
        in[loop] = s.at(i, b)[k] * window_[loop] / std::sqrt(window_power_);
      }
      fft_.fwd(out.data(), in.data(), loops_);
      for (int d = 0; d < loops_; ++d) {
        spectra_[static_cast<std::size_t>((d * bins_ + b) * channels_ + k)] = out[static_cast<std::size_t>(d)];
      }
    }
    for (int d = 0; d < loops_; ++d) power_(b, d) = cell(b, d).squaredNorm();
  }
}

std::vector<DopplerCell> DopplerFrame::movingPeaks() const {
  std::vector<DopplerCell> peaks;
  for (int b = 1; b + 1 < bins_; ++b) {
    for (int d = 0; d < loops_; ++d) {
      const int turns = d < (loops_ + 1) / 2 ? d : d - loops_;
      // Static echoes leak into two turns per frame through the window, and flicker there.
      if (std::abs(turns) <= 2 || power_(b, d) < least_) continue;
      bool highest = true;
      for (int i = -1; i <= 1; ++i) {
        for (int j = -1; j <= 1; ++j) highest &= power_(b, d) >= power_(b + i, (d + j + loops_) % loops_);
      }
      if (highest) peaks.push_back({b, d, turns});
    }
  }
  return peaks;
}

}  // namespace mmradartwin::diagnosis::frames
