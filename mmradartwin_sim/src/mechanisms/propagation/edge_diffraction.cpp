#include <cmath>
#include <set>

#include "edges/diffracting_edge.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "physics/elements_in_map.h"

namespace mmradartwin {
namespace {

const std::string kEdgeDiffraction = "edge_diffraction";

/// Retro returns of exposed edges by UTD. A first-order `specular` return holds the edges of its facet in its aperture
/// factor, also beside the facet; so an edge takes part only at poses where no such return of either face exists, and
/// takes over where the aperture factor falls below that mechanism's limit.
class EdgeDiffraction : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kEdgeDiffraction; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("level", "1", 0, 100, 1, "factor of amplitude, 1 = UTD"), 0, 1)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    level_ = values.number("level");
  }
  int rank() const override { return 1; }  // after specular, whose records tell which edges are held
  std::vector<std::string> looksAtPathsOf() const override { return {"specular"}; }
  void build(const Scene& scene, const RadarConfig&) override { edges_ = findDiffractingEdges(scene); }

  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    if (level_ <= 0) return;
    std::set<int> held;
    for (const PathRecord& r : records) {
      if (r.bounces == 1 && *r.event == "specular") held.insert(r.facets.front());
    }
    const ElementsInMap elements(context);
    for (const DiffractingEdge& edge : edges_) {
      if (held.count(edge.a) == 0 && held.count(edge.b) == 0) addPath(context, elements, edge, records);
    }
  }

 private:
  void addPath(const PoseContext& context, const ElementsInMap& elements, const DiffractingEdge& edge,
               std::vector<PathRecord>& records) const {
    const Eigen::Vector3d to = edge.origin - elements.p;
    if (to.norm() - edge.length_m > context.max_range_m) return;
    const auto incident = [&](const Eigen::Vector3d& point) -> ComplexVector {
      return verticalField(elements.up, (point - elements.p).normalized()).cast<std::complex<double>>();
    };
    const auto found = diffract(context, edge, elements.p, elements.p, incident, elements.up);
    if (!found) return;
    const Eigen::Vector3d way = found->point - elements.p;
    const double distance = way.norm();
    if (distance > context.max_range_m || distance < 1e-3) return;
    const Eigen::Vector3d direction_radar = context.T_map_radar.linear().transpose() * (way / distance);
    if (!context.inFieldOfView(direction_radar)) return;
    const Facet &a = context.scene.facets[edge.a], &b = context.scene.facets[edge.b];
    const double lift = std::max(1e-3, a.flatness_m + b.flatness_m);
    if (!context.rays.visible(elements.p, found->point + lift * edge.outward, 1e-3)) return;
    const std::complex<double> coefficient = level_ * context.radar.wavelength_m() / (4 * M_PI) * found->factor;
    if (!(std::abs(coefficient) > 0)) return;
    PathRecord record;
    record.event = &kEdgeDiffraction;
    record.actors = {a.actor};
    record.facets = {a.id};
    record.vertices = {found->point};
    record.departure = record.arrival = direction_radar;
    record.bounces = 1;
    for (const auto& t : elements.tx) {
      for (const auto& r : elements.rx) record.length_m.push_back(lengthOverEdge(edge, t, r));
    }
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

  double level_ = 1;
  std::vector<DiffractingEdge> edges_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EdgeDiffraction)

}  // namespace mmradartwin
