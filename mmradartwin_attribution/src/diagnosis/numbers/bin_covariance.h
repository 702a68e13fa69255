#pragma once

#include <complex>
#include <cstddef>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::numbers {

/// Hermitian [M][M] matrices, one per range bin from `first` on, as their lower triangles: element (k, l), k >= l,
/// stands at k(k+1)/2 + l. Single precision keeps a session in memory.
struct BinCovariance {
  int first = 0, bins = 0;
  std::vector<std::complex<float>> packed;  ///< [bins][M(M+1)/2]
  /// Triangle of a bin, null beyond the bins; `size` is M(M+1)/2.
  const std::complex<float>* at(int bin, std::size_t size) const {
    return bin < first || bin >= first + bins ? nullptr : packed.data() + static_cast<std::size_t>(bin - first) * size;
  }
  std::complex<float>* at(int bin, std::size_t size) {
    return const_cast<std::complex<float>*>(static_cast<const BinCovariance*>(this)->at(bin, size));
  }
};

}  // namespace mmradartwin::diagnosis::numbers
