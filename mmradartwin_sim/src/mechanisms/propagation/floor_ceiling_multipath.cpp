#include <algorithm>

#include "corners/corner_edge.h"
#include "echoes/image_record.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "physics/elements_in_map.h"
#include "rays/image_paths.h"

namespace mmradartwin {
namespace {

const std::string kFloorCeilingMultipath = "floor_ceiling_multipath";
constexpr double kAnyElevation_deg = 90;  ///< elements that are alike in all elevations

/// Paths over facets within 45 deg of the horizontal, which the base leaves out: the retro paths of corners that they
/// form with upright faces, and images of up to the third order with at least one such facet, up to an elevation. With
/// the base's 20 deg no first-order return of such a facet is in view.
class FloorCeilingMultipath : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kFloorCeilingMultipath; }
  std::vector<ParameterSpec> parameters() const override {
    return {tried(numberSpec("level", "1", 0, 100, 1, "factor of amplitude, 1 = full"), 0, 1),
            alsoAt(numberSpec("max_elevation_deg", "deg", 0, 90, kBaseElevation_deg,
                              "elevation up to which the elements send and receive these paths"),
                   kAnyElevation_deg),
            numberSpec("gap_m", "m", 0, 1, 0.025, "upright faces that end this near to a floor stand on it")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    level_ = values.number("level");
    most_elevation_deg_ = values.number("max_elevation_deg");
    gap_m_ = std::max(kFacesMeet_m, values.number("gap_m"));
  }
  void build(const Scene& scene, const RadarConfig&) override {
    corners_ = findCornerEdges(
        scene, gap_m_, [](const Facet&) { return true; },
        [](const Facet& a, const Facet& b) { return !a.reflects || !b.reflects; });
    search_ = std::make_unique<ImageSearch>(scene, true);
    order_ = std::min(3, search_->exhaustiveOrder());
  }
  std::vector<std::string> notes() const override {
    if (order_ >= 3) return {};
    return {"floor_ceiling_multipath: " + std::to_string(search_->reflectors().size()) +
            " facets are too many to try all sequences of more than " + std::to_string(order_)};
  }
  void addPaths(const PoseContext& given, std::vector<PathRecord>& records) const override {
    if (level_ <= 0) return;
    PoseContext context = given;
    context.most_elevation_deg = most_elevation_deg_;
    const ElementsInMap elements(context);
    // A wall over a picture's upper side is no corner as high as the wall.
    for (const CornerEdge& edge : corners_) {
      addCornerPath(context, elements, edge, {kFloorCeilingMultipath, level_}, records, CornerAperture::kNarrowerFace);
    }
    ImageSearch::Limits limits;
    limits.max_order = order_;
    limits.max_length_m = 2 * context.max_range_m;
    limits.forward = context.T_map_radar.linear().col(0);
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    limits.in_view = [&](const Eigen::Vector3d& d) { return context.inFieldOfView(to_radar * d); };
    for (const ImagePath& path : search_->find(elements.p, context.rays, limits)) {
      const bool ours = std::any_of(path.facets.begin(), path.facets.end(),
                                    [&](int id) { return !context.scene.facets[id].reflects; });
      if (ours) addImageRecord(context, elements, path, {kFloorCeilingMultipath, level_}, 1e-10, records);
    }
  }

 private:
  double level_ = 1, gap_m_ = 0, most_elevation_deg_ = kBaseElevation_deg;
  int order_ = 0;
  std::vector<CornerEdge> corners_;
  std::unique_ptr<ImageSearch> search_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(FloorCeilingMultipath)

}  // namespace mmradartwin
