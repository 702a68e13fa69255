#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <dynamic_reconfigure/server.h>
#include <mmradartwin_attribution/TuningConfig.h>
#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/Residuals.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/ros.h>
#include <sensor_msgs/PointCloud2.h>

#include <Eigen/Geometry>
#include <boost/thread/recursive_mutex.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_attribution/live_ledger.h"
#include "mmradartwin_attribution/mover_mask.h"
#include "mmradartwin_attribution/response.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_attribution/ros/detection_publisher.h"
#include "mmradartwin_attribution/ros/markers.h"
#include "mmradartwin_attribution/ros/why_server.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/ros/map_publisher.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/topic_watch.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

using TuningConfig = mmradartwin_attribution::TuningConfig;  // made of cfg/Tuning.cfg

/// radar/config, session, twin/scene, twin/moved_scene, twin/paths, radar/range_angle, radar/points, twin/range_angle
/// -> attribution/residuals, attribution/residual_map, attribution/ledger, attribution/markers,
/// attribution/scene_markers, twin/points, attribution/detection_agreement, attribution/pose; and answers what stands
/// behind a place (why_server.h).
///
/// Matches measured and simulated maps by stamp and attributes what differs. Poses are named after the session's
/// poses.csv; else the ledger names them after their stamp. The scene is that of the parameter `scene`, else of
/// twin/scene; where twin/scene brings another twin the ledger begins anew, and where stamps go back by more than a
/// second (a bag that loops). Markers and ledger come `markers_hz` times a second at most, with up to `max_paths`
/// paths. What is tuned by eye is changed below ~tuning, by dynamic_reconfigure, and the last pair of maps shows it; it
/// begins with what parameters and attribution.yaml say in each run. Callbacks must come one at a time.
class AttributionNode {
 public:
  /// Throws InputError for unknown or unusable parameters.
  AttributionNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  static NodeDescription description();

 private:
  using MapMsg = mmradartwin_msgs::RangeAngleMap;

  struct Settings {
    explicit Settings(StrictParameters& parameters);

    std::string config_file, scene_file, radar_frame, map_frame;
    double markers_hz;
    int max_paths;
    DetectionPublisher::Settings detections;
  };

  void onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg);
  void onScene(const mmradartwin_msgs::Scene::ConstPtr& msg);
  void onMovedScene(const mmradartwin_msgs::Scene::ConstPtr& msg);
  void onSession(const mmradartwin_msgs::Session::ConstPtr& msg);
  void onPaths(const mmradartwin_msgs::PathRecords::ConstPtr& msg);
  void onMeasured(const MapMsg::ConstPtr& msg);
  void onSimulated(const MapMsg::ConstPtr& msg);
  void followMovers();
  void subscribeToPoints();
  void onPoints(const sensor_msgs::PointCloud2::ConstPtr& msg);
  void onMap(const MapMsg::ConstPtr& msg, std::map<std::int64_t, MapMsg::ConstPtr>& own,
             std::map<std::int64_t, MapMsg::ConstPtr>& other, bool measured);
  void startTuning(const ros::NodeHandle& private_nh);
  void onTuning(TuningConfig& wanted);
  /// Compares the last pair of maps once more.
  void compareLastPair();
  void setScene(Scene scene);
  void onSceneViewer();
  void showSceneToNewViewer();
  void publishScene();
  void rebuild();
  void beginAnew();
  void publishLedger(const ros::Time& stamp);
  const std::vector<ResponseRegion>& regionsAt(const Eigen::Isometry3d& T);
  void publishFigures(const PoseAttribution& pose, const mmradartwin_msgs::Residuals& residuals,
                      const Eigen::Isometry3d& T, std::uint32_t frames);
  void compare(const MapMsg& measured_msg, const MapMsg& simulated_msg);
  /// Of the session's pose, empty where none is defined.
  std::string nameAt(std::int64_t stamp_ns) const;
  void watch(const ros::WallTimerEvent&);
  /// What takes seconds with a large scene: said before and after, here and in diagnostics.
  void announce(const std::string& work);
  void announceEnd(const ros::WallTime& begin);
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  ros::NodeHandle nh_;
  const Settings settings_;
  AttributionConfig config_;
  TuningConfig tuned_;
  boost::recursive_mutex tuning_mutex_;  ///< of tuning_, which wants one
  std::unique_ptr<dynamic_reconfigure::Server<TuningConfig>> tuning_;
  std::string twin_yaml_;
  MapPublisher<MapMsg> residual_map_;
  ros::Publisher residuals_, pose_figures_, ledger_, markers_, scene_markers_;
  std::unique_ptr<DetectionPublisher> detections_;
  std::unique_ptr<WhyServer> why_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Subscriber measured_subscriber_, simulated_subscriber_;
  ros::Subscriber points_subscriber_;  ///< until it is known that frames tell no speeds
  TopicWatch measured_heard_{"the signal chain"}, simulated_heard_{"the twin, and the signal chain"};
  std::unique_ptr<diagnostic_updater::Updater> updater_;
  ros::WallTimer diagnostics_timer_;
  bool slow_ = true;            ///< expected regions took long, or were not found yet
  std::string work_, problem_;  ///< what it is busy with; why the last pair was not compared
  ros::WallTimer watchdog_;
  ros::WallTime last_markers_, scene_published_, scene_viewer_since_;  // zero: never, nobody new
  bool scene_due_ = false;
  std::uint32_t had_subscribers_ = 0;
  std::size_t pairs_ = 0, pairs_before_ = 0, received_ = 0, received_before_ = 0;

  std::map<std::int64_t, MapMsg::ConstPtr> measured_, simulated_;  // waiting, by stamp
  std::optional<std::int64_t> newest_ns_;                          // of the measured maps
  MapMsg::ConstPtr last_measured_, last_simulated_;                // the last pair
  mmradartwin_msgs::PathRecords::ConstPtr paths_, records_of_;
  std::shared_ptr<const std::vector<PathRecord>> records_ = std::make_shared<std::vector<PathRecord>>();
  std::map<std::int64_t, std::string> pose_names_;

  std::unique_ptr<RadarConfig> radar_;
  std::uint64_t radar_hash_ = 0;
  std::shared_ptr<const Scene> scene_;
  std::unique_ptr<Scene> moved_scene_;  ///< as it is simulated, where actors stand elsewhere than in scene_
  ros::Time scene_stamp_, moved_scene_stamp_;
  std::unique_ptr<RayCaster> rays_;
  std::shared_ptr<const EvaluationField> field_;
  std::unique_ptr<MoverMask> movers_;
  int masked_cells_ = 0;  ///< of the last pair
  std::unique_ptr<RegionModel> regions_;
  std::unique_ptr<MarkerBuilder> builder_;
  std::vector<ResponseRegion> regions_of_pose_;
  Eigen::Isometry3d regions_at_ = Eigen::Isometry3d::Identity();
  bool regions_valid_ = false;
  LiveLedger live_ledger_;
};

}  // namespace mmradartwin
