#include <cmath>

#include "echoes/curved_echo.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"
#include "physics/elements_in_map.h"

namespace mmradartwin {
namespace {

const std::string kActorUnmodelled = "actor_unmodelled";
constexpr int kSides = 24;  // of the screen that stands for the cylinder in occlusion

/// Something of metal in the room that the scene lacks.
/// shape cylinder: upright, of diameter size_m, which shows the same level from all sides. Its echo is the image's
/// level with the curvature's divergence sqrt(r/(r + R)) and the Fresnel aperture of its height (far off: 2 pi r
/// L^2/lambda), from its nearest line; it hides what is behind it. shape box: upright, with a square of side size_m for
/// its plan, turned by yaw_deg. It is an actor of the scene like any other: its faces reflect, make corners with
/// others, diffract at their edges and hide, each where the twin's mechanisms do so. Records know neither by an index:
/// it is -1, or there is none.
class ActorUnmodelled : public Mechanism, public SceneStage, public PathStage {
 public:
  const std::string& name() const override { return kActorUnmodelled; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("x_m", "m", -1000, 1000, "axis in map"),
            numberSpec("y_m", "m", -1000, 1000, "axis in map"),
            numberSpec("size_m", "m", 0.001, 5, "diameter, or side of a box"),
            numberSpec("height_m", "m", 0.001, 1000, 1.7, "from its foot to its top"),
            numberSpec("bottom_m", "m", -1000, 1000, 0.01, "its foot over map's floor level"),
            textSpec("shape", false, "cylinder", "cylinder or box"),
            numberSpec("yaw_deg", "deg", -360, 360, 0, "of a box, a face's normal from map's x to the left")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    x_m_ = values.number("x_m");
    y_m_ = values.number("y_m");
    radius_m_ = 0.5 * values.number("size_m");
    low_m_ = values.number("bottom_m");
    high_m_ = low_m_ + values.number("height_m");
    yaw_rad_ = values.number("yaw_deg") * M_PI / 180;
    const std::string& shape = values.text("shape");
    box_ = shape == "box";
    if (!box_ && shape != "cylinder") {
      throw InputError("mechanism actor_unmodelled: key shape: " + shape + " is not known; cylinder or box");
    }
  }
  void editScene(Scene& scene) const override {
    if (box_) {
      Actor box = prism(4, radius_m_ * std::sqrt(2.0), yaw_rad_ + M_PI / 4);
      box.material_tag = box.material.name = "Metal";
      box.material.model = MaterialModel::kConductor;
      for (int top : {0, 1}) {
        box.triangles.push_back({top, 2 + top, 4 + top});
        box.triangles.push_back({top, 4 + top, 6 + top});
      }
      addActor(scene, std::move(box));
    } else {
      scene.occluders_only.push_back(prism(kSides, radius_m_, 0));
    }
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    if (box_) return;
    const ElementsInMap elements(context);
    CurvedSurface cylinder;
    cylinder.center = {x_m_, y_m_, low_m_};
    cylinder.radius_m = radius_m_;
    cylinder.length_m = high_m_ - low_m_;
    const std::optional<CurvedEcho> echo = curvedEcho(context, elements, cylinder);
    if (!echo || !context.rays.visible(elements.p, echo->vertex, 1e-3)) return;
    PathRecord record;
    record.event = &kActorUnmodelled;
    record.vertices = {echo->vertex};
    record.departure = record.arrival = echo->direction_radar;
    record.bounces = 1;
    record.length_m = echo->length_m;
    const std::complex<double> coefficient = -echo->coefficient;  // metal: Gamma = -1
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

 private:
  /// Upright, its corners at radius_m from the axis, the first in direction first_rad; vertices low and high in turn.
  Actor prism(int sides, double radius_m, double first_rad) const {
    Actor actor;
    actor.name = kActorUnmodelled;
    for (int i = 0; i < sides; ++i) {
      const double a = first_rad + 2 * M_PI * i / sides;
      for (double z : {low_m_, high_m_}) {
        actor.vertices.emplace_back(x_m_ + radius_m * std::cos(a), y_m_ + radius_m * std::sin(a), z);
      }
      const int b = 2 * i, c = 2 * ((i + 1) % sides);
      actor.triangles.push_back({b, c, c + 1});
      actor.triangles.push_back({b, c + 1, b + 1});
    }
    return actor;
  }

  double x_m_ = 0, y_m_ = 0, radius_m_ = 0, low_m_ = 0, high_m_ = 0, yaw_rad_ = 0;
  bool box_ = false;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(ActorUnmodelled)

}  // namespace mmradartwin
