#pragma once

#include <geometry_msgs/PointStamped.h>
#include <mmradartwin_msgs/Explanation.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Why.h>
#include <ros/ros.h>

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/place_explanation.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

/// The pair of maps that is asked about, and what it was made of.
struct AskedPose {
  std_msgs::Header header;  ///< of the maps: their stamp and the radar's frame
  std::string name;
  Eigen::Isometry3d T_map_radar = Eigen::Isometry3d::Identity();
  PoseAttribution attribution;
  std::shared_ptr<const std::vector<PathRecord>> records;  ///< behind the simulated map; never null
  std::shared_ptr<const EvaluationField> field;
  std::shared_ptr<const Scene> scene;  ///< actors of the records
};

/// clicked_point, attribution/why -> attribution/explanation, attribution/explanation_markers: what stands behind a
/// place. The last answer is given anew where the maps change, as long as the radar stays where it is. Callbacks must
/// come one at a time.
class WhyServer {
 public:
  WhyServer(ros::NodeHandle& nh, const std::string& map_frame);
  /// What is asked about from now on.
  void setPose(AskedPose pose);

 private:
  void onPoint(const geometry_msgs::PointStamped::ConstPtr& point);
  bool onWhy(mmradartwin_msgs::Why::Request& request, mmradartwin_msgs::Why::Response& response);
  /// Throws InputError where there is no answer.
  mmradartwin_msgs::Explanation answer(const geometry_msgs::PointStamped& point);
  mmradartwin_msgs::Explanation explain(double range_m, double azimuth_rad);
  void show(const mmradartwin_msgs::Explanation& explanation);
  void forget();

  std::string map_frame_;
  ros::Publisher explanation_, markers_;
  ros::Subscriber points_;
  ros::ServiceServer why_;
  std::optional<AskedPose> pose_;
  std::optional<Eigen::Vector2d> asked_;  ///< range, azimuth of the last answer
  ros::WallTime answered_;
};

}  // namespace mmradartwin
