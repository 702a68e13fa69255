#include "why_tool.h"

#include <OGRE/OgrePlane.h>
#include <OGRE/OgreVector3.h>
#include <geometry_msgs/PointStamped.h>
#include <ros/node_handle.h>
#include <rviz/display_context.h>
#include <rviz/geometry.h>
#include <rviz/selection/selection_manager.h>
#include <rviz/viewport_mouse_event.h>

#include <pluginlib/class_list_macros.hpp>

namespace mmradartwin {

WhyTool::WhyTool() { shortcut_key_ = 'y'; }

void WhyTool::onInitialize() {
  setName("Why?");
  points_ = ros::NodeHandle().advertise<geometry_msgs::PointStamped>("clicked_point", 2);
}

void WhyTool::activate() {
  setStatus(
      "Why? Click on a place in the room, with Shift on the floor behind what stands there. The answer is in the panel "
      "Twin.");
}

int WhyTool::processMouseEvent(rviz::ViewportMouseEvent& event) {
  if (!event.leftDown()) return 0;
  Ogre::Vector3 place;
  Ogre::Plane floor(Ogre::Vector3::UNIT_Z, 0);
  const bool surface =
      !event.shift() && context_->getSelectionManager()->get3DPoint(event.viewport, event.x, event.y, place);
  if (!surface && !rviz::getPointOnPlaneFromWindowXY(event.viewport, floor, event.x, event.y, place)) return Render;
  geometry_msgs::PointStamped point;
  point.header.frame_id = context_->getFixedFrame().toStdString();
  point.header.stamp = ros::Time::now();
  point.point.x = place.x;
  point.point.y = place.y;
  point.point.z = place.z;
  points_.publish(point);
  return Render;
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::WhyTool, rviz::Tool)
