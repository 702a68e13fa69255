#include <algorithm>
#include <set>

#include "corners/trihedral.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "physics/elements_in_map.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kCornerReflection = "corner_reflection";

/// The retro path of corners that the named actors form with each other (or in themselves): the law of `corner`, for
/// faces that come within gap_m of each other, where `corner` itself does not return that pair already. The three faces
/// of a trihedral may lie any way: one whose boresight is level always has a face within 45 deg of the floor.
class CornerReflection : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kCornerReflection; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textsSpec("actors", "names of the actors whose faces form the corner"),
            numberSpec("gap_m", "m", 0, 1, 0.06, "faces form a corner though this gap is between them")};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    if (values.texts("actors").empty()) throw InputError("mechanism corner_reflection: key actors: names no actor");
    for (const std::string& actor : values.texts("actors"))
      named_.insert(requireActor(scene, kCornerReflection, actor));
    gap_m_ = std::max(kFacesMeet_m, values.number("gap_m"));
  }
  int rank() const override { return 1; }  // after corner, whose records tell what is there already
  std::vector<std::string> looksAtPathsOf() const override { return {"corner"}; }
  void build(const Scene& scene, const RadarConfig&) override {
    const bool one = named_.size() == 1;
    edges_ = findCornerEdges(
        scene, gap_m_, [this](const Facet& f) { return f.reflects && named_.count(f.actor) > 0; },
        [one](const Facet& a, const Facet& b) { return one || a.actor != b.actor; });
    const std::vector<CornerEdge> all = findCornerEdges(
        scene, gap_m_, [this](const Facet& f) { return named_.count(f.actor) > 0; },
        [](const Facet&, const Facet&) { return true; });
    for (Trihedral& t : findTrihedra(scene, all, gap_m_)) {
      std::set<int> actors;
      for (int id : t.facets) actors.insert(scene.facets[id].actor);
      if (one || actors.size() > 1) trihedra_.push_back(std::move(t));
    }
  }
  std::vector<std::string> notes() const override {
    if (!edges_.empty() || !trihedra_.empty()) return {};
    return {"corner_reflection: the named actors form no corner; check actors and gap_m"};
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    std::set<PerInteraction<int>> known;
    for (const PathRecord& r : records) {
      if (*r.event == "corner") known.insert(r.facets);
    }
    const ElementsInMap elements(context);
    for (const CornerEdge& edge : edges_) {
      if (known.count({edge.a, edge.b}) == 0) addCornerPath(context, elements, edge, {kCornerReflection, 1}, records);
    }
    for (const Trihedral& t : trihedra_) {
      if (known.count({t.facets.begin(), t.facets.end()}) == 0)
        addTrihedralPath(context, elements, t, {kCornerReflection, 1}, records);
    }
  }

 private:
  std::set<int> named_;
  double gap_m_ = 0;
  std::vector<CornerEdge> edges_;
  std::vector<Trihedral> trihedra_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(CornerReflection)

}  // namespace mmradartwin
