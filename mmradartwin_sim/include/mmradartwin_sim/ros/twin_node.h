#pragma once

#include <diagnostic_updater/diagnostic_updater.h>
#include <mmradartwin_msgs/ApplyTwin.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/ReceiveGrid.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/ros.h>
#include <tf2_ros/buffer.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/topic_watch.h"
#include "mmradartwin_dsp/ros/transform_reader.h"
#include "mmradartwin_dsp/ros/transform_watch.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_sim/cell_records.h"
#include "mmradartwin_sim/moving_twin.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// radar/config, session, radar/grid, tf -> twin/grid, twin/paths, twin/scene, diagnostics; service twin/apply.
///
/// Simulates at the pose of each measured grid that has one, and at `rate_hz` along tf while no measurement comes.
/// Records are used again while the radar stands within `reuse_m` and `reuse_deg`. Of grids that come while one is
/// simulated the newest is taken and the others are counted as skipped. Callbacks must come one at a time.
///
/// An actor moves with the tf frame of its name (`actor_frame_prefix` before it), which stands for its mesh file's
/// frame: in `map_frame`, at the grid's stamp or the latest before it. Without such a frame it stays where it is.
///
/// The scene is that of the parameter `scene`, else of the latched session message, whose files are unpacked into a
/// temporary folder. twin/apply puts another twin in the place of the one simulated, from the last measured grid on;
/// twin/scene says which, and twin/moved_scene where its actors stand if elsewhere. It stays until another is applied,
/// or a session with other files comes. `diffuse_records` says whether twin/paths holds scatter points summed by cells
/// of a facet (`cells`) or all
/// (`points`). `channels` names what the measured branch is corrected by: a twin with the same channel errors is
/// refused.
class TwinNode {
 public:
  /// Throws InputError for unknown or unusable parameters.
  TwinNode(ros::NodeHandle nh, const ros::NodeHandle& private_nh);
  static NodeDescription description();

 private:
  struct Settings {
    explicit Settings(StrictParameters& parameters);

    std::string plugins, scene_file, twin_file, radar_file, channels_file, map_frame, radar_frame, actor_frame_prefix;
    std::string base_folder, apply_folder;
    double rate_hz, reuse_m, reuse_rad;
    std::uint64_t seed;
    DiffuseRecords diffuse_records;
  };

  void onConfig(const mmradartwin_msgs::RadarConfig::ConstPtr& config);
  void onSession(const mmradartwin_msgs::Session::ConstPtr& session);
  void onGrid(const mmradartwin_msgs::ReceiveGrid::ConstPtr& grid);
  void onPending(const ros::WallTimerEvent&);
  void onRate(const ros::WallTimerEvent&);
  bool onApply(mmradartwin_msgs::ApplyTwin::Request& request, mmradartwin_msgs::ApplyTwin::Response& response);
  std::optional<std::string> sceneFile() const;
  /// twin.yaml of the parameter, else of the session; "" for the base mechanisms.
  std::string startingTwin() const;
  /// Throws InputError where it cannot be simulated.
  std::unique_ptr<Twin> makeTwin(const std::string& twin_file) const;
  /// The file of a request. Throws InputError, with nothing of the file in it, where twin/apply may not read it.
  std::string allowedTwin(const std::string& file) const;
  void use(std::unique_ptr<Twin> twin);
  void publishMovedScene(const Scene& scene);
  void rebuild();
  void forgetSimulations();  ///< those of a twin that goes
  /// What to say of a pose without any path; what may help is looked for once a twin.
  std::string noEchoAt(const Eigen::Isometry3d& T_map_radar);
  void simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns);
  /// Where tf has the radar at a stamp; beyond its end, as if it went on as it did as long before.
  std::optional<Eigen::Isometry3d> reportedPose(std::int64_t stamp_ns) const;
  /// Tells the moving twin where tf has its actors; true where one of them moved.
  bool placeActors(std::int64_t stamp_ns);
  bool alike(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) const;  ///< within reuse_m and reuse_deg
  void diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) const;

  const Settings settings_;
  std::optional<ChannelCorrection> channels_;

  std::optional<RadarConfig> radar_;
  std::uint64_t radar_hash_ = 0;  ///< of the twin's radar
  mmradartwin_msgs::Session::ConstPtr session_;
  std::unique_ptr<TemporaryFolder> session_folder_;  ///< the session, unpacked
  std::optional<std::string> session_scene_, session_twin_;
  std::optional<std::string> applied_twin_;  ///< file that twin/apply named
  std::unique_ptr<Twin> twin_;
  std::string problem_;                ///< why there is no twin, or the last pose gave nothing
  std::optional<std::string> advice_;  ///< for poses without any path
  std::optional<MovingTwin> moving_;   ///< of twin_, where tf has actors of it
  std::vector<std::pair<std::string, Eigen::Isometry3d>> actors_;  ///< those, and where they were placed
  std::optional<Simulation> still_;                                ///< last simulation where no actor moves
  const Simulation* last_ = nullptr;                               ///< still_, or that of moving_
  std::int64_t last_ns_ = 0;                                       ///< stamp of the last grid published

  /// Where and when the last measured grid was simulated.
  std::optional<std::pair<Eigen::Isometry3d, std::int64_t>> measured_;
  mmradartwin_msgs::ReceiveGrid::ConstPtr pending_;
  TopicWatch grids_{"the signal chain"};
  ros::WallTime measured_at_, published_at_, moved_scene_at_;
  bool moved_scene_due_ = false;  ///< actors were placed since it was published
  std::uint64_t simulated_ = 0, reused_ = 0, skipped_ = 0, without_pose_ = 0, actor_moves_ = 0;
  double simulate_ms_ = 0;

  tf2_ros::Buffer tf_buffer_;
  std::optional<TransformReader> tf_reader_;
  std::optional<TransformWatch> tf_watch_;
  ros::Publisher grid_publisher_, paths_publisher_, scene_publisher_, moved_scene_publisher_;
  ros::Subscriber config_subscriber_, session_subscriber_, grid_subscriber_;
  ros::ServiceServer apply_service_;
  ros::WallTimer pending_timer_, rate_timer_, diagnostics_timer_;
  std::unique_ptr<diagnostic_updater::Updater> updater_;
};

}  // namespace mmradartwin
