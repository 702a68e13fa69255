#include "mmradartwin_attribution/place_explanation.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/text.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

std::string levelWords(double level_db) {
  const double rounded = std::round(level_db);
  return (rounded < 0 ? "\u2212" : "") + fixedNumber(std::abs(rounded), 0) + " dB";
}

/// "the cabinet north", "the wall and the floor".
std::string withArticle(const std::string& actor) {
  std::string words = "the ";
  for (char c : actor) {
    if (c == ';') {
      words += " and the ";
    } else {
      words += c == '_' ? ' ' : c;
    }
  }
  return words;
}

/// The index of the candidate whose middle is nearest, in its own half widths, among those whose box holds the point.
template <typename Places>
int boxAt(const EvaluationField& field, const Places& places, double range_m, double azimuth_rad) {
  const MatchWindow& tight = field.config().tight;
  int best = -1;
  double best_distance = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& place = places[i];
    if (!field.inWindow(tight, place.range_m, place.azimuth_rad, range_m, azimuth_rad)) continue;
    const double distance =
        std::hypot((range_m - place.range_m) / field.halfRange_m(tight),
                   (azimuth_rad - place.azimuth_rad) / field.halfAzimuth_rad(tight, place.azimuth_rad));
    if (best >= 0 && distance >= best_distance) continue;
    best = static_cast<int>(i);
    best_distance = distance;
  }
  return best;
}

int nearestBin(const std::vector<double>& centers, double value) {
  int best = -1;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    if (std::isnan(centers[i])) continue;
    if (best < 0 || std::abs(centers[i] - value) < std::abs(centers[best] - value)) best = static_cast<int>(i);
  }
  return best;
}

/// The strongest evaluated level of a box.
double strongestIn(const EvaluationField& field, const RealGrid& level_db, const PlaceExplanation& place) {
  const RangeAngleAxes& axes = field.axes();
  double strongest = field.config().floor_db;
  for (int r = 0; r < level_db.rows(); ++r) {
    if (std::abs(axes.range_m[r] - place.range_m) > place.half_range_m) continue;
    for (int a = 0; a < level_db.cols(); ++a) {
      if (field.field(r, a) != Field::kCentral ||
          std::abs(axes.azimuth_rad[a] - place.azimuth_rad) > place.half_azimuth_rad)
        continue;
      strongest = std::max(strongest, level_db(r, a));
    }
  }
  return strongest;
}

std::string residualReason(const Residual& r, const std::string& what, double strong_db, bool paths_known,
                           bool has_paths) {
  const bool nowhere = r.region < 0;
  switch (r.residual_class) {
    case ResidualClass::kMissingSupport:
      return what + " should be seen here, and " +
             (paths_known && !has_paths ? "no path of the twin comes from it" : "the twin has no echo of it");
    case ResidualClass::kWeakSupport:
      return what + " is seen but weak";
    case ResidualClass::kUnsupportedAnchor:
      if (r.simulated_db >= 0) {
        return "the twin's strongest echo" + (nowhere ? "" : ", from " + what + ",") +
               " is not measured, and it is what the twin's levels are counted from";
      }
      return nowhere ? "the twin has an echo that is not measured, where the scene lets none be expected"
                     : "the twin's echo of " + what + " is not measured";
    case ResidualClass::kShiftedResponse:
      return r.measured_stronger ? "the twin has the echo of " + what + " near by, and not here"
                                 : "the measurement has the echo of " + what + " near by, and not here";
    case ResidualClass::kMissingMechanism:
      return std::string("a peak is measured where the scene lets none be expected, and ") +
             (r.simulated_db >= strong_db ? "the twin has but the flank of another echo"
                                          : "what makes it is not in the twin");
  }
  return "";
}

std::string reasonOf(const PlaceExplanation& place, const PoseAttribution& pose, double strong_db, bool paths_known) {
  const std::string what = place.actor.empty() ? "" : withArticle(place.actor);
  switch (place.kind) {
    case PlaceKind::kResidual:
      return residualReason(pose.residuals[static_cast<std::size_t>(place.residual)],
                            what.empty() ? "what stands here" : what, strong_db, paths_known, !place.paths.empty());
    case PlaceKind::kMatched:
      return "both see " + what;
    case PlaceKind::kOnlyMeasured:
      return "only the measurement is strong here, by the flank of a stronger echo";
    case PlaceKind::kOnlySimulated:
      return "only the twin is strong here, by the flank of a stronger echo";
    case PlaceKind::kBothStrong:
      return "both are strong here" + (what.empty() ? "" : ", at " + what);
    case PlaceKind::kQuiet:
      return what.empty() ? "neither is strong, and nothing is expected" : what + " is here, and strong in neither map";
  }
  return "";
}

