#include "mmradartwin_attribution/response.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <string>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

// |sin(n pi x) / (n sin(pi x))|, 1 at x = 0.
double dirichlet(int n, double x) {
  const double denominator = std::sin(M_PI * x);
  if (std::abs(denominator) < 1e-12) return 1.0;
  return std::abs(std::sin(n * M_PI * x) / (n * denominator));
}

// Offset of the vertex of the parabola through three equidistant values, in steps, at most half a step.
double vertex(double before, double at, double after) {
  const double curvature = before - 2 * at + after;
  if (!(curvature < 0) || !std::isfinite(curvature)) return 0;
  return std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5);
}

double wrapped(double x, double period) { return x - period * std::round(x / period); }

}  // namespace

EvaluationField::EvaluationField(const AttributionConfig& config, const RadarConfig& radar, const RangeAngleAxes& axes)
    : config_(config),
      axes_(axes),
      channels_(static_cast<int>(radar.virtualLine().channels.size())),
      range_bin_m_(radar.range_bin_m()) {
  sine_bin_ = radar.wavelength_m() / (2 * radar.virtual_pitch_m()) / (kAngleBins / 2);
  bool any_range = false, any_angle = false;
  for (double r : axes_.range_m) {
    range_field_.push_back(r > config_.min_range_m);
    any_range = any_range || range_field_.back();
  }
  for (double a : axes_.azimuth_rad) {
    Field f = Field::kExcluded;
    if (std::abs(a) <= config_.max_azimuth_rad) {
      f = Field::kCentral;
    } else if (std::abs(a) <= config_.outer_azimuth_rad) {
      f = Field::kOuter;
    }
    any_angle = any_angle || f == Field::kCentral;
    angle_field_.push_back(f);
  }
  if (!any_range || !any_angle) {
    throw InputError("attribution: no cell of the map lies beyond min_range_m " + std::to_string(config_.min_range_m) +
                     " and within max_azimuth_deg; widen them or check the radar's description");
  }
}

Field EvaluationField::fieldAt(double range_m, double azimuth_rad) const {
  if (!(range_m > config_.min_range_m)) return Field::kExcluded;
  if (std::abs(azimuth_rad) <= config_.max_azimuth_rad) return Field::kCentral;
  return std::abs(azimuth_rad) <= config_.outer_azimuth_rad ? Field::kOuter : Field::kExcluded;
}

double EvaluationField::halfRange_m(const MatchWindow& window) const { return std::max(window.range_m, range_bin_m_); }

double EvaluationField::halfAzimuth_rad(const MatchWindow& window, double center_azimuth_rad) const {
  const double cosine = std::max(std::cos(center_azimuth_rad), 0.1);
  return std::max(window.azimuth_rad, sine_bin_ / cosine);
}

bool EvaluationField::inWindow(const MatchWindow& window, double center_range_m, double center_azimuth_rad,
                               double range_m, double azimuth_rad) const {
  return std::abs(range_m - center_range_m) <= halfRange_m(window) &&
         std::abs(azimuth_rad - center_azimuth_rad) <= halfAzimuth_rad(window, center_azimuth_rad);
}

double EvaluationField::recordShare(const PathRecord& record, double range_m, double azimuth_rad) const {
  if (record.c.empty() || !(record.amplitude > 0)) return 0;
  const double range_bins = (record.length_m.front() / 2 - range_m) / range_bin_m_;
  if (std::abs(range_bins) > 1) return 0;
  // exp(+j 2 pi d k sin/lambda): a bin of the sine turns the element k by 2 pi k/64.
  const double step = 2 * M_PI * std::sin(azimuth_rad) / sine_bin_ / kAngleBins;
  std::complex<double> sum = 0;
  for (std::size_t k = 0; k < record.c.size(); ++k) sum += record.c[k] * std::polar(1.0, step * static_cast<double>(k));
  return std::abs(sum) / (static_cast<double>(record.c.size()) * record.amplitude) *
         std::sqrt(pointResponse(range_bins, 0));
}

double EvaluationField::pointResponse(double range_bins, double angle_bins) const {
  const double d = wrapped(range_bins, static_cast<double>(axes_.range_m.size()));
  // Hann: sinc(d)/(1 - d^2) for N >> d; 1/2 at |d| = 1.
  double range_part = 1;
  if (std::abs(std::abs(d) - 1) < 1e-6) {
    range_part = 0.5;
  } else if (std::abs(d) > 1e-9) {
    range_part = std::sin(M_PI * d) / (M_PI * d) / (1 - d * d);
  }
  const double angle_part = dirichlet(channels_, wrapped(angle_bins, kAngleBins) / kAngleBins);
  return range_part * range_part * angle_part * angle_part;
}

