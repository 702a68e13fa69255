#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <string>
#include <vector>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {

/// Markers of one pose for rviz, in the scene's frame: the radar, boxes on the floor below its plane where both maps
/// respond (namespace "matched") and where they differ (a namespace for each class), and the strongest paths (one for
/// each event). All keep their ids from message to message; what a pose no longer has is deleted by id. The first
/// message clears what an earlier process left.
class MarkerBuilder {
 public:
  explicit MarkerBuilder(const EvaluationField& field, const std::string& map_frame = "map", int max_paths = 60);
  void setMaxPaths(int max_paths) { max_paths_ = max_paths; }
  visualization_msgs::MarkerArray build(const PoseAttribution& pose, const std::vector<PathRecord>& records,
                                        const Eigen::Isometry3d& T_map_radar, const std::string& caption);

 private:
  using Array = visualization_msgs::MarkerArray;
  void addBoxes(const PoseAttribution& pose, const Eigen::Isometry3d& T_map_radar, Array& out) const;
  void addPaths(const std::vector<PathRecord>& records, const Eigen::Isometry3d& T_map_radar, Array& out);
  void addRadar(const Eigen::Isometry3d& T_map_radar, const std::string& caption, Array& out) const;
  visualization_msgs::Marker marker(const std::string& ns, int id, int type) const;
  /// Adds a list marker, or deletes it where it has no points.
  static void addList(const visualization_msgs::Marker& marker, Array& out);

  EvaluationField field_;
  std::string map_frame_;
  int max_paths_;
  std::vector<std::string> events_shown_;
  bool first_ = true;
};

/// The scene: one TRIANGLE_LIST per material of its upright surfaces, nearly opaque, and one of its level ones, lighter
/// and more transparent, so that fans above the floor stand out. The namespace is the material, with " level" for
/// those.
visualization_msgs::MarkerArray sceneMarkers(const Scene& scene, const std::string& map_frame);

/// Markers of findings in the room, in place of all that were shown before: a ring as wide as the place's 95 %
/// interval, with cause and actor. Findings without a place have none.
visualization_msgs::MarkerArray findingMarkers(const Findings& findings, const std::string& map_frame);

}  // namespace mmradartwin
