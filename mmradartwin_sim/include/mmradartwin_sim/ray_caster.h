#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// Occlusion queries, thread-safe. Embree behind it; no invalid ray reaches it.
class RayCaster {
 public:
  /// movable: actors that place() may move, each an Embree instance of its own. What stands shares one tree, which is
  /// as fast as without any.
  explicit RayCaster(const Scene& scene, const std::vector<int>& movable = {});
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  /// Moves a movable actor: T_map_map takes where it was on construction to where it is. Not while others cast. Throws
  /// std::invalid_argument for an actor that is not movable; one that occludes nothing never is.
  void place(int actor, const Eigen::Isometry3d& T_map_map);
  /// True where the open segment a-b meets nothing, both ends shortened by gap_m.
  bool visible(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double gap_m = 1e-3) const;
  /// visible() from a to many points, each with a gap of its own, one result per point: rays go to Embree in packets,
  /// which pays where neighbouring points follow each other. Throws std::invalid_argument where the lists differ in
  /// length.
  std::vector<char> visible(const Eigen::Vector3d& a, const std::vector<Eigen::Vector3d>& points,
                            const std::vector<double>& gap_m) const;
  struct Hit {
    double distance_m;
    int actor;
    int facet;
    Eigen::Vector3d point;
  };
  std::optional<Hit> firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double max_m) const;
  /// True where p lies inside a closed actor (odd crossings in most directions); names the actor.
  std::optional<int> insideActor(const Eigen::Vector3d& p) const;

 private:
  bool passesThroughActors(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double gap_m) const;
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace mmradartwin
