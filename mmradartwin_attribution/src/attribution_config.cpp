#include "mmradartwin_attribution/attribution_config.h"

#include <cmath>
#include <iomanip>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

void readNumber(YamlMap& yaml, const std::string& key, double min, double max, double scale, double& value) {
  if (yaml.has(key)) value = scale * yaml.number(key, min, max);
}

void readWindow(YamlMap& yaml, const std::string& key, MatchWindow& window) {
  if (!yaml.has(key)) return;
  YamlMap map = yaml.map(key);
  readNumber(map, "range_m", 0.0, 10.0, 1.0, window.range_m);
  readNumber(map, "azimuth_deg", 0.0, 180.0, kDegree, window.azimuth_rad);
  map.rejectUnknownKeys();
}

AttributionConfig read(YamlMap yaml) {
  AttributionConfig c;
  readNumber(yaml, "min_range_m", 0.0, 10.0, 1.0, c.min_range_m);
  readNumber(yaml, "max_azimuth_deg", 1.0, 90.0, kDegree, c.max_azimuth_rad);
  readNumber(yaml, "outer_azimuth_deg", 1.0, 90.0, kDegree, c.outer_azimuth_rad);
  readNumber(yaml, "floor_db", -200.0, -1.0, 1.0, c.floor_db);
  readNumber(yaml, "strong_db", -100.0, 0.0, 1.0, c.strong_db);
  readNumber(yaml, "medium_db", -100.0, 0.0, 1.0, c.medium_db);
  readNumber(yaml, "weak_db", -100.0, 0.0, 1.0, c.weak_db);
  readNumber(yaml, "response_margin_db", 0.0, 30.0, 1.0, c.response_margin_db);
  readWindow(yaml, "tight", c.tight);
  readWindow(yaml, "wide", c.wide);
  readWindow(yaml, "agreement", c.agreement);
  readNumber(yaml, "near_limit_m", 0.0, 1000.0, 1.0, c.near_limit_m);
  readNumber(yaml, "far_limit_m", 0.0, 1000.0, 1.0, c.far_limit_m);
  if (yaml.has("top_k")) {
    const std::vector<long long> values = yaml.integers("top_k", 1, 1000);
    if (values.size() != 3) yaml.fail("top_k", "needs three numbers, for example [1, 3, 5]");
    c.top_k.assign(values.begin(), values.end());
  }
  readNumber(yaml, "record_span_db", 0.0, 200.0, 1.0, c.record_span_db);
  if (yaml.has("regions")) {
    YamlMap r = yaml.map("regions");
    readNumber(r, "max_elevation_deg", 0.0, 90.0, kDegree, c.regions.max_elevation_rad);
    readNumber(r, "support_floor_db", -200.0, 0.0, 1.0, c.regions.support_floor_db);
    if (r.has("image_order")) c.regions.image_order = static_cast<int>(r.integer("image_order", 1, 3));
    readNumber(r, "corner_tolerance_deg", 0.0, 45.0, kDegree, c.regions.corner_tolerance_rad);
    readNumber(r, "corner_gap_m", 0.0, 1.0, 1.0, c.regions.corner_gap_m);
    readNumber(r, "extent_floor_db", -200.0, 0.0, 1.0, c.regions.extent_floor_db);
    readNumber(r, "extent_scattering", 0.01, 1.0, 1.0, c.regions.extent_scattering);
    readNumber(r, "extent_spacing_m", 0.01, 5.0, 1.0, c.regions.extent_spacing_m);
    r.rejectUnknownKeys();
  }
  yaml.rejectUnknownKeys();
  if (const Contradiction found = contradictionIn(c); !found.key.empty()) yaml.fail(found.key, found.why);
  return c;
}

std::string numberText(double value) {
  std::ostringstream s;
  s << std::setprecision(12) << value;
  return s.str();
}

std::string window(const MatchWindow& w) {
  return "{range_m: " + numberText(w.range_m) + ", azimuth_deg: " + numberText(w.azimuth_rad / kDegree) + "}";
}

}  // namespace

