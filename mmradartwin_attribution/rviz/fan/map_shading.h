#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "color_scale.h"
#include "fan_geometry.h"

namespace mmradartwin {

/// How a map becomes colours.
struct MapShading {
  bool residual = false;  ///< differences around 0 dB instead of levels
  ColorMap level_map = ColorMap::kViridis;
  double level_span_db = 40;           ///< colours reach so far below the reference
  double residual_span_db = 30;        ///< and those of a residual to either side of 0 dB
  std::optional<double> reference_db;  ///< what is at the upper end; none: the map's peak
  double peak_beyond_m = 0;            ///< the peak is looked for beyond this range
  double peak_azimuth_rad = 1.6;       ///< and up to this angle to either side
  double mask_azimuth_rad = 1.6;       ///< cells beyond are not shown
};

/// A map's cells as colours, 0xAARRGGBB, in the message's order: of alpha 255, or 0 where a cell is masked.
struct ShadedMap {
  std::vector<std::uint32_t> argb;
  ColorScale scale;         ///< in the map's own levels
  double reference_db = 0;  ///< what a colour bar calls 0 dB
};

/// Cells without a level (NaN) have the colour kNoData. Reuses the memory of `shaded`.
void shade(const FanGeometry& geometry, const std::vector<float>& power_db, const MapShading& shading,
           ShadedMap& shaded);
/// The same map, the more transparent the weaker: opaque from the middle of the scale upwards, of a residual from the
/// middle of either side outwards.
void fade(const std::vector<float>& power_db, const ShadedMap& shaded, ShadedMap& faded);

/// Far edge of the last range bin with a cell that is shown and lies at most `below_db` below the upper end of the
/// colours; 0 where there is none.
double farthestOver_m(const FanGeometry& geometry, const std::vector<float>& power_db, const ShadedMap& shaded,
                      double below_db);

}  // namespace mmradartwin
