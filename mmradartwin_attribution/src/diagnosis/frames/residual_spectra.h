#pragma once

#include <complex>
#include <utility>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::frames {

/// Range spectra of the residuals of shots that are nearly complete.
struct ResidualSpectra {
  using Complex = std::complex<float>;

  int channels = 0, bins = 0;
  std::vector<int> shot;                   ///< indices of the shots
  std::vector<Complex> residual;           ///< [shot][bin][channel]; in units of the noise once it is known
  std::vector<Complex> average;            ///< [bin][channel]; likewise in units of the noise
  std::vector<std::complex<double>> gain;  ///< [shot] common to all cells, removed from the residuals
  int per_frame = 1;                       ///< shots
  const Complex* at(std::size_t i, int bin) const {
    return &residual[(i * static_cast<std::size_t>(bins) + static_cast<std::size_t>(bin)) *
                     static_cast<std::size_t>(channels)];
  }
  Complex* at(std::size_t i, int bin) { return const_cast<Complex*>(std::as_const(*this).at(i, bin)); }
};

}  // namespace mmradartwin::diagnosis::frames