AttributionConfig::AttributionConfig()
    : min_range_m(0.16),
      max_azimuth_rad(60 * kDegree),
      outer_azimuth_rad(90 * kDegree),
      floor_db(-50),
      strong_db(-15),
      medium_db(-20),
      weak_db(-25),
      response_margin_db(3),
      tight{0.20, 5 * kDegree},
      wide{0.60, 20 * kDegree},
      agreement{0.35, 10 * kDegree},
      near_limit_m(2),
      far_limit_m(4),
      top_k{1, 3, 5},
      record_span_db(20),
      regions{20 * kDegree, -30, 3, 2 * kDegree, 0.005, -25, 0.5, 0.1} {}

Contradiction contradictionIn(const AttributionConfig& c) {
  if (!(c.floor_db <= c.weak_db)) return {"floor_db", "must not be above weak_db"};
  if (!(c.weak_db <= c.medium_db)) return {"weak_db", "must not be above medium_db"};
  if (!(c.medium_db <= c.strong_db)) return {"medium_db", "must not be above strong_db"};
  if (c.outer_azimuth_rad < c.max_azimuth_rad) return {"outer_azimuth_deg", "must not be below max_azimuth_deg"};
  if (c.far_limit_m < c.near_limit_m) return {"far_limit_m", "must not be below near_limit_m"};
  if (c.wide.range_m < c.tight.range_m || c.wide.azimuth_rad < c.tight.azimuth_rad) {
    return {"wide", "must not be narrower than tight"};
  }
  return {};
}

AttributionConfig loadAttributionConfig(const std::string& file) { return read(YamlMap::load(file)); }

AttributionConfig parseAttributionConfig(const std::string& yaml_text, const std::string& name) {
  return read(YamlMap::parse(yaml_text, name));
}

std::string toYaml(const AttributionConfig& c) {
  std::ostringstream s;
  s << "# Field of view: cells beyond min_range_m and within +-max_azimuth_deg are evaluated and set the "
       "normalisation;\n"
       "# those up to outer_azimuth_deg are reported apart.\n"
    << "min_range_m: " << numberText(c.min_range_m) << "\n"
    << "max_azimuth_deg: " << numberText(c.max_azimuth_rad / kDegree) << "\n"
    << "outer_azimuth_deg: " << numberText(c.outer_azimuth_rad / kDegree) << "\n"
    << "# Levels below the map's peak.\n"
    << "floor_db: " << numberText(c.floor_db) << "\n"
    << "strong_db: " << numberText(c.strong_db) << "\n"
    << "medium_db: " << numberText(c.medium_db) << "\n"
    << "weak_db: " << numberText(c.weak_db) << "\n"
    << "# A response is a local maximum this much above what the point responses of stronger ones put there.\n"
    << "response_margin_db: " << numberText(c.response_margin_db) << "\n"
    << "# Half widths around a region or a response; one bin where bins are wider.\n"
    << "tight: " << window(c.tight) << "\n"
    << "wide: " << window(c.wide) << "\n"
    << "agreement: " << window(c.agreement) << "\n"
    << "# Bands of the recall: near, mid, far.\n"
    << "near_limit_m: " << numberText(c.near_limit_m) << "\n"
    << "far_limit_m: " << numberText(c.far_limit_m) << "\n"
    << "top_k: [" << c.top_k.at(0) << ", " << c.top_k.at(1) << ", " << c.top_k.at(2) << "]\n"
    << "# The records of a residual reach down to this much below the strongest one in its cell.\n"
    << "record_span_db: " << numberText(c.record_span_db) << "\n"
    << "# Expected response regions, from geometry and pose alone.\n"
    << "regions:\n"
    << "  max_elevation_deg: " << numberText(c.regions.max_elevation_rad / kDegree) << "\n"
    << "  support_floor_db: " << numberText(c.regions.support_floor_db) << "\n"
    << "  image_order: " << c.regions.image_order << "\n"
    << "  corner_tolerance_deg: " << numberText(c.regions.corner_tolerance_rad / kDegree) << "\n"
    << "  corner_gap_m: " << numberText(c.regions.corner_gap_m) << "\n"
    << "  extent_floor_db: " << numberText(c.regions.extent_floor_db) << "\n"
    << "  extent_scattering: " << numberText(c.regions.extent_scattering) << "\n"
    << "  extent_spacing_m: " << numberText(c.regions.extent_spacing_m) << "\n";
  return s.str();
}

}  // namespace mmradartwin
