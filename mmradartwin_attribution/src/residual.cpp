#include "mmradartwin_attribution/residual.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace mmradartwin {
namespace {

double power(double level_db) { return std::pow(10.0, level_db / 10); }

using CellFlags = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Cells whose level is known in both maps.
CellFlags knownInBoth(const RangeAngleMap& measured, const RangeAngleMap& simulated) {
  return !(measured.power_db.array().isNaN() || simulated.power_db.array().isNaN());
}

// Assigns each response that the branches do not share to one residual class (docs/reference/contracts.md section 6).
class ResidualClassifier {
 public:
  ResidualClassifier(const EvaluationField& field, const CellFlags& known, const std::vector<PathRecord>& records,
                     PoseAttribution& pose)
      : field_(field), config_(field.config()), known_(known), records_(records), pose_(pose) {}

  void run() {
    for (const Response& m : pose_.measured.responses) {
      if (m.field == Field::kCentral && m.level_db >= config_.strong_db) classifyMeasured(m);
    }
    for (const Response& s : pose_.simulated.responses) {
      if (s.field == Field::kCentral && s.level_db >= config_.strong_db) classifySimulated(s);
    }
  }

 private:
  bool at(const MatchWindow& window, const ResponseRegion& region, const Response& response) const {
    return field_.inWindow(window, region.range_m, region.azimuth_rad, response.range_m, response.azimuth_rad);
  }

  double distance(const ResponseRegion& region, const Response& response) const {
    return std::hypot(
        (response.range_m - region.range_m) / field_.halfRange_m(config_.wide),
        (response.azimuth_rad - region.azimuth_rad) / field_.halfAzimuth_rad(config_.wide, region.azimuth_rad));
  }

  // True where a simulated response supports a region: it lies in the region's wide window, and in another region's
  // tight window only if it lies in this region's tight window, too.
  bool countsFor(int region, const Response& simulated) const {
    if (!at(config_.wide, pose_.regions[region], simulated)) return false;
    if (at(config_.tight, pose_.regions[region], simulated)) return true;
    for (std::size_t other = 0; other < pose_.regions.size(); ++other) {
      if (static_cast<int>(other) != region && at(config_.tight, pose_.regions[other], simulated)) return false;
    }
    return true;
  }

  void classifyMeasured(const Response& m) {
    if (!known_(m.range_bin, m.angle_bin)) return;
    for (const Response& s : pose_.simulated.responses) {
      if (s.level_db >= config_.strong_db &&
          field_.inWindow(config_.tight, m.range_m, m.azimuth_rad, s.range_m, s.azimuth_rad)) {
        return;
      }
    }
    ResidualClass best = ResidualClass::kMissingMechanism;
    int best_region = -1;
    for (std::size_t i = 0; i < pose_.regions.size(); ++i) {
      const ResponseRegion& region = pose_.regions[i];
      if (!at(config_.tight, region, m)) continue;
      if (region.simulated_strong) return;  // the region is matched, its support not weak
      bool any = false, tight = false;
      for (const Response& s : pose_.simulated.responses) {
        if (s.level_db < config_.weak_db || !countsFor(static_cast<int>(i), s)) continue;
        any = true;
        tight = tight || at(config_.tight, region, s);
      }
      const ResidualClass c = !any    ? ResidualClass::kMissingSupport
                              : tight ? ResidualClass::kWeakSupport
                                      : ResidualClass::kShiftedResponse;
      if (c < best || (c == best && distance(region, m) < distance(pose_.regions[best_region], m))) {
        best = c;
        best_region = static_cast<int>(i);
      }
    }
    add(m, true, best, best_region);
  }

  void classifySimulated(const Response& s) {
    if (!known_(s.range_bin, s.angle_bin)) return;
    if (pose_.measured.level_db(s.range_bin, s.angle_bin) >= config_.weak_db) return;
    int nearest = -1;
    for (std::size_t i = 0; i < pose_.regions.size(); ++i) {
      if (at(config_.wide, pose_.regions[i], s) &&
          (nearest < 0 || distance(pose_.regions[i], s) < distance(pose_.regions[nearest], s))) {
        nearest = static_cast<int>(i);
      }
    }
    const bool normalises = s.level_db >= 0;
    ResidualClass c = ResidualClass::kUnsupportedAnchor;
    if (nearest >= 0 && !normalises) {
      for (const Response& m : pose_.measured.responses) {
        if (m.level_db >= config_.weak_db && at(config_.wide, pose_.regions[nearest], m)) {
          c = ResidualClass::kShiftedResponse;
        }
      }
    }
    add(s, false, c, nearest);
  }

