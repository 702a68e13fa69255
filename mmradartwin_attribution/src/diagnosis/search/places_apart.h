#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// Places nearer to each other than that are one.
inline constexpr double kPlacesApart_m = 0.5;

/// The first places, at most so many, that explain something and lie apart from each other and from those known, in
/// the floor plan. places: best first.
template <typename Place>
std::vector<Place> placesApart(const std::vector<Place>& places, const std::vector<Place>& known, std::size_t most) {
  std::vector<Place> best;
  for (const Place& place : places) {
    if (best.size() == most || !(place.screened_nats > 0)) break;
    const auto near = [&](const Place& other) {
      return std::hypot(place.x_m - other.x_m, place.y_m - other.y_m) < kPlacesApart_m;
    };
    if (std::none_of(best.begin(), best.end(), near) && std::none_of(known.begin(), known.end(), near)) {
      best.push_back(place);
    }
  }
  return best;
}

}  // namespace mmradartwin::diagnosis::search
