#include <algorithm>
#include <array>

#include "corners/trihedral.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "physics/elements_in_map.h"
#include "physics/reflections.h"

namespace mmradartwin {
namespace {

const std::string kCorner = "corner";

/// The retro paths of two and of three facets that meet at concave right angles.
class Corner : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kCorner; }
  std::vector<ParameterSpec> parameters() const override {
    return {integerSpec("knife_edges", "1", 0, 1, 0,
                        "1: both faces by physical optics with exact paths; 0: one aperture from far end to far end")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    aperture_ = values.number("knife_edges") > 0.5 ? CornerAperture::kPhysicalOptics : CornerAperture::kBothFaces;
  }

  void build(const Scene& scene, const RadarConfig&) override {
    edges_ = findCornerEdges(
        scene, kFacesMeet_m, [](const Facet& f) { return f.reflects; },
        [](const Facet&, const Facet&) { return true; });
    trihedra_ = findTrihedra(scene, edges_, kFacesMeet_m);
  }

  void sceneChanged(const Scene& scene, const RadarConfig&, const SceneChange& change) override {
    const auto moved = [&](int facet) { return change.moved(scene.facets[facet].actor); };
    edges_.erase(
        std::remove_if(edges_.begin(), edges_.end(), [&](const CornerEdge& e) { return moved(e.a) || moved(e.b); }),
        edges_.end());
    const std::vector<CornerEdge> again = findCornerEdges(
        scene, kFacesMeet_m, [](const Facet& f) { return f.reflects; },
        [&](const Facet& a, const Facet& b) { return moved(a.id) || moved(b.id); });
    edges_.insert(edges_.end(), again.begin(), again.end());
    std::stable_sort(edges_.begin(), edges_.end(), [](const CornerEdge& a, const CornerEdge& b) {
      return std::make_pair(a.a, a.b) < std::make_pair(b.a, b.b);
    });
    trihedra_ = findTrihedra(scene, edges_, kFacesMeet_m);
  }

  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    const auto wanted = [&](int facet) { return context.scene.facets[facet].actor == context.only_actor; };
    for (const CornerEdge& edge : edges_) {
      if (context.only_actor >= 0 && !wanted(edge.a) && !wanted(edge.b)) continue;
      addCornerPath(context, elements, edge, {kCorner, 1}, records, aperture_);
    }
    for (const Trihedral& t : trihedra_) addTrihedralPath(context, elements, t, {kCorner, 1}, records);
  }

  bool changeMaterials(const PoseContext& context, const std::vector<Material>& before,
                       std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    return std::all_of(records.begin(), records.end(), [&](PathRecord& record) {
      const MaterialsOfPath materials(context.scene, before, record);
      if (!materials.changed) return true;
      PerInteraction<Eigen::Vector3d> normals;
      for (int id : record.facets) normals.push_back(context.scene.facets[static_cast<std::size_t>(id)].normal);
      const auto level = [&](const PerInteraction<const Material*>& of) {
        return normals.size() == 2
                   ? dihedralReflection(elements, record.vertices[0], normals, of, context.frequency_hz)
                   : trihedralReflection(elements, record.vertices[0], normals, of, context.frequency_hz);
      };
      return replaceReflection(level(materials.before), level(materials.now), record);
    });
  }

 private:
  /// Levels as addCornerPath() and addTrihedralPath() have them.
  static std::complex<double> dihedralReflection(const ElementsInMap& elements, const Eigen::Vector3d& on_edge,
                                                 const PerInteraction<Eigen::Vector3d>& normals,
                                                 const PerInteraction<const Material*>& materials,
                                                 double frequency_hz) {
    const Eigen::Vector3d along = normals[0].cross(normals[1]).normalized();
    const Eigen::Vector3d foot = on_edge + (elements.p - on_edge).dot(along) * along;
    const Eigen::Vector3d out = (foot - elements.p).normalized();
    return reflectionOf(elements.up, out, out, normals, materials, frequency_hz);
  }
  static std::complex<double> trihedralReflection(const ElementsInMap& elements, const Eigen::Vector3d& apex,
                                                  const PerInteraction<Eigen::Vector3d>& normals,
                                                  const PerInteraction<const Material*>& materials,
                                                  double frequency_hz) {
    const Eigen::Vector3d out = (apex - elements.p).normalized();
    std::complex<double> sum = 0;
    std::array<std::size_t, 3> order = {0, 1, 2};
    do {
      sum += reflectionOf(elements.up, out, out, {normals[order[0]], normals[order[1]], normals[order[2]]},
                          {materials[order[0]], materials[order[1]], materials[order[2]]}, frequency_hz);
    } while (std::next_permutation(order.begin(), order.end()));
    return sum;
  }

  CornerAperture aperture_ = CornerAperture::kBothFaces;
  std::vector<CornerEdge> edges_;
  std::vector<Trihedral> trihedra_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(Corner)

}  // namespace mmradartwin