  void add(const Response& response, bool measured_stronger, ResidualClass c, int region) {
    Residual r;
    r.residual_class = c;
    r.measured_stronger = measured_stronger;
    r.range_m = response.range_m;
    r.azimuth_rad = response.azimuth_rad;
    r.measured_db = pose_.measured.level_db(response.range_bin, response.angle_bin);
    r.simulated_db = pose_.simulated.level_db(response.range_bin, response.angle_bin);
    r.region = region;
    if (region >= 0) {
      r.actor = pose_.regions[region].actor;
      r.material = pose_.regions[region].material;
    }
    r.records = recordsInCell(field_, records_, r.range_m, r.azimuth_rad);
    ++pose_.central.class_count[static_cast<int>(c) - 1];
    pose_.residuals.push_back(std::move(r));
  }

  const EvaluationField& field_;
  const AttributionConfig& config_;
  const CellFlags& known_;
  const std::vector<PathRecord>& records_;
  PoseAttribution& pose_;
};

void markRegions(const EvaluationField& field, PoseAttribution& pose) {
  const AttributionConfig& config = field.config();
  for (ResponseRegion& region : pose.regions) {
    const auto strongIn = [&](const NormalisedMap& map) {
      return std::any_of(map.responses.begin(), map.responses.end(), [&](const Response& r) {
        return r.level_db >= config.strong_db &&
               field.inWindow(config.tight, region.range_m, region.azimuth_rad, r.range_m, r.azimuth_rad);
      });
    };
    region.measured_strong = strongIn(pose.measured);
    region.simulated_strong = strongIn(pose.simulated);
    if (!region.measured_strong || region.field == Field::kExcluded) continue;
    FieldMetrics& metrics = region.field == Field::kCentral ? pose.central : pose.outer;
    const int band = region.range_m <= config.near_limit_m ? 0 : region.range_m <= config.far_limit_m ? 1 : 2;
    ++metrics.active[band];
    if (region.simulated_strong) ++metrics.recalled[band];
  }
}

void compareCells(const EvaluationField& field, Field which, const CellFlags& known, const PoseAttribution& pose,
                  FieldMetrics& metrics) {
  const AttributionConfig& config = field.config();
  const RangeAngleAxes& axes = field.axes();
  double measured_all = 0, simulated_all = 0, q1 = 0, q2 = 0;
  metrics.measured_peak_db = config.floor_db;
  for (int r = 0; r < pose.measured.level_db.rows(); ++r) {
    for (int a = 0; a < pose.measured.level_db.cols(); ++a) {
      if (field.field(r, a) != which || !known(r, a)) continue;
      const double m = pose.measured.level_db(r, a), s = pose.simulated.level_db(r, a);
      metrics.measured_peak_db = std::max(metrics.measured_peak_db, m);
      measured_all += power(m);
      simulated_all += power(s);
      const bool m_strong = m >= config.strong_db, s_strong = s >= config.strong_db;
      const bool m_weak = m < config.weak_db, s_weak = s < config.weak_db;
      if (m_strong && s_weak) {
        q1 += power(m);
        ++metrics.q1_cells;
      } else if (s_strong && m_weak) {
        q2 += power(s);
        ++metrics.q2_cells;
      } else if (m_strong && s_strong) {
        const bool expected = std::any_of(pose.regions.begin(), pose.regions.end(), [&](const ResponseRegion& region) {
          return field.inWindow(config.tight, region.range_m, region.azimuth_rad, axes.range_m[r], axes.azimuth_rad[a]);
        });
        if (expected) metrics.q3_db.push_back(s - m);
      } else if (m_weak && s_weak) {
        metrics.q4_sum_db += std::abs(s - m);
        ++metrics.q4_cells;
      }
    }
  }
  metrics.q1_energy = measured_all > 0 ? q1 / measured_all : 0;
  metrics.q2_energy = simulated_all > 0 ? q2 / simulated_all : 0;
}

void compareTop(const EvaluationField& field, Field which, const PoseAttribution& pose, FieldMetrics& metrics) {
  const auto strongest = [&](const NormalisedMap& map, int k) {
    std::vector<const Response*> top;
    for (const Response& r : map.responses) {
      if (static_cast<int>(top.size()) == k) break;
      if (r.field == which) top.push_back(&r);
    }
    return top;
  };
  for (std::size_t i = 0; i < metrics.top_hits.size(); ++i) {
    const auto measured = strongest(pose.measured, field.config().top_k[i]);
    const auto simulated = strongest(pose.simulated, field.config().top_k[i]);
    metrics.top_count[i] = static_cast<int>(measured.size());
    for (const Response* m : measured) {
      metrics.top_hits[i] += std::any_of(simulated.begin(), simulated.end(), [&](const Response* s) {
        return field.inWindow(field.config().agreement, m->range_m, m->azimuth_rad, s->range_m, s->azimuth_rad);
      });
    }
  }
}

}  // namespace

