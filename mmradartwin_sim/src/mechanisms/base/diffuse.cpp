#include <algorithm>
#include <boost/functional/hash.hpp>
#include <cmath>
#include <optional>
#include <unordered_map>

#include "echoes/scatter_points.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "physics/elements_in_map.h"
#include "physics/polarisation.h"
#include "physics/reflections.h"
#include "rays/view_cone.h"

namespace mmradartwin {
namespace {

const std::string kDiffuse = "diffuse";

/// Integral of ((1 + cos psi)/2)^alpha over the hemisphere, psi from the specular direction.
/// Source: Degli-Esposti et al. 2007, eq. 12 (F_alpha).
double directiveNorm(int alpha, double cos_theta) {
  const double sin2 = 1 - cos_theta * cos_theta;
  double sum = 0, binomial = 1;
  for (int k = 0; k <= alpha; ++k) {
    double inner = 1;
    if (k % 2 == 1) {
      double term = 1;
      inner = 0;
      for (int w = 0; w <= (k - 1) / 2; ++w) {
        inner += term;
        term *= sin2 * (2.0 * w + 1) / (2.0 * w + 2);  // binom(2w,w)/4^w
      }
      inner *= cos_theta;
    }
    sum += binomial * 2 * M_PI / (k + 1) * inner;
    binomial *= static_cast<double>(alpha - k) / (k + 1);
  }
  return sum / std::pow(2.0, alpha);
}

class Diffuse : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kDiffuse; }

  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec alpha = numberSpec("alpha", "1", 1, 100, 4, "width of the directive lobe");
    alpha.kind = ParameterKind::kInteger;
    return {numberSpec("spacing_m", "m", 0.005, 5, 0.1, "mean distance of scatter points"),
            textSpec("lobe", false, "lambertian", "lambertian or directive"), alpha};
  }

  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    spacing_m_ = values.number("spacing_m");
    const std::string& lobe = values.text("lobe");
    if (lobe != "lambertian" && lobe != "directive") {
      throw InputError("mechanism diffuse: key lobe: '" + lobe + "' is unknown; allowed: lambertian, directive");
    }
    directive_ = lobe == "directive";
    alpha_ = static_cast<int>(values.number("alpha"));
  }

  void build(const Scene& scene, const RadarConfig& radar) override {
    points_ =
        makeScatterPoints(scene, spacing_m_, radar.center_frequency_hz(), kDiffuse, [](const Facet&) { return true; });
  }

  void sceneChanged(const Scene& scene, const RadarConfig& radar, const SceneChange& change) override {
    const auto moved = [&](const Facet& f) { return change.moved(f.actor); };
    points_.erase(std::remove_if(points_.begin(), points_.end(),
                                 [&](const ScatterPoint& p) { return moved(scene.facets[p.facet]); }),
                  points_.end());
    const std::vector<ScatterPoint> again =
        makeScatterPoints(scene, spacing_m_, radar.center_frequency_hz(), kDiffuse, moved);
    const auto kept = static_cast<std::ptrdiff_t>(points_.size());
    points_.insert(points_.end(), again.begin(), again.end());
    std::inplace_merge(points_.begin(), points_.begin() + kept, points_.end(),
                       [](const ScatterPoint& a, const ScatterPoint& b) { return a.facet < b.facet; });
  }
  bool tracesChanges() const override { return true; }

  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    const double spreading = context.radar.wavelength_m() / (4 * M_PI);
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    const double max2 = context.max_range_m * context.max_range_m;
    // Levels first, then visibility of all that has one: its rays run side by side.
    std::vector<const ScatterPoint*> lit;
    std::vector<Eigen::Vector3d> position, seen_along;
    std::vector<double> level, gap;
    const SceneChange* change = context.change;
    std::optional<ViewCones> changed;
    if (change) changed.emplace(elements.p, change->bounds);
    const auto touches = [&](const ScatterPoint& point) {
      if (change->moved(context.scene.facets[point.facet].actor)) return true;
      return changed->mayMeet(point.position - elements.p) && change->crosses(elements.p, point.position);
    };
    ScatterCells::CellSet* touched = change && context.cloud ? context.cloud->touched : nullptr;
    for (const ScatterPoint& point : points_) {
      if (touched && touches(point)) touched->insert(context.cloud->cellOf(point.facet, point.position));
    }
    for (const ScatterPoint& point : points_) {
      if (context.only_actor >= 0 && context.scene.facets[point.facet].actor != context.only_actor) continue;
      const Eigen::Vector3d way = point.position - elements.p;
      const double r2 = way.squaredNorm();
      if (r2 > max2 || r2 < 1e-6) continue;
      const double r = std::sqrt(r2);
      const Eigen::Vector3d direction_radar = to_radar * way / r;
      if (!context.inFieldOfView(direction_radar)) continue;
      const Facet& facet = context.scene.facets[point.facet];
      if (touched ? touched->count(context.cloud->cellOf(point.facet, point.position)) == 0
                  : change && !touches(point)) {
        continue;
      }
      if (!elements.sides.isOpen(facet, point.position, elements.p)) continue;
      const Eigen::Vector3d in = way / r;
      const double cosine = std::min(1.0, std::abs(in.dot(facet.normal)));
      const Material& material = context.scene.actors[facet.actor].material;
      const double te = verticalField(elements.up, in).dot(transverse(in, facet.normal));
      double amplitude = spreading / r2 *
                         backscatterAmplitude(material, cosine, std::min(1.0, te * te), context.frequency_hz) *
                         std::sqrt(point.area_m2 / M_PI);
      if (directive_ && cosine > 0) {
        // Monostatic: the specular direction lies 2 theta away, (1 + cos 2 theta)/2 = cos^2 theta; Lambert's cos/pi is
        // replaced.
        amplitude *= std::sqrt(M_PI * std::pow(cosine * cosine, alpha_) / (directiveNorm(alpha_, cosine) * cosine));
      }
      if (!(amplitude > 0)) continue;
      lit.push_back(&point);
      position.push_back(point.position);
      seen_along.push_back(direction_radar);
      level.push_back(amplitude);
      gap.push_back(std::max(1e-3, 2 * facet.flatness_m / std::max(0.1, cosine)));
    }
    std::vector<char> visible = context.rays.visible(elements.p, position, gap);
    if (context.cloud) sumCells(*context.cloud, lit, visible, level);
    records.reserve(records.size() + static_cast<std::size_t>(std::count(visible.begin(), visible.end(), 1)));
    for (std::size_t i = 0; i < lit.size(); ++i) {
      if (!visible[i]) continue;
      const Facet& facet = context.scene.facets[lit[i]->facet];
      PathRecord record;
      record.event = &kDiffuse;
      record.actors = {facet.actor};
      record.facets = {facet.id};
      record.vertices = {lit[i]->position};
      record.departure = record.arrival = seen_along[i];
      record.bounces = 1;
      record.length_m = elements.lengthsVia(lit[i]->position);
      setContribution(context.radar, std::polar(level[i], lit[i]->phase_rad(context.seed)), record);
      records.push_back(std::move(record));
    }
  }

  bool changeMaterials(const PoseContext& context, const std::vector<Material>& before,
                       std::vector<PathRecord>& records) const override {
    for (std::size_t i = 0; i < before.size(); ++i) {
      const auto scatters = [&](const Material& m) { return backscatterAmplitude(m, 1, 1, context.frequency_hz) > 0; };
      if (scatters(context.scene.actors[i].material) != scatters(before[i])) return false;
    }
    const ElementsInMap elements(context);
    for (PathRecord& record : records) {
      const MaterialsOfPath materials(context.scene, before, record);
      if (!materials.changed) continue;
      const Eigen::Vector3d in = (record.vertices[0] - elements.p).normalized();
      const Eigen::Vector3d& normal = context.scene.facets[static_cast<std::size_t>(record.facets[0])].normal;
      const double cosine = std::min(1.0, std::abs(in.dot(normal)));
      const double te = verticalField(elements.up, in).dot(transverse(in, normal));
      const auto level = [&](const Material& m) {
        return backscatterAmplitude(m, cosine, std::min(1.0, te * te), context.frequency_hz);
      };
      scaleRecord(level(*materials.now[0]) / level(*materials.before[0]), record);
    }
    return true;
  }

 private:
  /// Leaves one point of each cell, with the level of all.
  static void sumCells(const ScatterCells& cells, const std::vector<const ScatterPoint*>& points,
                       std::vector<char>& visible, std::vector<double>& level) {
    std::vector<Eigen::Vector3d> positions;
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!visible[i]) continue;
      seen.push_back(i);
      positions.push_back(points[i]->position);
    }
    const std::vector<char> side = cells.sides ? cells.sides(positions) : std::vector<char>(seen.size(), 0);
    struct Cell {
      double power = 0;
      Eigen::Array3d place = Eigen::Array3d::Zero();  // weighted by power
      std::size_t nearest = 0;
      double distance = 1e300;
    };
    using Key = std::pair<ScatterCells::Cell, char>;
    std::unordered_map<Key, std::size_t, boost::hash<Key>> number;
    std::vector<Cell> all;
    std::vector<std::size_t> cell_of;
    std::vector<Eigen::Array3d> place;
    for (std::size_t j = 0; j < seen.size(); ++j) {
      place.push_back(cells.placeOf(positions[j]));
      const Key key{cells.cellOf(points[seen[j]]->facet, positions[j]), side[j]};
      const auto [known, fresh] = number.try_emplace(key, all.size());
      if (fresh) all.emplace_back();
      const double power = level[seen[j]] * level[seen[j]];
      all[known->second].power += power;
      all[known->second].place += power * place.back();
      cell_of.push_back(known->second);
    }
    for (std::size_t j = 0; j < seen.size(); ++j) {
      Cell& cell = all[cell_of[j]];
      const double distance = (place[j] - cell.place / cell.power).square().sum();
      if (distance >= cell.distance) continue;
      cell.distance = distance;
      cell.nearest = seen[j];
    }
    for (std::size_t i : seen) visible[i] = 0;
    for (const Cell& cell : all) {
      visible[cell.nearest] = 1;
      level[cell.nearest] = std::sqrt(cell.power);
    }
  }

  double spacing_m_ = 0.1;
  bool directive_ = false;
  int alpha_ = 4;
  std::vector<ScatterPoint> points_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Diffuse)

}  // namespace mmradartwin
