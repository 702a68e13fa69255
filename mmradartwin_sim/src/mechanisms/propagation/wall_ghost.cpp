#include <algorithm>
#include <cmath>
#include <set>

#include "echoes/scatter_points.h"
#include "edges/diffracting_edge.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "physics/aperture.h"
#include "physics/elements_in_map.h"
#include "rays/image_paths.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kWallGhost = "wall_ghost";

/// True for what encloses the room: a side of the scene is covered by it for the most part.
bool enclosesRoom(const Scene& scene, const Actor& actor) {
  Eigen::AlignedBox3d room;
  for (const Actor& a : scene.actors) room.extend(a.bounds);
  const Eigen::Vector3d share = (actor.bounds.sizes().array() / room.sizes().array().max(1e-9)).matrix();
  const double sides[] = {share.y() * share.z(), share.x() * share.z(), share.x() * share.y()};
  return *std::max_element(std::begin(sides), std::end(sides)) > 0.5;
}

/// Radar - wall - object - radar and its reverse, for the rough surfaces and the exposed edges of what stands in the
/// room: not for what encloses it, whose rough faces see each other everywhere. How much of either there is, is for the
/// data to say.
/// A patch scatters sideways by its Lambertian law with |Gamma| the geometric mean of both legs' (which is reciprocal
/// and goes over into the monostatic form), and with the phase that its direct echo has.
class WallGhost : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kWallGhost; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        textsSpec("walls", "names of the actors that mirror"),
        numberSpec("spacing_m", "m", 0.005, 5, 0.2, "mean distance of scatter points"),
        tried(numberSpec("gain_db", "dB", -60, 60, 0, "how much more than its law a scatterer sends sideways"), -60, 0),
        tried(numberSpec("edge_level", "", 0, 10, 1, "what edges send sideways, in multiples of UTD"), 0, 1)};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    if (values.texts("walls").empty()) throw InputError("mechanism wall_ghost: key walls: names no actor");
    for (const std::string& wall : values.texts("walls")) walls_.insert(requireActor(scene, kWallGhost, wall));
    spacing_m_ = values.number("spacing_m");
    gain_ = std::pow(10.0, values.number("gain_db") / 20);
    edge_level_ = values.number("edge_level");
  }
  void build(const Scene& scene, const RadarConfig& radar) override {
    mirrors_.clear();
    for (int wall : walls_) {
      for (int id : scene.actors[wall].facets) {
        if (scene.facets[id].present) mirrors_.push_back(id);
      }
    }
    std::set<int> objects;
    for (int a = 0; a < static_cast<int>(scene.actors.size()); ++a) {
      if (walls_.count(a) == 0 && !enclosesRoom(scene, scene.actors[static_cast<std::size_t>(a)])) objects.insert(a);
    }
    points_ = makeScatterPoints(scene, spacing_m_, radar.center_frequency_hz(), kWallGhost,
                                [&](const Facet& f) { return objects.count(f.actor) > 0; });
    edges_.clear();
    if (edge_level_ == 0) return;
    for (const DiffractingEdge& e : findDiffractingEdges(scene)) {
      if (objects.count(scene.facets[e.a].actor) > 0) edges_.push_back(e);
    }
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    for (int id : mirrors_) {
      const Facet& wall = context.scene.facets[id];
      if (std::abs(wall.planeDistance(elements.p)) < 1e-6) continue;
      for (const ScatterPoint& point : points_) addPoint(context, elements, wall, point, records);
      for (const DiffractingEdge& edge : edges_) addEdge(context, elements, wall, edge, records);
    }
  }

 private:
  struct Bounce {
    const Facet* wall;
    Eigen::Vector3d q;        // on the wall
    Eigen::Vector3d out, on;  // unit, radar to wall and wall to scatterer
    double before_m, after_m, cosine;
  };
  struct Scatterer {
    Eigen::Vector3d point;
    int actor, facet;
    std::complex<double> coefficient;  // of the path over the wall and the scatterer
  };

  /// The bounce of the way from the radar over the wall to x, where geometry and field of view allow it.
  static bool bounce(const PoseContext& context, const Eigen::Vector3d& p, const Facet& wall, const Eigen::Vector3d& x,
                     Bounce& b) {
    const double here = wall.planeDistance(p), there = wall.planeDistance(x);
    if (!(here * there > 0) || std::abs(there) < 1e-6) return false;
    const Eigen::Vector3d image = mirror(p, wall);
    b.wall = &wall;
    b.q = image + here / (here + there) * (x - image);
    if (!wall.contains(b.q)) return false;
    b.before_m = (b.q - p).norm();
    b.after_m = (x - b.q).norm();
    if (b.before_m + b.after_m + (x - p).norm() > 2 * context.max_range_m) return false;
    b.out = (b.q - p) / b.before_m;
    b.on = (x - b.q) / b.after_m;
    b.cosine = std::min(1.0, std::abs(b.out.dot(wall.normal)));
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    return context.inFieldOfView(to_radar * b.out) && context.inFieldOfView(to_radar * (x - p).normalized());
  }

  static bool free(const PoseContext& context, const ElementsInMap& elements, const Bounce& b, const Eigen::Vector3d& x,
                   double gap_m) {
    const Facet& wall = *b.wall;
    const Eigen::Vector3d& p = elements.p;
    if (!elements.sides.isOpen(wall, b.q, p) || !elements.sides.isOpen(wall, b.q, x)) return false;
    const double gap = std::max({1e-3, gap_m, 2 * wall.flatness_m / std::max(0.1, b.cosine)});
    return context.rays.visible(p, x, std::max(1e-3, gap_m)) && context.rays.visible(p, b.q, gap) &&
           context.rays.visible(b.q, x, gap);
  }

  /// Field at the scatterer of a unit source, without spreading.
  static ComplexVector mirrored(const PoseContext& context, const ElementsInMap& elements, const Facet& wall,
                                const Bounce& b) {
    const Material& material = context.scene.actors[wall.actor].material;
    const ComplexVector e = verticalField(elements.up, b.out).cast<std::complex<double>>();
    return specularShare(material) *
           apertureFactor(wall, b.q, b.out, b.before_m, b.after_m, context.radar.wavelength_m()) *
           reflectField(e, b.out, wall.normal, material, context.frequency_hz);
  }

  void addPoint(const PoseContext& context, const ElementsInMap& elements, const Facet& wall, const ScatterPoint& point,
                std::vector<PathRecord>& records) const {
    const Eigen::Vector3d& x = point.position;
    Bounce b;
    if (!bounce(context, elements.p, wall, x, b)) return;
    const Facet& facet = context.scene.facets[point.facet];
    const double r1 = b.before_m + b.after_m, r2 = (x - elements.p).norm();
    const Eigen::Vector3d back = (elements.p - x) / r2;
    const double cos_in = -b.on.dot(facet.normal), cos_out = back.dot(facet.normal);
    if (!(cos_in * cos_out > 0)) return;  // the lit side is not the one seen
    if (!elements.sides.isOpen(facet, x, elements.p) || !elements.sides.isOpen(facet, x, b.q)) return;
    if (!free(context, elements, b, x, 2 * facet.flatness_m / std::max(0.1, std::abs(cos_out)))) return;
    const Material& material = context.scene.actors[facet.actor].material;
    const auto law = [&](const Eigen::Vector3d& direction, double cosine) {
      const double te = verticalField(elements.up, direction).dot(transverse(direction, facet.normal));
      return backscatterAmplitude(material, std::min(1.0, std::abs(cosine)), std::min(1.0, te * te),
                                  context.frequency_hz);
    };
    const double patch = std::sqrt(law(b.on, cos_in) * law(back, cos_out) * point.area_m2 / M_PI);
    const double amplitude =
        context.radar.wavelength_m() / (4 * M_PI * r1 * r2) * patch * mirrored(context, elements, wall, b).norm();
    // Both the phase of the wall's reflection and the point's own are unknowable; the point's stands for both.
    addPair(
        context, elements, b, {x, facet.actor, facet.id, std::polar(gain_ * amplitude, point.phase_rad(context.seed))},
        [&](const Eigen::Vector3d& t, const Eigen::Vector3d& r) { return (t - x).norm() + (r - x).norm(); }, records);
  }

  void addEdge(const PoseContext& context, const ElementsInMap& elements, const Facet& wall,
               const DiffractingEdge& edge, std::vector<PathRecord>& records) const {
    const Eigen::Vector3d image = mirror(elements.p, wall);
    Bounce b;
    const auto incident = [&](const Eigen::Vector3d& point) -> ComplexVector {
      if (!bounce(context, elements.p, wall, point, b)) return ComplexVector::Zero();
      return mirrored(context, elements, wall, b);
    };
    const auto found = diffract(context, edge, image, elements.p, incident, elements.up);
    if (!found || !(std::abs(found->factor) > 0)) return;
    const Eigen::Vector3d& x = found->point;
    if (!bounce(context, elements.p, wall, x, b)) return;
    const Facet &a = context.scene.facets[edge.a], &other = context.scene.facets[edge.b];
    const double lift = std::max(1e-3, a.flatness_m + other.flatness_m);
    if (!free(context, elements, b, x + lift * edge.outward, 0)) return;
    const std::complex<double> coefficient = edge_level_ * context.radar.wavelength_m() / (4 * M_PI) * found->factor;
    addPair(
        context, elements, b, {x, a.actor, a.id, std::conj(coefficient)},
        [&](const Eigen::Vector3d& t, const Eigen::Vector3d& r) { return lengthOverEdge(edge, t, r); }, records);
  }

  /// The path over the wall first and its reverse; length(t, r) is the way from t to r over the scatterer.
  template <typename Length>
  void addPair(const PoseContext& context, const ElementsInMap& elements, const Bounce& b, const Scatterer& scatterer,
               Length length, std::vector<PathRecord>& records) const {
    if (!(std::abs(scatterer.coefficient) > 0)) return;
    const Facet& wall = *b.wall;
    const Eigen::Vector3d& x = scatterer.point;
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    PathRecord first, second;
    for (const auto& t : elements.tx) {
      for (const auto& r : elements.rx) {
        first.length_m.push_back(length(mirror(t, wall), r));
        second.length_m.push_back(length(t, mirror(r, wall)));
      }
    }
    first.actors = {wall.actor, scatterer.actor};
    first.facets = {wall.id, scatterer.facet};
    first.vertices = {b.q, x};
    first.reflection_cosine = {b.cosine, -1};
    first.departure = to_radar * b.out;
    first.arrival = to_radar * (x - elements.p).normalized();
    second.actors = {scatterer.actor, wall.actor};
    second.facets = {scatterer.facet, wall.id};
    second.vertices = {x, b.q};
    second.reflection_cosine = {-1, b.cosine};
    second.departure = first.arrival;
    second.arrival = first.departure;
    for (PathRecord* record : {&first, &second}) {
      record->event = &kWallGhost;
      record->bounces = 2;
      setContribution(context.radar, scatterer.coefficient, *record);
      records.push_back(std::move(*record));
    }
  }

  std::set<int> walls_;
  double spacing_m_ = 0.2, gain_ = 1, edge_level_ = 1;
  std::vector<int> mirrors_;
  std::vector<ScatterPoint> points_;
  std::vector<DiffractingEdge> edges_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(WallGhost)

}  // namespace mmradartwin
