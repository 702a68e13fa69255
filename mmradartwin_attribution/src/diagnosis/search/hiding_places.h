#pragma once

#include <vector>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/path_measurement.h"

namespace mmradartwin::diagnosis::search {

/// Place where something stands that hides what the twin expects to be seen.
struct HidingPlace {
  double x_m = 0, y_m = 0;   ///< map, of its middle
  double width_m = 0;        ///< within which paths are hidden
  double screened_nats = 0;  ///< nats by which the echoes that pass it are not there, without the best location's
};

/// Places over the scene's plan that lie apart from each other, best first. The likelihood judges each echo by its
/// value with and without it: an echo that is not there is farther off than slopes reach. poses: indices of those
/// that were measured.
std::vector<HidingPlace> hidingPlaces(const Scene& scene, const ChannelLikelihood& model, const ModelState& null,
                                      const std::vector<int>& poses, const std::vector<MeasuredPose>& measured);

}  // namespace mmradartwin::diagnosis::search
