#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Images of the receivers' mixers, x + beta conj(x).
struct MeasuredImage {
  Eigen::VectorXcd beta;            ///< [receivers]
  Eigen::VectorXd error;            ///< [receivers] standard error of |beta|, from the scatter over locations
  std::complex<double> common = 0;  ///< one beta for all receivers
  double common_error = 0;
  bool differ = false;  ///< the receivers' images differ by more than their errors
};
/// Measures images by their correlation with their hosts, conj(x) at the mirrored frequency of the same pose: no echo
/// of the room has that phase. Levels from the power alone are some 2 dB too high. Nothing where no cell holds only an
/// image, and with fewer than three locations.
std::optional<MeasuredImage> readImage(const ChannelData& data);
/// Measures level and phase of an iq_imbalance, one for all receivers or, where they differ, lists over the receivers.
/// Returns false and leaves the finding unchanged where nothing is measured.
bool measureImage(const ChannelData& data, Finding& f);
/// Subtracts the image of an iq_imbalance of known levels and phases from the data.
void subtractImage(const NamedParameters& iq_imbalance, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
