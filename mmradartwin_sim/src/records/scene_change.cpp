#include "mmradartwin_sim/scene_change.h"

#include <algorithm>

namespace mmradartwin {

namespace {
constexpr double kMargin_m = 0.02;  // of an actor's bounds: what touches its faces, gaps at the ends of rays
}

void SceneChange::addBounds(const Eigen::AlignedBox3d& box) {
  bounds.emplace_back(box.min().array() - kMargin_m, box.max().array() + kMargin_m);
}

bool SceneChange::crosses(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
  const Eigen::Vector3d way = b - a, inverse = way.cwiseInverse();
  for (const Eigen::AlignedBox3d& box : bounds) {
    double from = 0, to = 1;
    for (int i = 0; i < 3 && from <= to; ++i) {
      if (way[i] == 0) {
        if (a[i] < box.min()[i] || a[i] > box.max()[i]) to = -1;
        continue;
      }
      const double one = (box.min()[i] - a[i]) * inverse[i], other = (box.max()[i] - a[i]) * inverse[i];
      from = std::max(from, std::min(one, other));
      to = std::min(to, std::max(one, other));
    }
    if (from <= to) return true;
  }
  return false;
}

bool SceneChange::touches(const Eigen::Vector3d& radar, const PathRecord& record) const {
  for (int actor : record.actors) {
    if (moved(actor)) return true;
  }
  Eigen::Vector3d from = radar;
  for (const Eigen::Vector3d& v : record.vertices) {
    if (crosses(from, v)) return true;
    from = v;
  }
  // The way back from a single point is the way there.
  return record.vertices.size() > 1 && crosses(from, radar);
}

}  // namespace mmradartwin
