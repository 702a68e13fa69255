#pragma once

#include <visualization_msgs/MarkerArray.h>

#include <map>
#include <string>
#include <vector>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {

struct MarkerFrames {
  std::string map = "map";
  std::string measured = "radar_link_view_measured";
  std::string simulated = "radar_link_view_simulated";
  std::string residual = "radar_link_view_residual";
};

/// What of the markers is a matter of taste.
struct MarkerStyle {
  int max_paths = 200;           ///< strongest paths
  double map_span_db = 0;        ///< colours of the maps reach so far below the peak; 0: down to the field's floor
  double residual_span_db = 30;  ///< and those of the residual to either side of 0 dB
};

/// Markers of one pose for rviz. Fans keep their topology and all markers their ids from message to message; markers
/// that a pose no longer has are deleted by id. The first message clears what an earlier process left.
class MarkerBuilder {
 public:
  MarkerBuilder(const EvaluationField& field, const MarkerFrames& frames, const MarkerStyle& style = {});
  void setStyle(const MarkerStyle& style) { style_ = style; }
  visualization_msgs::MarkerArray build(const PoseAttribution& pose, const std::vector<PathRecord>& records,
                                        const Eigen::Isometry3d& T_map_radar, const std::string& caption);

 private:
  using Array = visualization_msgs::MarkerArray;
  void addFans(const PoseAttribution& pose, Array& out);
  void addGrid(const std::string& frame, const std::string& title, Array& out);
  void addBoxes(const PoseAttribution& pose, Array& out);
  void addLabels(const PoseAttribution& pose, Array& out);
  void addPaths(const std::vector<PathRecord>& records, const Eigen::Isometry3d& T_map_radar, Array& out);
  void addRadar(const Eigen::Isometry3d& T_map_radar, const std::string& caption, Array& out);
  visualization_msgs::Marker marker(const std::string& ns, int id, int type, const std::string& frame) const;
  /// Adds a list marker, or deletes it where it has no points.
  void addList(const visualization_msgs::Marker& marker, Array& out) const;

  EvaluationField field_;
  MarkerFrames frames_;
  MarkerStyle style_;
  double max_range_m_;
  std::vector<geometry_msgs::Point> fan_points_;  // six per cell
  std::vector<std::pair<int, int>> fan_cells_;    // range and angle bin of each
  std::map<std::string, int> labels_shown_;       // by namespace
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
