#pragma once

#include <ros/publisher.h>
#include <rviz/tool.h>

namespace mmradartwin {

/// rviz tool "Why?": a click in the room asks what stands behind that place, by a PointStamped on clicked_point.
class WhyTool : public rviz::Tool {
 public:
  WhyTool();
  void activate() override;
  void deactivate() override {}
  int processMouseEvent(rviz::ViewportMouseEvent& event) override;

 protected:
  void onInitialize() override;

 private:
  ros::Publisher points_;
};

}  // namespace mmradartwin
