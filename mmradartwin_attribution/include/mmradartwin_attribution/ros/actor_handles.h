#pragma once

#include <interactive_markers/interactive_marker_server.h>

#include <functional>
#include <string>

#include "mmradartwin_sim/what_if.h"

namespace mmradartwin {

/// Where somebody has drawn an actor.
struct HandleMove {
  std::string actor;
  Eigen::Vector3d shift_m;  ///< from where the scene has it, along map's axes
  double yaw_deg = 0;
  bool continues = false;  ///< the drag that began before
};

/// A handle in rviz for each thing that stands in the room, not for what encloses it: drawn in the floor's plane, and
/// turned by its ring.
class ActorHandles {
 public:
  ActorHandles(const std::string& topic, const std::string& map_frame, std::function<void(const HandleMove&)> on_move);
  /// Handles for the actors of a twin, in place of all others.
  void show(const WhatIf& what_if);
  /// Puts handles where actors stand now; one that is held by the mouse stays there.
  void place(const WhatIf& what_if);
  void clear();

 private:
  void onFeedback(const visualization_msgs::InteractiveMarkerFeedback& feedback);

  std::string map_frame_;
  std::function<void(const HandleMove&)> on_move_;
  std::string held_;    ///< actor whose handle is drawn
  bool fresh_ = false;  ///< and has not been moved yet
  std::map<std::string, Eigen::Vector3d> centers_;
  interactive_markers::InteractiveMarkerServer server_;
};

/// What an actor turns about: the centroid of its surface.
Eigen::Vector3d surfaceCentroid(const Actor& actor);

}  // namespace mmradartwin