std::string className(ResidualClass c) { return "C" + std::to_string(static_cast<int>(c)); }

const std::string& classLabel(ResidualClass c) {
  static const std::string labels[] = {"missing support", "weak support", "unsupported anchor", "shifted response",
                                       "missing mechanism"};
  return labels[static_cast<int>(c) - 1];
}

const std::string& classAction(ResidualClass c) {
  static const std::string actions[] = {
      "repair scene geometry or collision proxy, check the actor's presence, or change trace coverage",
      "update material or RCS level of the actor's tagged material",
      "handle the system response: near-field gating, normalisation review or antenna-response modelling",
      "correct pose or geometry placement, review beamforming and angle convention",
      "mechanism-extension target: outside the current path basis"};
  return actions[static_cast<int>(c) - 1];
}

std::vector<int> recordsInCell(const EvaluationField& field, const std::vector<PathRecord>& records, double range_m,
                               double azimuth_rad) {
  std::vector<std::pair<double, int>> found;  // amplitude that the record alone puts into the cell
  double strongest = 0;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const double share = field.recordShare(records[i], range_m, azimuth_rad);
    if (share < 0.5) continue;
    found.emplace_back(share * records[i].amplitude, static_cast<int>(i));
    strongest = std::max(strongest, found.back().first);
  }
  const double least = strongest * std::pow(10.0, -field.config().record_span_db / 20);
  std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<int> indices;
  for (const auto& [amplitude, index] : found) {
    if (amplitude >= least) indices.push_back(index);
  }
  return indices;
}

ConventionCheck checkConvention(const EvaluationField& field, const RangeAngleMap& measured,
                                const RangeAngleMap& simulated) {
  const int ranges = static_cast<int>(measured.power_db.rows()), angles = static_cast<int>(measured.power_db.cols());
  const RealGrid m = measured.power_db.unaryExpr([](double v) { return std::isfinite(v) ? power(v) : 0.0; });
  const RealGrid s = simulated.power_db.unaryExpr([](double v) { return std::isfinite(v) ? power(v) : 0.0; });
  const auto agreement = [&](bool mirror_range, bool mirror_azimuth) {
    double cross = 0, measured_sum = 0, simulated_sum = 0;
    for (int r = 0; r < ranges; ++r) {
      for (int a = 0; a < angles; ++a) {
        if (field.field(r, a) != Field::kCentral) continue;
        const double x = m(mirror_range ? (ranges - r) % ranges : r, mirror_azimuth ? (angles - a) % angles : a);
        cross += std::sqrt(x * s(r, a));
        measured_sum += x;
        simulated_sum += s(r, a);
      }
    }
    const double norm = std::sqrt(measured_sum * simulated_sum);
    return norm > 0 ? cross / norm : 0.0;
  };
  return {agreement(false, false), agreement(false, true), agreement(true, true)};
}

PoseAttribution attributePose(const EvaluationField& field, const RangeAngleMap& measured,
                              const RangeAngleMap& simulated, std::vector<ResponseRegion> regions,
                              const std::vector<PathRecord>& records) {
  PoseAttribution pose;
  pose.measured = field.normalise(measured);
  pose.simulated = field.normalise(simulated);
  pose.regions = std::move(regions);
  markRegions(field, pose);
  const CellFlags known = knownInBoth(measured, simulated);
  compareCells(field, Field::kCentral, known, pose, pose.central);
  compareCells(field, Field::kOuter, known, pose, pose.outer);
  compareTop(field, Field::kCentral, pose, pose.central);
  compareTop(field, Field::kOuter, pose, pose.outer);
  ResidualClassifier(field, known, records, pose).run();
  pose.residual_db = pose.simulated.level_db - pose.measured.level_db;
  for (int r = 0; r < pose.residual_db.rows(); ++r) {
    for (int a = 0; a < pose.residual_db.cols(); ++a) {
      if (field.field(r, a) == Field::kCentral && known(r, a)) continue;
      pose.residual_db(r, a) = std::numeric_limits<double>::quiet_NaN();
    }
  }
  pose.convention = checkConvention(field, measured, simulated);
  return pose;
}

}  // namespace mmradartwin
