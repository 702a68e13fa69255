#include "map_shading.h"

#include <algorithm>
#include <cmath>

#include "level_colors.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

bool within(const FanGeometry::Sector& s, double azimuth_rad) {
  return std::abs(s.from_rad + s.to_rad) / 2 <= azimuth_rad;  // no, where there is no angle
}

double peak(const FanGeometry& geometry, const std::vector<float>& power_db, const MapShading& shading) {
  float best = -HUGE_VALF;
  for (std::size_t r = 0; r < geometry.ranges(); ++r) {
    if (geometry.rangeEdges_m()[r + 1] <= shading.peak_beyond_m) continue;
    const float* row = power_db.data() + r * geometry.angles();
    for (std::size_t a = 0; a < geometry.angles(); ++a) {
      if (row[a] > best && std::isfinite(row[a]) && within(geometry.sectors()[a], shading.peak_azimuth_rad))
        best = row[a];
    }
  }
  return std::isfinite(best) ? best : 0;
}

}  // namespace

void shade(const FanGeometry& geometry, const std::vector<float>& power_db, const MapShading& shading,
           ShadedMap& shaded) {
  const std::size_t rows = geometry.ranges(), columns = geometry.angles();
  if (power_db.size() != rows * columns) throw InputError("map: power_db is no value per cell");
  if (shading.residual) {
    shaded.reference_db = 0;
    shaded.scale = {ColorMap::kBlueWhiteRed, -shading.residual_span_db, shading.residual_span_db};
  } else {
    const double top = shading.reference_db ? *shading.reference_db : peak(geometry, power_db, shading);
    shaded.reference_db = shading.reference_db ? 0 : top;  // levels are told as they are, or below the peak
    shaded.scale = {shading.level_map, top - shading.level_span_db, top};
  }
  const LevelColors colors(shaded.scale);
  std::vector<std::uint32_t> mask;
  for (const FanGeometry::Sector& s : geometry.sectors()) {
    mask.push_back(within(s, shading.mask_azimuth_rad) ? 0xffffffffU : 0);
  }
  shaded.argb.resize(rows * columns);
  for (std::size_t r = 0; r < rows; ++r) {
    const float* levels = power_db.data() + r * columns;
    std::uint32_t* out = shaded.argb.data() + r * columns;
    for (std::size_t a = 0; a < columns; ++a) out[a] = colors.argb(levels[a]) & mask[a];
  }
}

void fade(const std::vector<float>& power_db, const ShadedMap& shaded, ShadedMap& faded) {
  faded = shaded;
  const bool residual = shaded.scale.map == ColorMap::kBlueWhiteRed;
  const auto zero = static_cast<float>(residual ? 0 : shaded.scale.low_db);
  const float step = 2 * 255 / static_cast<float>(shaded.scale.high_db - zero);
  for (std::size_t i = 0; i < faded.argb.size(); ++i) {
    const float above = std::isnan(power_db[i]) ? 0 : power_db[i] - zero;
    const float alpha = std::clamp((residual ? std::abs(above) : above) * step, 0.0F, 255.0F);
    if (faded.argb[i] != 0) faded.argb[i] = (faded.argb[i] & 0xffffffU) | (static_cast<std::uint32_t>(alpha) << 24);
  }
}

double farthestOver_m(const FanGeometry& geometry, const std::vector<float>& power_db, const ShadedMap& shaded,
                      double below_db) {
  const std::size_t angles = geometry.angles();
  for (std::size_t r = geometry.ranges(); r-- > 0;) {
    for (std::size_t a = 0; a < angles; ++a) {
      const std::size_t cell = r * angles + a;
      if (power_db[cell] >= shaded.scale.high_db - below_db && shaded.argb[cell] != 0) {
        return geometry.rangeEdges_m()[r + 1];
      }
    }
  }
  return 0;
}

}  // namespace mmradartwin
