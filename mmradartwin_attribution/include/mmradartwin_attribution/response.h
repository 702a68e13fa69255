#pragma once

#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin {

enum class Field { kExcluded, kCentral, kOuter };

/// A response of a map: a local maximum that is not part of a stronger one's point response.
struct Response {
  int range_bin = 0, angle_bin = 0;     ///< cell of the maximum
  double range_m = 0, azimuth_rad = 0;  ///< interpolated within that cell
  double level_db = 0;                  ///< relative to the map's peak, clipped
  Field field = Field::kExcluded;
};

/// A map relative to its peak among the evaluated cells.
struct NormalisedMap {
  RealGrid level_db;                ///< [N][64] clipped to [floor, 0] dB
  double peak_db = 0;               ///< what 0 dB stands for, in the unit of the map
  std::vector<Response> responses;  ///< strongest first, down to the floor; central and outer field
};

/// Geometry of the evaluation in maps of one radar: the cells that count, the shape of a point response, the windows of
/// a match. All methods are const and may be called from several threads.
class EvaluationField {
 public:
  /// Throws InputError where no cell is left to evaluate.
  EvaluationField(const AttributionConfig& config, const RadarConfig& radar, const RangeAngleAxes& axes);

  const AttributionConfig& config() const { return config_; }
  const RangeAngleAxes& axes() const { return axes_; }
  Field field(int range_bin, int angle_bin) const {
    return range_field_[range_bin] ? angle_field_[angle_bin] : Field::kExcluded;
  }
  Field fieldAt(double range_m, double azimuth_rad) const;
  /// True where (range, azimuth) lies in the window around the centre; a bin is the least half width.
  bool inWindow(const MatchWindow& window, double center_range_m, double center_azimuth_rad, double range_m,
                double azimuth_rad) const;
  double halfRange_m(const MatchWindow& window) const;
  double halfAzimuth_rad(const MatchWindow& window, double center_azimuth_rad) const;
  /// Share of a record's amplitude that the signal chain puts into the map at a place, 0 to 1: the window's response at
  /// the record's range offset times the contributions c_k steered to the azimuth. Holds for paths whose departure and
  /// arrival differ, too. 0 for a record without contributions.
  double recordShare(const PathRecord& record, double range_m, double azimuth_rad) const;

  /// Power of a point response (1 at its peak) `range_bins` and `angle_bins` (of 64) away from it: the periodic Hann
  /// window's transform in range and the untapered array's (Dirichlet kernel of M elements) in angle.
  double pointResponse(double range_bins, double angle_bins) const;

  /// Normalises, clips and finds responses. Throws InputError where the map's shape or axes are not this field's, or
  /// the map holds no finite power among the evaluated cells.
  NormalisedMap normalise(const RangeAngleMap& map) const;

 private:
  std::vector<Response> findResponses(const RealGrid& relative_db) const;

  AttributionConfig config_;
  RangeAngleAxes axes_;
  int channels_ = 0;
  double range_bin_m_ = 0;
  double sine_bin_ = 0;
  std::vector<char> range_field_;   // [N] beyond the near range
  std::vector<Field> angle_field_;  // [64]
};

}  // namespace mmradartwin
