#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mmradartwin_msgs/EditTwin.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/SaveTwin.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_attribution/ros/actor_handles.h"
#include "mmradartwin_attribution/what_if_comparison.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/topic_watch.h"
#include "mmradartwin_sim/what_if.h"

namespace mmradartwin {

/// radar/config, session, twin/scene, radar/range_angle -> what_if/range_angle, what_if/residual_map,
/// what_if/residuals, what_if/scene_markers, what_if/state; services what_if/edit, what_if/undo, what_if/revert,
/// what_if/save; interactive markers what_if/handles.
///
/// A twin that is changed by hand, beside the one as given, at the pose of the last measured map. What it is compared
/// with comes from a radar, a bag or stored results alike, and the twin that these simulate stays as it is. The twin as
/// given is that of the parameters `twin` and `radar`, else of twin/scene; another one there begins anew. Callbacks
/// must come one at a time.
class WhatIfNode {
 public:
  /// Throws InputError for unknown or unusable parameters.
  WhatIfNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  static NodeDescription description();

 private:
  using MapMsg = mmradartwin_msgs::RangeAngleMap;
  using Edit = mmradartwin_msgs::EditTwin;

  struct Settings {
    explicit Settings(StrictParameters& parameters);

    std::string plugins, config_file, results_folder, twin_file, radar_file, scene_file, output_folder, map_frame,
        radar_frame;
    double rate_hz;
    std::uint64_t seed;
  };

  void onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg);
  void onScene(const mmradartwin_msgs::Scene::ConstPtr& msg);
  void onSession(const mmradartwin_msgs::Session::ConstPtr& msg);
  void onMeasured(const MapMsg::ConstPtr& msg);
  void onTimer(const ros::WallTimerEvent&);
  bool onEdit(Edit::Request& request, Edit::Response& response);
  /// Calls undo() or revert() and shows what is left; done: what to say then.
  bool goBack(bool (WhatIf::*how)(), const std::string& done, std_srvs::Trigger::Response& response);
  bool onUndo(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool onRevert(std_srvs::Trigger::Request& request, std_srvs::Trigger::Response& response);
  bool onSave(mmradartwin_msgs::SaveTwin::Request& request, mmradartwin_msgs::SaveTwin::Response& response);
  void onHandle(const HandleMove& move);
  void moveByHandle();

  /// Makes the twin as given of what is known by now; without enough of it there is none.
  void begin();
  void forget();
  WhatIf& whatIf();  ///< throws InputError where there is none yet
  void apply(const Edit::Request& request);
  /// Compares with the last measured map and publishes; `changed`: the twin was, or what it is compared with.
  void show(bool changed);
  void publishState();
  void publishScene();
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  ros::NodeHandle nh_;
  const Settings settings_;
  AttributionConfig config_;
  std::optional<RadarConfig> radar_;
  std::uint64_t radar_hash_ = 0;
  mmradartwin_msgs::Scene::ConstPtr scene_;  ///< of the twin node
  std::map<std::int64_t, std::string> pose_names_;
  std::unique_ptr<WhatIf> what_if_;
  std::unique_ptr<WhatIfComparison> comparison_;
  std::string problem_;
  MapMsg::ConstPtr measured_;
  bool pending_ = false;  ///< measured_ has not been compared yet
  bool compared_ = false;
  ros::WallTime shown_at_, edited_at_;
  double changed_ms_ = 0;  ///< that the last change took until it could be simulated
  double shown_ms_ = 0;
  std::optional<HandleMove> move_;  ///< that waits
  std::uint64_t edits_ = 0, refused_ = 0;

  ros::Publisher map_, residual_map_, residuals_, state_, scene_markers_;
  std::vector<ros::Subscriber> subscribers_;
  std::vector<ros::ServiceServer> services_;
  TopicWatch heard_{"the signal chain, or the player of results"};
  ros::Subscriber measured_subscriber_;
  std::unique_ptr<ActorHandles> handles_;
  ros::WallTimer timer_, diagnostics_timer_;
  std::unique_ptr<diagnostic_updater::Updater> updater_;
};

}  // namespace mmradartwin