std::vector<PathPart> partsOf(const EvaluationField& field, const PoseAttribution& pose,
                              const std::vector<PathRecord>& records, double range_m, double azimuth_rad) {
  std::vector<PathPart> parts;
  double sum = 0;
  for (int index : recordsInCell(field, records, range_m, azimuth_rad)) {
    const PathRecord& record = records[static_cast<std::size_t>(index)];
    const double amplitude = field.recordShare(record, range_m, azimuth_rad) * record.amplitude;
    const double length_m = meanLength_m(record);
    PathPart part;
    part.record = index;
    part.level_db = dbOfAmplitude(amplitude) - pose.simulated.peak_db;
    part.share = amplitude * amplitude;
    part.delay_s = length_m / kSpeedOfLight_m_per_s;
    part.range_m = length_m / 2;
    part.azimuth_rad = std::asin(std::clamp(record.arrival.y(), -1.0, 1.0));
    sum += part.share;
    parts.push_back(part);
  }
  for (PathPart& part : parts) part.share /= sum;
  return parts;
}

}  // namespace

PlaceExplanation explainPlace(const EvaluationField& field, const PoseAttribution& pose,
                              const std::vector<PathRecord>& records, double range_m, double azimuth_rad) {
  if (field.fieldAt(range_m, azimuth_rad) != Field::kCentral) {
    throw InputError(fixedNumber(range_m, 2) + " m, " + fixedNumber(azimuth_rad / kDegree, 0) +
                     " deg: this place is not compared; choose one inside of the coloured fan");
  }
  const AttributionConfig& config = field.config();
  PlaceExplanation place;
  place.residual = boxAt(field, pose.residuals, range_m, azimuth_rad);
  place.region = place.residual >= 0 ? pose.residuals[static_cast<std::size_t>(place.residual)].region
                                     : boxAt(field, pose.regions, range_m, azimuth_rad);
  place.range_m = range_m;
  place.azimuth_rad = azimuth_rad;
  if (place.region >= 0) {
    const ResponseRegion& region = pose.regions[static_cast<std::size_t>(place.region)];
    place.actor = region.actor;
    place.material = region.material;
  }
  const auto take = [&](double center_range_m, double center_azimuth_rad) {
    place.range_m = center_range_m;
    place.azimuth_rad = center_azimuth_rad;
    place.half_range_m = field.halfRange_m(config.tight);
    place.half_azimuth_rad = field.halfAzimuth_rad(config.tight, center_azimuth_rad);
  };
  if (place.residual >= 0) {
    const Residual& residual = pose.residuals[static_cast<std::size_t>(place.residual)];
    place.kind = PlaceKind::kResidual;
    take(residual.range_m, residual.azimuth_rad);
    place.measured_db = residual.measured_db;
    place.simulated_db = residual.simulated_db;
    place.action = classAction(residual.residual_class);
  } else {
    const int r = nearestBin(field.axes().range_m, range_m), a = nearestBin(field.axes().azimuth_rad, azimuth_rad);
    if (place.region >= 0) {
      const ResponseRegion& region = pose.regions[static_cast<std::size_t>(place.region)];
      take(region.range_m, region.azimuth_rad);
      place.measured_db = strongestIn(field, pose.measured.level_db, place);
      place.simulated_db = strongestIn(field, pose.simulated.level_db, place);
    } else {
      place.half_range_m =
          field.axes().range_m.size() > 1 ? (field.axes().range_m[1] - field.axes().range_m[0]) / 2 : 0;
      place.half_azimuth_rad = place.half_range_m / std::max(range_m, place.half_range_m);
      place.measured_db = pose.measured.level_db(r, a);
      place.simulated_db = pose.simulated.level_db(r, a);
    }
    const bool m = place.measured_db >= config.strong_db, s = place.simulated_db >= config.strong_db;
    const bool matched = place.region >= 0 && pose.regions[static_cast<std::size_t>(place.region)].measured_strong &&
                         pose.regions[static_cast<std::size_t>(place.region)].simulated_strong;
    place.kind = matched  ? PlaceKind::kMatched
                 : m && s ? PlaceKind::kBothStrong
                 : m      ? PlaceKind::kOnlyMeasured
                 : s      ? PlaceKind::kOnlySimulated
                          : PlaceKind::kQuiet;
  }
  place.paths = partsOf(field, pose, records, place.range_m, place.azimuth_rad);
  place.sentence = "measured " + levelWords(place.measured_db) + " here, the twin has " +
                   levelWords(place.simulated_db) + ": " + reasonOf(place, pose, config.strong_db, !records.empty());
  return place;
}

std::string kindName(const PlaceExplanation& place, const PoseAttribution& pose) {
  switch (place.kind) {
    case PlaceKind::kResidual:
      return className(pose.residuals[static_cast<std::size_t>(place.residual)].residual_class);
    case PlaceKind::kMatched:
      return "matched";
    case PlaceKind::kOnlyMeasured:
      return "measured";
    case PlaceKind::kOnlySimulated:
      return "simulated";
    case PlaceKind::kBothStrong:
      return "both";
    case PlaceKind::kQuiet:
      return "quiet";
  }
  return "";
}

}  // namespace mmradartwin
