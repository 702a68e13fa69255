#include <cmath>

#include "../aperture.h"
#include "propagation_builtin.h"

namespace mmradartwin {
namespace {

const std::string kName = "actor_unmodelled";
constexpr double kInset_m = 0.01;
constexpr double kSmallestFactor = 0.01;
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
    const Eigen::Vector2d to(x_m_ - elements.p.x(), y_m_ - elements.p.y());
    const double axis = to.norm(), R = axis - radius_m_, wavelength = context.radar.wavelength_m();
    if (R <= 1e-3) return;
    const double inset = std::min(kInset_m, 0.5 * (high_m_ - low_m_));
    const double z = std::min(high_m_ - inset, std::max(low_m_ + inset, elements.p.z()));
    const auto nearestTo = [&](const Eigen::Vector3d& p) {
      const Eigen::Vector2d d = (Eigen::Vector2d(x_m_, y_m_) - p.head<2>()).normalized();
      return Eigen::Vector3d(x_m_ - radius_m_ * d.x(), y_m_ - radius_m_ * d.y(), z);
    };
    const Eigen::Vector3d vertex = nearestTo(elements.p), way = vertex - elements.p;
    const double distance = way.norm();
    if (distance > context.max_range_m) return;
    const Eigen::Vector3d direction_radar = context.T_map_radar.linear().transpose() * (way / distance);
    if (!context.inFieldOfView(direction_radar)) return;
    const double unit = 2 / std::sqrt(wavelength * R);
    const std::complex<double> factor =
        apertureAxis((low_m_ - elements.p.z()) * unit, (high_m_ - elements.p.z()) * unit);
    if (std::abs(factor) < kSmallestFactor) return;
    if (!context.rays.visible(elements.p, vertex, 1e-3)) return;
    const std::complex<double> coefficient =
        -std::sqrt(radius_m_ / (radius_m_ + R)) * factor * wavelength / (8 * M_PI * R);  // metal: Gamma = -1
    PathRecord record;
    record.event = &kName;
    record.vertices = {vertex};
    record.departure = record.arrival = direction_radar;
    record.bounces = 1;
    // The reflection point of a transmitter and a receiver that stand close lies at the middle of both.
    for (const auto& t : elements.tx) {
      for (const auto& r : elements.rx) {
        const Eigen::Vector3d q = nearestTo(0.5 * (t + r));
        record.length_m.push_back((q - t).norm() + (q - r).norm());
      }
    }
    setContribution(context.radar, std::conj(coefficient), record);
    records.push_back(std::move(record));
  }

 private:
  double x_m_ = 0, y_m_ = 0, radius_m_ = 0, low_m_ = 0, high_m_ = 0;
};

}  // namespace

std::unique_ptr<Mechanism> makeActorUnmodelled() { return std::make_unique<ActorUnmodelled>(); }

}  // namespace mmradartwin
