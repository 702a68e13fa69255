#include "mmradartwin_attribution/ros/results_bag.h"

#include <mmradartwin_msgs/StoredPoses.h>
#include <rosbag/bag.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <array>
#include <mutex>
#include <optional>

#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_attribution/ros/markers.h"
#include "mmradartwin_dsp/ros/bag_writer.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_sim/ros/conversions.h"

namespace mmradartwin {
namespace {

constexpr double kSecondsPerPose = 2;

template <typename Message>
boost::shared_ptr<ros::M_string> latched() {
  auto header = boost::make_shared<ros::M_string>();
  (*header)["type"] = ros::message_traits::datatype<Message>();
  (*header)["md5sum"] = ros::message_traits::md5sum<Message>();
  (*header)["message_definition"] = ros::message_traits::definition<Message>();
  (*header)["latching"] = "1";
  (*header)["callerid"] = "/evaluate";
  return header;
}

}  // namespace

struct ResultsBag::Impl {
  Impl(const std::string& file, const EvaluationField& f, const RadarConfig& radar, const Scene& s)
      : field(f), radar_hash(radarHash(radar)), scene(s), writer(file), bag(writer.bag()) {
    bag.setCompression(rosbag::compression::LZ4);
  }
  ros::Time time(std::size_t pose, double after_s = 0) const {
    return ros::Time(1.0 + kSecondsPerPose * static_cast<double>(pose) + after_s);
  }

  EvaluationField field;
  std::uint64_t radar_hash;
  const Scene& scene;
  BagWriter writer;
  rosbag::Bag& bag;
  std::mutex mutex;
  std::size_t last_pose = 0;
  std::optional<tf2_msgs::TFMessage> last_tf;  ///< of that pose
};

ResultsBag::ResultsBag(const std::string& file, const EvaluationField& field, const RadarConfig& radar,
                       const Scene& scene, const std::string& twin_yaml)
    : impl_(std::make_unique<Impl>(file, field, radar, scene)) {
  try {
    mmradartwin_msgs::RadarConfig config = toMsg(radar);
    config.header.frame_id = "radar_link";
    impl_->bag.write("radar/config", impl_->time(0), config, latched<mmradartwin_msgs::RadarConfig>());
    mmradartwin_msgs::Scene twin = toMsg(scene, twin_yaml);
    twin.header.frame_id = "map";
    impl_->bag.write("twin/scene", impl_->time(0), twin, latched<mmradartwin_msgs::Scene>());
    impl_->bag.write("attribution/scene_markers", impl_->time(0), sceneMarkers(scene, "map"),
                     latched<visualization_msgs::MarkerArray>());
  } catch (const rosbag::BagException& error) {
    impl_->writer.fail(error);
  }
}

ResultsBag::~ResultsBag() = default;

void ResultsBag::add(const PoseResult& pose) try {
  // Every array stands for itself: rviz may be started anywhere in the bag.
  MarkerBuilder builder(impl_->field);
  const auto markers = builder.build(pose.attribution, pose.records, pose.pose.T_map_radar, pose.pose.name);
  auto residuals = toMsg(impl_->field, pose.attribution, pose.pose.name, pose.pose.T_map_radar);
  residuals.header.frame_id = "radar_link";
  residuals.header.stamp = impl_->time(pose.index);
  const PoseAttribution& attribution = pose.attribution;
  std::array<std::pair<const char*, mmradartwin_msgs::RangeAngleMap>, 3> maps = {
      {{"radar/range_angle", toMsg(impl_->field, attribution.measured, Branch::kMeasured, pose.pose.T_map_radar)},
       {"twin/range_angle", toMsg(impl_->field, attribution.simulated, Branch::kSimulated, pose.pose.T_map_radar)},
       {"attribution/residual_map", residualMapMsg(impl_->field, attribution, pose.pose.T_map_radar)}}};
  geometry_msgs::TransformStamped transform = tf2::eigenToTransform(pose.pose.T_map_radar);
  transform.header.frame_id = "map";
  transform.child_frame_id = "radar_link";

  const std::lock_guard<std::mutex> lock(impl_->mutex);
  if (!impl_->last_tf || pose.index >= impl_->last_pose) {
    impl_->last_pose = pose.index;
    impl_->last_tf.emplace().transforms.push_back(transform);
  }
  for (double after_s = 0; after_s < kSecondsPerPose; after_s += 0.5) {
    const ros::Time time = impl_->time(pose.index, after_s);
    transform.header.stamp = time;
    tf2_msgs::TFMessage tf;
    tf.transforms.push_back(transform);
    impl_->bag.write("/tf", time, tf);
  }
  if (!pose.records.empty()) {
    Simulation simulation;
    simulation.T_map_radar = pose.pose.T_map_radar;
    mmradartwin_msgs::PathRecords paths = toMsg(simulation, pose.records, impl_->scene, impl_->radar_hash);
    paths.header.stamp = residuals.header.stamp;
    paths.header.frame_id = "map";
    impl_->bag.write("twin/paths", impl_->time(pose.index, 0.05), paths);
  }
  for (auto& [topic, map] : maps) {
    map.header = residuals.header;
    map.radar_hash = impl_->radar_hash;
    map.frames = static_cast<std::uint32_t>(pose.frames);
    impl_->bag.write(topic, impl_->time(pose.index, 0.05), map);
  }
  impl_->bag.write("attribution/residuals", impl_->time(pose.index, 0.05), residuals);
  impl_->bag.write("attribution/markers", impl_->time(pose.index, 0.05), markers);
} catch (const rosbag::BagException& error) {
  impl_->writer.fail(error);
}

void ResultsBag::finish(const Evaluation& evaluation) try {
  mmradartwin_msgs::Ledger ledger = toMsg(evaluation.central, evaluation.duplicates);
  ledger.header.frame_id = "radar_link";
  ledger.header.stamp = impl_->time(0);
  impl_->bag.write("attribution/ledger", impl_->time(0), ledger, latched<mmradartwin_msgs::Ledger>());
  mmradartwin_msgs::StoredPoses poses;
  poses.header = ledger.header;
  poses.attribution_yaml = toYaml(impl_->field.config());
  for (const PoseResult& pose : evaluation.poses) {
    if (!pose.used) continue;
    poses.poses.push_back(poseFiguresMsg(pose.attribution, pose.pose.name));
    poses.poses.back().header.frame_id = "radar_link";
    poses.poses.back().header.stamp = impl_->time(pose.index);
  }
  impl_->bag.write("inspect/poses", impl_->time(0), poses, latched<mmradartwin_msgs::StoredPoses>());
  // The end of the last pose's time, in the file's last chunk: from there readers take the bag's end.
  if (impl_->last_tf) {
    const ros::Time end = impl_->time(impl_->last_pose + 1);
    impl_->last_tf->transforms.front().header.stamp = end;
    impl_->bag.write("/tf", end, *impl_->last_tf);
  }
  impl_->writer.close();
} catch (const rosbag::BagException& error) {
  impl_->writer.fail(error);
}

}  // namespace mmradartwin
