#include "diagnosis/survey_plan.h"

#include <array>
#include <cmath>

namespace mmradartwin::diagnosis {
namespace {

constexpr double kUprightSine = 0.7;  ///< least sine of a triangle's slope that a plan shows

}  // namespace

SurveyPlan surveyPlan(const Scene* scene, const std::vector<Pose>& poses) {
  SurveyPlan plan;
  if (scene != nullptr) {
    for (const Actor& actor : scene->actors) {
      for (const std::array<int, 3>& corners : actor.triangles) {
        std::array<Eigen::Vector3d, 3> p;
        for (std::size_t i = 0; i < 3; ++i) p[i] = actor.vertices[static_cast<std::size_t>(corners[i])];
        const Eigen::Vector3d normal = (p[1] - p[0]).cross(p[2] - p[0]);
        if (!(std::hypot(normal.x(), normal.y()) > kUprightSine * normal.norm())) continue;
        // Seen from above an upright triangle is a line, its longest side.
        std::size_t longest = 0;
        const auto side_m = [&p](std::size_t i) { return (p[(i + 1) % 3] - p[i]).head<2>().norm(); };
        for (std::size_t i = 1; i < 3; ++i) longest = side_m(i) > side_m(longest) ? i : longest;
        plan.walls.push_back({actor.name, p[longest].head<2>(), p[(longest + 1) % 3].head<2>()});
      }
    }
  }
  for (const Pose& pose : poses) {
    const Eigen::Vector2d ahead = pose.T_map_radar.linear().col(0).head<2>();
    plan.stations.push_back({pose.name, pose.T_map_radar.translation().head<2>(), ahead});
  }
  return plan;
}

}  // namespace mmradartwin::diagnosis
