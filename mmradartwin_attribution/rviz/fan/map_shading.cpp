#include "map_shading.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

std::uint32_t argb(Rgb c) { return 0xff000000U | (std::uint32_t{c.r} << 16) | (std::uint32_t{c.g} << 8) | c.b; }

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
  std::vector<std::uint32_t> colors;
  for (Rgb c : colorsOf(shaded.scale.map)) colors.push_back(argb(c));
  const std::uint32_t none = argb(kNoData);
  std::vector<std::uint32_t> mask;
  for (const FanGeometry::Sector& s : geometry.sectors()) {
    mask.push_back(within(s, shading.mask_azimuth_rad) ? 0xffffffffU : 0);
  }
  const auto low = static_cast<float>(shaded.scale.low_db);
  const auto last = static_cast<float>(colors.size() - 1);
  const float step = last / static_cast<float>(shaded.scale.high_db - shaded.scale.low_db);
  shaded.argb.resize(rows * columns);
  for (std::size_t r = 0; r < rows; ++r) {
    const float* levels = power_db.data() + r * columns;
    std::uint32_t* out = shaded.argb.data() + r * columns;
    for (std::size_t a = 0; a < columns; ++a) {
      const bool known = !std::isnan(levels[a]);
      const float place = known ? std::clamp((levels[a] - low) * step + 0.5F, 0.0F, last) : 0;
      out[a] = (known ? colors[static_cast<std::size_t>(place)] : none) & mask[a];
    }
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

}  // namespace mmradartwin
