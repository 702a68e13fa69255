#include <cmath>

#include "../curved_surface.h"
#include "propagation_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "actor_unmodelled";
constexpr int kSides = 24;  // of the screen that stands for the cylinder in occlusion

/// Something in the room that the scene lacks, as an upright metal cylinder of diameter size_m: a shape that shows the
/// same level from all sides, which is what is known of an unknown thing. Its echo is the image's level with the
/// curvature's divergence sqrt(r/(r + R)) and the Fresnel aperture of its height (far off: 2 pi r L^2/lambda), from its
/// nearest line; it hides what is behind it. Its records name no actor.
class ActorUnmodelled : public Mechanism {
 public:
  const std::string& name() const override { return kName; }
  std::vector<ParameterSpec> parameters() const override {
    return {numberSpec("x_m", "m", -1000, 1000, "axis in map"), numberSpec("y_m", "m", -1000, 1000, "axis in map"),
            numberSpec("size_m", "m", 0.001, 5, "diameter"),
            numberSpec("height_m", "m", 0.001, 1000, 1.7, "from its foot to its top"),
            numberSpec("bottom_m", "m", -1000, 1000, 0.01, "its foot over map's floor level")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    x_m_ = values.number("x_m");
    y_m_ = values.number("y_m");
    radius_m_ = 0.5 * values.number("size_m");
    low_m_ = values.number("bottom_m");
    high_m_ = low_m_ + values.number("height_m");
  }
  void editScene(Scene& scene) const override {
    Actor screen;
    screen.name = kName;
    for (int i = 0; i < kSides; ++i) {
      const double a = 2 * M_PI * i / kSides;
      for (double z : {low_m_, high_m_}) {
        screen.vertices.emplace_back(x_m_ + radius_m_ * std::cos(a), y_m_ + radius_m_ * std::sin(a), z);
      }
      const int b = 2 * i, c = 2 * ((i + 1) % kSides);
      screen.triangles.push_back({b, c, c + 1});
      screen.triangles.push_back({b, c + 1, b + 1});
    }
    scene.screens.push_back(std::move(screen));
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    CurvedSurface cylinder;
    cylinder.center = {x_m_, y_m_, low_m_};
    cylinder.radius_m = radius_m_;
    cylinder.length_m = high_m_ - low_m_;
    const std::optional<CurvedEcho> echo = curvedEcho(context, elements, cylinder);
    if (!echo || !context.rays.visible(elements.p, echo->vertex, 1e-3)) return;
    PathRecord record;
    record.event = &kName;
    record.vertices = {echo->vertex};
    record.departure = record.arrival = echo->direction_radar;
    record.bounces = 1;
    record.length_m = echo->length_m;
    const std::complex<double> coefficient = -echo->coefficient;  // metal: Gamma = -1
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

 private:
  double x_m_ = 0, y_m_ = 0, radius_m_ = 0, low_m_ = 0, high_m_ = 0;
};

}  // namespace

std::unique_ptr<Mechanism> makeActorUnmodelled() { return std::make_unique<ActorUnmodelled>(); }

}  // namespace mmradartwin
