#include <algorithm>
#include <cmath>

#include "echoes/scatter_points.h"
#include "mechanisms/base/built_in_mechanism.h"
#include "mechanisms/base/point_echo.h"
#include "mmradartwin_dsp/input_error.h"
#include "scene/required_actor.h"

namespace mmradartwin {
namespace {

const std::string kEmpiricalClutter = "empirical_clutter";
/// Height of the middle of what lies on a surface: cups, keyboards and cables.
constexpr double kHeight_m = 0.05;
/// Least upward part of the normal of a surface on which things stay.
const double kLeastUp = std::sqrt(0.5);

/// Small things that lie about on an actor and that no scan shows: points over its upper surfaces, where the scene
/// describes them, which echo alike in all directions and hide nothing.
class EmpiricalClutter : public Mechanism, public PathStage {
 public:
  const std::string& name() const override { return kEmpiricalClutter; }
  bool standsSeveralTimes() const override { return true; }
  std::vector<ParameterSpec> parameters() const override {
    return {textSpec("actor", true, "", "name of the actor on which things lie"),
            tried(numberSpec("level_db", "dB", -200, 40, "radar cross section per area, over 1 m^2/m^2; -200: none"),
                  -200, -20),
            numberSpec("spacing_m", "m", 0.01, 5, 0.2, "mean distance of the points")};
  }
  void configure(const Parameters& values, const Scene& scene, const RadarConfig&) override {
    actor_ = requireActor(scene, kEmpiricalClutter, values.text("actor"));
    area_share_ = std::pow(10.0, values.number("level_db") / 10);
    points_ = pointsOnFacets(scene, values.number("spacing_m"), kEmpiricalClutter, [&](const Facet& f) {
      const double up = f.body >= 0 ? f.outside * f.normal.z() : std::abs(f.normal.z());
      return f.actor == actor_ && f.present && up > kLeastUp;
    });
    if (points_.empty()) {
      throw InputError("mechanism empirical_clutter: key actor: " + values.text("actor") +
                       " has no surface that faces up; name one on which things can lie");
    }
  }
  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    if (context.only_actor >= 0 && context.only_actor != actor_) return;
    for (const ScatterPoint& point : points_) {
      const Eigen::Vector3d place = point.position + kHeight_m * Eigen::Vector3d::UnitZ();
      std::optional<PointEcho> echo = pointEcho(context, place, area_share_ * point.area_m2);
      if (!echo) continue;
      echo->record.event = &kEmpiricalClutter;
      echo->record.actors = {actor_};
      echo->record.facets = {point.facet};
      setContribution(context.radar, std::polar(echo->amplitude, point.phase_rad(context.seed)), echo->record);
      records.push_back(std::move(echo->record));
    }
  }

 private:
  int actor_ = -1;
  double area_share_ = 0;
  std::vector<ScatterPoint> points_;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(EmpiricalClutter)

}  // namespace mmradartwin
