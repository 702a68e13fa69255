#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// Half widths of a neighbourhood in the range-angle map. Where a map's bins are wider, one bin stands in.
struct MatchWindow {
  double range_m = 0;
  double azimuth_rad = 0;
};

/// What makes an expected response region (geometry and pose alone, see response_region.h).
struct RegionConfig {
  double max_elevation_rad;  ///< of a supporting point, either side
  double support_floor_db;   ///< a facet, corner or image counts down to this much below the pose's strongest support
  int image_order;           ///< paths of up to so many mirrors count: 3, or 1 for none
  double corner_tolerance_rad;  ///< two facets form a corner where they are perpendicular within this
  double corner_gap_m;          ///< and come this close to their common line
  double extent_floor_db;       ///< a visible rough surface down to this much below it
  double extent_scattering;     ///< scattering coefficient S that such a surface is given: materials do not enter
  double extent_spacing_m;      ///< spacing of the points at which an object's visibility is probed
};

/// All parameters of the attribution; the defaults are those of the paper and of the design.
struct AttributionConfig {
  double min_range_m;        ///< cells at or below are excluded (hardware near range)
  double max_azimuth_rad;    ///< evaluated field of view, either side
  double outer_azimuth_rad;  ///< up to here cells are reported apart
  double floor_db;           ///< maps are clipped to [floor, 0] dB of their peak
  double strong_db, medium_db, weak_db;
  double response_margin_db;  ///< a response stands this much above the point responses of stronger ones
  MatchWindow tight, wide, agreement;
  double near_limit_m, far_limit_m;  ///< bands: near up to the first, mid up to the second, far beyond
  std::vector<int> top_k;            ///< three numbers
  double record_span_db;             ///< a residual's records reach down to this much below the strongest in its cell
  RegionConfig regions;

  AttributionConfig();
};

/// Which key contradicts another one, and how; both empty where none does.
struct Contradiction {
  std::string key, why;
};
Contradiction contradictionIn(const AttributionConfig& config);

/// Reads attribution.yaml strictly: keys that are absent keep their defaults, unknown ones are errors. Throws
/// InputError.
AttributionConfig loadAttributionConfig(const std::string& file);
AttributionConfig parseAttributionConfig(const std::string& yaml_text, const std::string& name);
/// The text of an attribution.yaml that reads back as `config`; all keys present.
std::string toYaml(const AttributionConfig& config);

}  // namespace mmradartwin