NormalisedMap EvaluationField::normalise(const RangeAngleMap& map) const {
  const int ranges = static_cast<int>(axes_.range_m.size()), angles = static_cast<int>(axes_.azimuth_rad.size());
  if (map.power_db.rows() != ranges || map.power_db.cols() != angles) {
    throw InputError("range-angle map has " + std::to_string(map.power_db.rows()) + " x " +
                     std::to_string(map.power_db.cols()) + " cells, the radar's have " + std::to_string(ranges) +
                     " x " + std::to_string(angles) + ": both branches need the same radar");
  }
  for (int i = 0; i < ranges; ++i) {
    if (std::abs(map.axes.range_m.at(i) - axes_.range_m[i]) > 1e-6) {
      throw InputError("range-angle map: range bin " + std::to_string(i) + " lies at " +
                       std::to_string(map.axes.range_m.at(i)) + " m, the radar's at " +
                       std::to_string(axes_.range_m[i]) + " m: both branches need the same radar");
    }
  }
  for (int i = 0; i < angles; ++i) {
    const double a = map.axes.azimuth_rad.at(i), b = axes_.azimuth_rad[i];
    if (std::isnan(a) != std::isnan(b) || std::abs(a - b) > 1e-6) {
      throw InputError("range-angle map: azimuth bin " + std::to_string(i) +
                       " differs from the radar's: both branches need the same radar");
    }
  }
  NormalisedMap result;
  double peak = -std::numeric_limits<double>::infinity();
  for (int r = 0; r < ranges; ++r) {
    for (int a = 0; a < angles; ++a) {
      const double v = map.power_db(r, a);
      if (field(r, a) == Field::kCentral && std::isfinite(v)) peak = std::max(peak, v);
    }
  }
  if (!std::isfinite(peak)) {
    throw InputError("range-angle map holds no power beyond the near range and within the field of view");
  }
  result.peak_db = peak;
  const RealGrid relative = (map.power_db.array() - peak).matrix();
  result.level_db = relative.unaryExpr(
      [this](double v) { return std::isnan(v) ? config_.floor_db : std::clamp(v, config_.floor_db, 0.0); });
  result.responses = findResponses(relative);
  return result;
}

std::vector<Response> EvaluationField::findResponses(const RealGrid& relative_db) const {
  struct Candidate {
    double level_db, range_bin, angle_bin;
    Response response;
  };
  const int ranges = static_cast<int>(relative_db.rows()), angles = static_cast<int>(relative_db.cols());
  const double lowest = -1e9;
  const double highest = 1e9;
  const auto at = [&](int r, int a) {
    if (r < 0 || r >= ranges) return lowest;
    const int column = (a + angles) % angles;  // the sine axis is periodic
    const double v = relative_db(r, column);
    // Beside a cell that is masked nothing is known to be a maximum; a column without an angle has no cells.
    if (std::isnan(v) && !std::isnan(axes_.azimuth_rad[column])) return highest;
    return std::isfinite(v) ? v : lowest;
  };
  std::vector<Candidate> candidates;
  for (int r = 0; r < ranges; ++r) {
    for (int a = 0; a < angles; ++a) {
      const double v = at(r, a);
      if (v < config_.floor_db || v == highest) continue;
      bool maximum = true;
      for (int dr = -1; dr <= 1 && maximum; ++dr) {
        for (int da = -1; da <= 1 && maximum; ++da) {
          if (dr == 0 && da == 0) continue;
          const bool earlier = dr < 0 || (dr == 0 && da < 0);  // the first cell of a plateau is its maximum
          maximum = earlier ? v > at(r + dr, a + da) : v >= at(r + dr, a + da);
        }
      }
      if (!maximum) continue;
      Candidate c;
      c.level_db = v;
      // At the borders of the range axis there is no second neighbour to interpolate with.
      c.range_bin = r + (r > 0 && r + 1 < ranges ? vertex(at(r - 1, a), v, at(r + 1, a)) : 0.0);
      c.angle_bin = a + vertex(at(r, a - 1), v, at(r, a + 1));
      c.response.range_bin = r;
      c.response.angle_bin = a;
      c.response.range_m = c.range_bin * range_bin_m_;
      c.response.azimuth_rad = std::asin(std::clamp((c.angle_bin - kAngleBins / 2) * sine_bin_, -1.0, 1.0));
      c.response.level_db = std::clamp(v, config_.floor_db, 0.0);
      c.response.field = field(r, a);
      candidates.push_back(c);
    }
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.level_db > b.level_db; });
  std::vector<Candidate> accepted;
  std::vector<Response> responses;
  for (const Candidate& c : candidates) {
    double predicted = 0;  // power expected of the stronger responses, whose phases are unknown
    for (const Candidate& s : accepted) {
      const double own = pointResponse(s.response.range_bin - s.range_bin, s.response.angle_bin - s.angle_bin);
      const double here = pointResponse(c.response.range_bin - s.range_bin, c.response.angle_bin - s.angle_bin);
      predicted += std::pow(10.0, s.level_db / 10) * here / own;
    }
    if (predicted > 0 && c.level_db < 10 * std::log10(predicted) + config_.response_margin_db) continue;
    accepted.push_back(c);
    if (c.response.field != Field::kExcluded) responses.push_back(c.response);
  }
  return responses;
}

}  // namespace mmradartwin
