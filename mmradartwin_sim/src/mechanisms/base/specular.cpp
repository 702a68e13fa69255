#include <atomic>
#include <cmath>

#include "corners/corner_in_walls.h"
#include "echoes/curved_echo.h"
#include "echoes/image_record.h"
#include "edges/grazed_edges.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "physics/aperture.h"
#include "physics/elements_in_map.h"
#include "physics/polarisation.h"
#include "physics/reflections.h"
#include "rays/image_paths.h"
#include "records/path_phase.h"

namespace mmradartwin {
namespace {

const std::string kSpecular = "specular";
constexpr double kInset_m = 0.01;  // where a return beside a facet is taken to come from
constexpr double kSmallestFactor = 0.01;
constexpr double kNegligible = 1e-9;  // amplitude of a path that no map shows
constexpr double kMostWays = 2e6;     // edges times sequences of mirrors that are tried at a pose

class Specular : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kSpecular; }

  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec bounces = numberSpec("max_bounces", "1", 0, 8, 3, "highest order of reflection");
    bounces.kind = ParameterKind::kInteger;
    ParameterSpec budget = numberSpec("ray_budget", "1", 0, 1e7, 20000,
                                      "rays launched per pose to seed the orders that cannot be searched exhaustively");
    budget.kind = ParameterKind::kInteger;
    return {bounces, numberSpec("power_cutoff_db", "dB", -400, 0, -200, "paths with 20 log10(A_p) below are dropped"),
            budget,
            integerSpec(
                "knife_edges", "1", 0, 1, 0,
                "1: edges within a Fresnel zone weigh a path, and echoes have exact paths; 0: they hide by 0 or 1")};
  }

  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    max_bounces_ = static_cast<int>(values.number("max_bounces"));
    ray_budget_ = static_cast<int>(values.number("ray_budget"));
    knife_edges_ = values.number("knife_edges") > 0.5;
    cutoff_ = std::pow(10.0, values.number("power_cutoff_db") / 20);
  }

  void build(const Scene& scene, const RadarConfig&) override {
    search_ = std::make_unique<ImageSearch>(scene);
    if (knife_edges_) grazed_ = std::make_unique<GrazedEdges>(scene);
    exhaustive_ = std::min(max_bounces_, search_->exhaustiveOrder());
    findEdges(scene);
  }

  void sceneChanged(const Scene& scene, const RadarConfig&, const SceneChange& change) override {
    search_->update(change.actors);
    if (knife_edges_) grazed_ = std::make_unique<GrazedEdges>(scene);
    exhaustive_ = std::min(max_bounces_, search_->exhaustiveOrder());
    findEdges(scene);
  }

  std::vector<std::string> notes() const override {
    std::vector<std::string> notes;
    if (exhaustive_ < max_bounces_ && !(max_bounces_ > 3 && exhaustive_ == 3)) {
      notes.push_back("specular: " + std::to_string(search_->reflectors().size()) +
                      " facets are too many to try all sequences of more than " + std::to_string(exhaustive_) +
                      "; higher orders come from " + std::to_string(ray_budget_) + " launched rays per pose");
    }
    for (int walls = 1; 2 * walls + 2 <= max_bounces_; ++walls) {
      if (waysOver(walls) <= kMostWays) continue;
      notes.push_back("specular: " + std::to_string(edges_.size()) + " corners are too many to look for them in " +
                      std::to_string(walls) + " mirror(s); paths of " + std::to_string(2 * walls + 2) +
                      " bounces over a corner are left out");
      break;
    }
    if (seeded_poses_ > 0) {
      notes.push_back("specular: launched rays found " + std::to_string(seeded_paths_) + " paths at " +
                      std::to_string(seeded_poses_) + " poses, " +
                      (late_paths_ == 0
                           ? "half as many rays would have found the same"
                           : std::to_string(late_paths_) +
                                 " of them only when the rays were doubled; raise ray_budget until none is"));
    }
    return notes;
  }

  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    if (max_bounces_ < 1) return;
    const ElementsInMap elements(context);
    const int only = context.only_actor;
    for (int id : search_->reflectors()) {
      if (only < 0 || context.scene.facets[id].actor == only) {
        addFirstOrder(context, elements, context.scene.facets[id], records);
      }
    }
    for (std::size_t i = 0; i < context.scene.curved.size(); ++i) {
      if (only < 0 || context.scene.curved[i].actor == only) {
        addCurved(context, elements, static_cast<int>(i), records);
      }
    }
    if (max_bounces_ < 2) return;
    ImageSearch::Limits limits;
    limits.max_order = exhaustive_;
    limits.max_length_m = 2 * context.max_range_m;
    limits.forward = context.T_map_radar.linear().col(0);
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    limits.only_actor = only;
    if (grazed_) {
      limits.wavelength_m = context.radar.wavelength_m();
      limits.passes = [&](const PathLeg& leg) { return grazed_->passes(leg, limits.wavelength_m); };
    }
    limits.in_view = [&](const Eigen::Vector3d& d) { return context.inFieldOfView(to_radar * d); };
    if (exhaustive_ >= 2) {
      for (const ImagePath& path : search_->find(elements.p, context.rays, limits, 2))
        addImageRecord(context, elements, path, {kSpecular, 1}, cutoff_, records, grazed_.get());
    }
    addCornersInWalls(context, elements, limits, records);
    if (exhaustive_ < max_bounces_ && ray_budget_ > 0) {
      limits.max_order = max_bounces_;
      ImagePath path;
      ++seeded_poses_;
      for (const auto& [sequence, by_half] : search_->seeds(elements.p, context.rays, limits, ray_budget_,
                                                            context.T_map_radar.linear(), 20 * M_PI / 180)) {
        if (static_cast<int>(sequence.size()) <= std::max(1, exhaustive_)) continue;
        if (sequence.size() == 2 && perpendicular(context.scene.facets[sequence[0]], context.scene.facets[sequence[1]]))
          continue;
        if (!search_->solve(elements.p, sequence, context.rays, limits, path)) continue;
        const std::size_t before = records.size();
        addImageRecord(context, elements, path, {kSpecular, 1}, cutoff_, records, grazed_.get());
        if (records.size() == before) continue;
        ++seeded_paths_;
        late_paths_ += !by_half;
      }
    }
  }

  bool changeMaterials(const PoseContext& context, const std::vector<Material>& before,
                       std::vector<PathRecord>& records) const override {
    if (cutoff_ > kNegligible) return false;  // paths that were too weak may be there now
    const ElementsInMap elements(context);
    for (PathRecord& record : records) {
      const MaterialsOfPath materials(context.scene, before, record);
      if (!materials.changed) continue;
      if (record.facets.size() == 1) {
        // Also beside a facet and on a curved surface the level is that of the perpendicular.
        if (!replaceReflection(perpendicularReflection(*materials.before[0], context.frequency_hz),
                               perpendicularReflection(*materials.now[0], context.frequency_hz), record)) {
          return false;
        }
        continue;
      }
      PerInteraction<Eigen::Vector3d> normals;
      Eigen::Vector3d from = elements.p, to = elements.p;  // the radar as its first and its last mirror shows it
      for (std::size_t i = 0; i < record.facets.size(); ++i) {
        const Facet& facet = context.scene.facets[static_cast<std::size_t>(record.facets[i])];
        if (i > 0 && record.vertices[i] == record.vertices[i - 1]) return false;  // a corner's edge is one mirror
        normals.push_back(facet.normal);
        to = mirror(to, facet);
        from =
            mirror(from, context.scene.facets[static_cast<std::size_t>(record.facets[record.facets.size() - 1 - i])]);
      }
      const auto level = [&](const PerInteraction<const Material*>& of) {
        return reflectionOf(elements.up, (from - elements.p).normalized(), (to - elements.p).normalized(), normals, of,
                            context.frequency_hz);
      };
      if (!replaceReflection(level(materials.before), level(materials.now), record)) return false;
    }
    return true;
  }

 private:
  /// Edges that are seen in mirrors from four bounces on.
  void findEdges(const Scene& scene) {
    edges_.clear();
    if (max_bounces_ < 4) return;
    edges_ = findCornerEdges(
        scene, kFacesMeet_m, [](const Facet& f) { return f.reflects; },
        [](const Facet&, const Facet&) { return true; });
  }

  /// Ways that are tried at a pose to find the edges in so many mirrors.
  double waysOver(int walls) const {
    return static_cast<double>(edges_.size()) * std::pow(static_cast<double>(search_->reflectors().size()), walls);
  }

  void addCornersInWalls(const PoseContext& context, const ElementsInMap& elements, const ImageSearch::Limits& limits,
                         std::vector<PathRecord>& records) const {
    for (int walls = 1; 2 * walls + 2 <= max_bounces_ && waysOver(walls) <= kMostWays; ++walls) {
      for (const CornerInWalls& corner :
           findCornersInWalls(context, elements, edges_, search_->reflectors(), walls, limits)) {
        addCornerInWalls(context, elements, corner, {kSpecular, 1}, cutoff_, records);
      }
    }
  }

  void addFirstOrder(const PoseContext& context, const ElementsInMap& elements, const Facet& facet,
                     std::vector<PathRecord>& records) const {
    const double signed_distance = facet.planeDistance(elements.p), R = std::abs(signed_distance);
    if (R < 1e-6 || R > context.max_range_m) return;
    const double wavelength = context.radar.wavelength_m();
    const Eigen::Vector3d foot = elements.p - signed_distance * facet.normal;
    const Eigen::Vector3d middle = facet.origin + 0.5 * (facet.size1_m * facet.e1 + facet.size2_m * facet.e2);
    const double radius = 0.5 * std::hypot(facet.size1_m, facet.size2_m);
    const double away = (foot - middle).norm();
    if (away > radius) {
      // Bounds of |factor|: the angle the facet fills as seen from the foot, twice over 2 pi, and its area in Fresnel
      // units.
      if (2 * std::asin(radius / away) < M_PI * kSmallestFactor) return;
      if (2 * facet.area_m2 / (wavelength * R) < kSmallestFactor) return;
      if (2 * (away - radius) / std::sqrt(wavelength * R) > 60) return;
    }
    const bool inside = facet.contains(foot);
    const Eigen::Vector3d vertex = inside ? foot : facet.nearest(foot, kInset_m);
    const Eigen::Vector3d way = vertex - elements.p;
    const double distance = way.norm();
    if (distance > context.max_range_m) return;
    const Eigen::Vector3d direction = way / distance;
    const Eigen::Vector3d direction_radar = context.T_map_radar.linear().transpose() * direction;
    if (!context.inFieldOfView(direction_radar)) return;
    if (!elements.sides.isOpen(facet, vertex, elements.p)) return;
    PathLegs legs;
    if (grazed_) legs = legsOf(context.scene, elements.p, {facet.id}, {vertex});
    if (!context.rays.visible(elements.p, vertex, legGap(facet, direction)) &&
        !(grazed_ && grazed_->passes(legs[0], wavelength))) {
      return;
    }
    const Eigen::Vector3d straight =
        -signed_distance / R * facet.normal;  // the image's direction, also beside the facet
    std::complex<double> factor =
        knife_edges_ ? echoFactor(facet, foot, R, wavelength) : apertureFactor(facet, foot, straight, R, R, wavelength);
    if (std::abs(factor) < kSmallestFactor) return;
    if (grazed_) factor *= grazed_->factor(context, legs);
    if (std::abs(factor) < kSmallestFactor) return;

    const Material& material = context.scene.actors[facet.actor].material;
    const Eigen::Vector3d e = verticalField(elements.up, straight);
    const ComplexVector back =
        reflectField(e.cast<std::complex<double>>(), straight, facet.normal, material, context.frequency_hz);
    const std::complex<double> gamma = (e.cast<std::complex<double>>().transpose() * back)(0);
    std::complex<double> coefficient = wavelength / (4 * M_PI * 2 * R) * specularShare(material) * gamma * factor;
    if (std::abs(coefficient) < cutoff_) return;
    if (knife_edges_ && !inside) {
      // The factor's phase is against the image's path, the record's is against that over the vertex.
      coefficient *=
          std::polar(1.0, phaseAtCenter_rad(context.radar, 2 * distance) - phaseAtCenter_rad(context.radar, 2 * R));
    }
    PathRecord record;
    record.event = &kSpecular;
    record.actors = {facet.actor};
    record.facets = {facet.id};
    record.vertices = {vertex};
    record.departure = record.arrival = direction_radar;
    record.bounces = 1;
    record.reflection_cosine = {1.0};  // the level is that of the perpendicular, also beside the facet
    record.length_m = inside ? elements.lengthsByImage([&](const Eigen::Vector3d& t) { return mirror(t, facet); })
                             : elements.lengthsVia(vertex);
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

  void addCurved(const PoseContext& context, const ElementsInMap& elements, int index,
                 std::vector<PathRecord>& records) const {
    const CurvedSurface& surface = context.scene.curved[index];
    const Actor& actor = context.scene.actors[surface.actor];
    if (!actor.present) return;
    const std::optional<CurvedEcho> echo = curvedEcho(context, elements, surface);
    if (!echo || std::abs(echo->straight.z()) > std::sqrt(0.5)) return;  // facets there take no part
    // The facets lie a little behind the surface; one of them has to be what is met first. A second ray beside the
    // first, where that slips through between two triangles.
    const double reach = echo->distance_m + 4 * surface.sagitta_m + 2 * kInset_m;
    const auto met = [&](const Eigen::Vector3d& direction) {
      const auto hit = context.rays.firstHit(elements.p, direction, reach);
      return hit && hit->facet >= 0 && context.scene.facets[hit->facet].curved == index;
    };
    if (!met(echo->direction) && !met(echo->direction + 1e-4 * echo->direction.unitOrthogonal())) return;
    const Eigen::Vector3d e = verticalField(elements.up, echo->straight);
    const ComplexVector back = reflectField(e.cast<std::complex<double>>(), echo->straight, echo->straight,
                                            actor.material, context.frequency_hz);
    const std::complex<double> gamma = (e.cast<std::complex<double>>().transpose() * back)(0);
    const std::complex<double> coefficient = echo->coefficient * specularShare(actor.material) * gamma;
    if (std::abs(coefficient) < cutoff_ || !(std::abs(coefficient) > 0)) return;
    PathRecord record;
    record.event = &kSpecular;
    record.actors = {surface.actor};
    record.facets = {surface.facets.front()};
    record.vertices = {echo->vertex};
    record.departure = record.arrival = echo->direction_radar;
    record.bounces = 1;
    record.reflection_cosine = {1.0};
    record.length_m = echo->length_m;
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

  int max_bounces_ = 3, ray_budget_ = 0, exhaustive_ = 0;
  double cutoff_ = 0;
  bool knife_edges_ = false;
  std::unique_ptr<ImageSearch> search_;
  std::unique_ptr<GrazedEdges> grazed_;  // where asked for
  std::vector<CornerEdge> edges_;
  // Convergence as notes() states it; no result depends on it.
  mutable std::atomic<int> seeded_poses_{0}, seeded_paths_{0}, late_paths_{0};
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Specular)

}  // namespace mmradartwin
