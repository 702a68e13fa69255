// Shows what evaluate left behind, one pose on request: the messages of results.bag as the live nodes send them, so
// that rviz, its panel and others need not know where they come from.

#include <geometry_msgs/TransformStamped.h>
#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/ShowPose.h>
#include <mmradartwin_msgs/ShownPose.h>
#include <mmradartwin_msgs/StoredPoses.h>
#include <ros/ros.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <std_srvs/SetBool.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "mmradartwin_attribution/pose_walk.h"
#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_attribution/ros/why_server.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"

namespace {

using namespace mmradartwin;

struct Settings {
  explicit Settings(StrictParameters& parameters);

  std::string results, pose, order;
  double seconds_per_pose;
  bool play;
};

Settings::Settings(StrictParameters& parameters) {
  results = parameters.requiredPath("results", "output folder of evaluate, which holds results.bag");
  order = parameters.text("order", "recorded",
                          "recorded, recall, q1_energy, q2_energy or residual_rms_db: the order of the poses, the last "
                          "four with the worst first");
  pose = parameters.text("pose", "first", "name of the pose to begin with; first: the first of the order");
  seconds_per_pose =
      parameters.number("seconds_per_pose", 2, 0.05, 3600, "how long a pose is shown while they play, s");
  play = parameters.boolean("play", true, "true: the poses are shown one after the other; false: the first one stays");
}

NodeDescription description() {
  using mmradartwin_msgs::RangeAngleMap;
  return {"inspect_node",
          "inspect",
          "Shows what evaluate left behind, one pose on request.",
          {topic<geometry_msgs::PointStamped>("clicked_point", "a place to explain, in map or in the radar's frame")},
          {topic<mmradartwin_msgs::StoredPoses>("inspect/poses",
                                                "how well twin and measurement agree at each pose; latched"),
           topic<mmradartwin_msgs::ShownPose>("inspect/shown", "which pose is shown; latched"),
           topic<mmradartwin_msgs::PoseFigures>("attribution/pose", "how well they agree at that pose; latched"),
           topic<RangeAngleMap>("radar/range_angle", "its measured map; latched"),
           topic<RangeAngleMap>("twin/range_angle", "its simulated map; latched"),
           topic<RangeAngleMap>("attribution/residual_map", "the difference, simulated - measured, as a map; latched"),
           topic<mmradartwin_msgs::Residuals>("attribution/residuals", "what differs in them; latched"),
           topic<visualization_msgs::MarkerArray>("attribution/markers",
                                                  "the radar, boxes on the floor and paths for rviz; latched"),
           topic<mmradartwin_msgs::PathRecords>("twin/paths", "paths of the simulation; latched"),
           topic<mmradartwin_msgs::Ledger>("attribution/ledger", "metrics over all poses; latched"),
           topic<visualization_msgs::MarkerArray>("attribution/scene_markers", "the scene for rviz; latched"),
           topic<mmradartwin_msgs::Scene>("twin/scene", "scene and twin that were compared; latched"),
           topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
           topic<mmradartwin_msgs::Explanation>("attribution/explanation",
                                                "what stands behind the place that was asked for; latched"),
           topic<visualization_msgs::MarkerArray>("attribution/explanation_markers",
                                                  "that place, its actor and paths for rviz; latched"),
           topic<tf2_msgs::TFMessage>("/tf_static", "where the radar is at the shown pose")},
          {service<mmradartwin_msgs::ShowPose>("inspect/show", "show another pose"),
           service<std_srvs::SetBool>("inspect/play", "true: show the poses one after the other; false: stop"),
           service<mmradartwin_msgs::Why>("attribution/why", "what stands behind a place")},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

/// results.bag, read by topic and time.
class StoredResults {
 public:
  explicit StoredResults(const std::string& folder) : folder_(folder), file_(folder + "/results.bag") {
    if (!std::filesystem::is_regular_file(file_)) {
      throw InputError(file_ +
                       ": is no file; evaluate writes it unless it was told --no-bag: evaluate again without that");
    }
    try {
      bag_.open(file_, rosbag::bagmode::Read);
    } catch (const rosbag::BagException& error) {
      throw InputError(file_ + ": cannot be read: " + error.what());
    }
    const auto poses = only<mmradartwin_msgs::StoredPoses>("inspect/poses");
    if (!poses) throw InputError(file_ + ": was written by an evaluate before 0.3; evaluate again");
    poses_ = *poses;
    const std::string report = folder + "/report.html";
    if (std::filesystem::is_regular_file(report)) poses_.report_file = report;
  }
  const mmradartwin_msgs::StoredPoses& poses() const { return poses_; }
  std::string whereFrom() const { return file_; }

  /// The only message of a topic, nullptr where there is none.
  template <typename Message>
  boost::shared_ptr<Message> only(const std::string& topic) {
    rosbag::View view(bag_, rosbag::TopicQuery(topic));
    return view.size() == 0 ? nullptr : view.begin()->instantiate<Message>();
  }
  /// The first message of a topic while the pose is shown.
  template <typename Message>
  boost::shared_ptr<Message> ofPose(const std::string& topic, std::size_t index) {
    const ros::Time begin = poses_.poses[index].header.stamp;
    rosbag::View view(bag_, rosbag::TopicQuery(topic), begin, begin + ros::Duration(1.9));
    return view.size() == 0 ? nullptr : view.begin()->instantiate<Message>();
  }

 private:
  std::string folder_, file_;
  rosbag::Bag bag_;
  mmradartwin_msgs::StoredPoses poses_;
};

std::vector<PoseScore> scoresOf(const mmradartwin_msgs::StoredPoses& stored) {
  std::vector<PoseScore> scores;
  for (const mmradartwin_msgs::PoseFigures& pose : stored.poses) {
    scores.push_back({pose.figures.recall, pose.figures.q1_energy, pose.figures.q2_energy, pose.residual_rms_db});
  }
  return scores;
}

class InspectNode {
 public:
  explicit InspectNode(const Settings& settings)
      : settings_(settings), results_(settings.results), walk_(scoresOf(results_.poses())), why_(nh_, "map") {
    poses_ = nh_.advertise<mmradartwin_msgs::StoredPoses>("inspect/poses", 1, true);
    shown_ = nh_.advertise<mmradartwin_msgs::ShownPose>("inspect/shown", 1, true);
    tf_ = nh_.advertise<tf2_msgs::TFMessage>("/tf_static", 10, true);
    for (const char* topic : {"radar/range_angle", "twin/range_angle", "attribution/residual_map"}) {
      publishers_[topic] = nh_.advertise<mmradartwin_msgs::RangeAngleMap>(topic, 1, true);
    }
    publishers_["attribution/residuals"] = nh_.advertise<mmradartwin_msgs::Residuals>("attribution/residuals", 1, true);
    publishers_["attribution/markers"] = nh_.advertise<visualization_msgs::MarkerArray>("attribution/markers", 1, true);
    publishers_["attribution/pose"] = nh_.advertise<mmradartwin_msgs::PoseFigures>("attribution/pose", 1, true);
    publishers_["twin/paths"] = nh_.advertise<mmradartwin_msgs::PathRecords>("twin/paths", 1, true);
    publishStanding();
    orderBy(settings.order);
    if (settings.pose != "first") showNamed(settings.pose);
    show_ = nh_.advertiseService("inspect/show", &InspectNode::onShow, this);
    play_ = nh_.advertiseService("inspect/play", &InspectNode::onPlay, this);
    timer_ = nh_.createWallTimer(ros::WallDuration(settings.seconds_per_pose), &InspectNode::onTick, this);
    playing_ = settings.play;
    show();
    ROS_INFO("%s: %zu poses", results_.whereFrom().c_str(), walk_.count());
  }

 private:
  /// What is the same of all poses.
  void publishStanding() {
    poses_.publish(results_.poses());
    latch<visualization_msgs::MarkerArray>("attribution/scene_markers");
    latch<mmradartwin_msgs::Ledger>("attribution/ledger");
    if (const auto scene = latch<mmradartwin_msgs::Scene>("twin/scene")) {
      scene_ = std::make_shared<const Scene>(actorsFromMsg(*scene));
    }
    if (const auto radar = latch<mmradartwin_msgs::RadarConfig>("radar/config")) {
      const RadarConfig config = fromMsg(*radar);
      field_ = std::make_shared<const EvaluationField>(
          parseAttributionConfig(results_.poses().attribution_yaml, results_.whereFrom()), config,
          SignalChain(config).axes());
    }
  }

  template <typename Message>
  boost::shared_ptr<Message> latch(const std::string& topic) {
    const boost::shared_ptr<Message> message = results_.only<Message>(topic);
    if (!message) return message;
    publishers_[topic] = nh_.advertise<Message>(topic, 1, true);
    publishers_[topic].publish(*message);
    return message;
  }

  void orderBy(const std::string& name) {
    const std::optional<PoseOrder> order = poseOrderOf(name);
    if (!order) {
      throw InputError("order '" + name +
                       "' is not known; there are recorded, recall, q1_energy, q2_energy and "
                       "residual_rms_db");
    }
    walk_.setOrder(*order);
    walk_.showFirst();
  }

  void showNamed(const std::string& name) {
    const auto& poses = results_.poses().poses;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (poses[i].name == name) return walk_.show(i);
    }
    throw InputError("pose '" + name + "' is not among those that were compared; the first is '" + poses.front().name +
                     "'");
  }

  bool onShow(mmradartwin_msgs::ShowPose::Request& request, mmradartwin_msgs::ShowPose::Response& response) {
    try {
      if (!request.order.empty()) {
        const std::size_t before = walk_.index();
        orderBy(request.order);
        walk_.show(before);
      }
      if (request.pose == "first") {
        walk_.showFirst();
      } else if (!request.pose.empty()) {
        showNamed(request.pose);
      }
      walk_.step(request.step);
      show();
      response.success = true;
      response.message = "pose " + results_.poses().poses[walk_.index()].name;
    } catch (const InputError& error) {
      response.message = error.what();
    }
    return true;
  }

  bool onPlay(std_srvs::SetBool::Request& request, std_srvs::SetBool::Response& response) {
    playing_ = request.data;
    timer_.stop();
    timer_.start();  // a whole time for this pose
    publishShown();
    response.success = true;
    response.message = playing_ ? "playing" : "stopped";
    return true;
  }

  void onTick(const ros::WallTimerEvent&) {
    if (!playing_) return;
    walk_.step(1);
    show();
  }

  void publishShown() {
    mmradartwin_msgs::ShownPose shown;
    shown.header.stamp = stamp_;
    shown.header.frame_id = "radar_link";
    shown.index = static_cast<std::uint32_t>(walk_.index());
    shown.rank = static_cast<std::uint32_t>(walk_.rank());
    shown.count = static_cast<std::uint32_t>(walk_.count());
    shown.name = results_.poses().poses[walk_.index()].name;
    shown.order = poseOrderName(walk_.order());
    shown.playing = playing_;
    shown_.publish(shown);
  }

  template <typename Message>
  boost::shared_ptr<Message> publish(const std::string& topic) {
    const boost::shared_ptr<Message> message = results_.ofPose<Message>(topic, walk_.index());
    if (!message) return message;
    message->header.stamp = stamp_;
    publishers_[topic].publish(*message);
    return message;
  }

  void show() {
    stamp_ = ros::Time::now();
    const std::size_t index = walk_.index();
    if (const auto tf = results_.ofPose<tf2_msgs::TFMessage>("/tf", index)) {
      for (auto& transform : tf->transforms) transform.header.stamp = stamp_;
      tf_.publish(*tf);
    }
    const auto measured = publish<mmradartwin_msgs::RangeAngleMap>("radar/range_angle");
    const auto simulated = publish<mmradartwin_msgs::RangeAngleMap>("twin/range_angle");
    publish<mmradartwin_msgs::RangeAngleMap>("attribution/residual_map");
    const auto residuals = publish<mmradartwin_msgs::Residuals>("attribution/residuals");
    const auto paths = publish<mmradartwin_msgs::PathRecords>("twin/paths");
    if (const auto markers = results_.ofPose<visualization_msgs::MarkerArray>("attribution/markers", index)) {
      publishers_["attribution/markers"].publish(*markers);
    }
    mmradartwin_msgs::PoseFigures figures = results_.poses().poses[index];
    figures.header.stamp = stamp_;
    publishers_["attribution/pose"].publish(figures);
    publishShown();
    if (field_ && measured && simulated && residuals) beAsked(*measured, *simulated, *residuals, paths.get());
  }

  void beAsked(const mmradartwin_msgs::RangeAngleMap& measured, const mmradartwin_msgs::RangeAngleMap& simulated,
               const mmradartwin_msgs::Residuals& residuals, const mmradartwin_msgs::PathRecords* paths) {
    AskedPose asked;
    asked.header = residuals.header;
    asked.name = residuals.pose;
    asked.T_map_radar = fromMsg(residuals.T_map_radar);
    asked.attribution = attributionFromMsg(residuals, scene_.get());
    asked.attribution.measured = field_->normalise(fromMsg(measured));
    asked.attribution.simulated = field_->normalise(fromMsg(simulated));
    asked.field = field_;
    asked.scene = scene_;
    asked.records = std::make_shared<const std::vector<PathRecord>>(paths && scene_ ? pathsFromMsg(*paths, *scene_)
                                                                                    : std::vector<PathRecord>());
    why_.setPose(std::move(asked));
  }

  const Settings settings_;
  ros::NodeHandle nh_;
  StoredResults results_;
  PoseWalk walk_;
  WhyServer why_;
  std::shared_ptr<const EvaluationField> field_;
  std::shared_ptr<const Scene> scene_;
  ros::Publisher poses_, shown_, tf_;
  std::map<std::string, ros::Publisher> publishers_;
  ros::ServiceServer show_, play_;
  ros::WallTimer timer_;
  ros::Time stamp_;
  bool playing_ = true;
};

}  // namespace

int main(int argc, char** argv) {
  return runNode(argc, argv, description(), [] {
    const InspectNode node(readSettings<Settings>(ros::NodeHandle("~")));
    const MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
