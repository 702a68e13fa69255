// Plays a session as if it were being measured: starts the DCA1000 emulator on its captures, or the emulator of a whole
// rig, and publishes the poses in tf on the emulator's schedule.
#include <ros/ros.h>
#include <std_msgs/Float32.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_broadcaster.h>
#include <tf2_ros/transform_listener.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <sstream>

#include "../emulator/child_process.h"
#include "../emulator/played_session.h"
#include "../emulator/pose_schedule.h"
#include "mmradartwin_driver/ros/live_session_message.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/strict_parameters.h"

namespace mmradartwin {
namespace {

class SessionPlayer {
 public:
  SessionPlayer() {
    StrictParameters parameters(ros::NodeHandle("~"));
    session_path_ = parameters.requiredText("session", "a session directory");
    card_ip_ = parameters.text("card_ip", "127.0.0.2");
    host_ip_ = parameters.text("host_ip", "127.0.0.1");
    config_port_ = parameters.integer("config_port", 4096, 1, 65535);
    data_port_ = parameters.integer("data_port", 4098, 1, 65535);
    start_delay_s_ = parameters.number("start_delay_s", 1.0, 0.0, 60.0);
    selection_.first = parameters.integer("first", 0, 0, 1 << 20);
    selection_.every = parameters.integer("every", 1, 1, 1 << 20);
    selection_.count = parameters.integer("count", 0, 0, 1 << 20);
    map_frame_ = parameters.text("map_frame", "map");
    radar_frame_ = parameters.text("radar_frame", "radar_link");
    camera_frame_ = parameters.text("camera_frame", "");
    tf_lead_s_ = parameters.number("tf_lead_s", 0.1, 0.0, 1.0);
    emulator_options_ = parameters.text("emulator_options", "");
    whole_rig_ = parameters.boolean("whole_rig", false);
    publish_poses_ = parameters.boolean("publish_poses", true);
    exit_when_done_ = parameters.boolean("exit_when_done", false);
    viewer_topic_ = parameters.text("viewer_topic", "");
    parameters.rejectUnknown();
    session_ = openPlayedSession(session_path_, "", selection_);
    for (const PoseProblem& problem : session_.problems) {
      ROS_ERROR_STREAM("pose " << problem.pose << " is left out: " << problem.message);
    }
    session_publisher_ = nh_.advertise<mmradartwin_msgs::Session>("session", 1, true);
    progress_publisher_ = ros::NodeHandle("~").advertise<std_msgs::Float32>("progress", 1, true);
  }

  /// Plays the session; returns the exit status of the program.
  int play() {
    findMount();
    if (!viewer_topic_.empty()) waitForViewer(nh_.resolveName(viewer_topic_));
    startEmulator();
    if (whole_rig_) return followRig();
    const std::optional<std::int64_t> start_ns = waitUntilArmed();
    if (!start_ns) return ros::ok() ? 1 : 0;
    publishSession(*start_ns);
    if (!followSchedule(*start_ns) || !waitForEnd()) return ros::ok() ? 1 : 0;
    publishProgress(1.0);
    ROS_INFO("the session has been played");
    if (!exit_when_done_) ros::waitForShutdown();  // the spinner of main() continues
    return session_.problems.empty() ? 0 : 2;
  }

 private:
  /// Waits for a subscriber of the topic: a window that opens late would miss what is played once.
  void waitForViewer(const std::string& topic) {
    constexpr double kWait_s = 60;
    const auto listenedTo = [&topic] {
      XmlRpc::XmlRpcValue request = ros::this_node::getName(), response, state;
      if (!ros::master::execute("getSystemState", request, response, state, false)) return false;
      XmlRpc::XmlRpcValue& subscribers = state[1];  // [[topic, [node, ...]], ...]
      for (int i = 0; i < subscribers.size(); ++i) {
        if (static_cast<std::string>(subscribers[i][0]) == topic) return true;
      }
      return false;
    };
    const ros::WallTime until = ros::WallTime::now() + ros::WallDuration(kWait_s);
    while (ros::ok() && !listenedTo()) {
      if (ros::WallTime::now() > until) {
        ROS_WARN_STREAM("nobody listens to " << topic << " after " << kWait_s << " s: playing without a viewer");
        return;
      }
      ROS_INFO_STREAM_THROTTLE(10, "waiting until somebody listens to " << topic);
      ros::WallDuration(0.2).sleep();
    }
  }

  /// Sets T_radar_camera from the static transform of the mount.
  void findMount() {
    if (camera_frame_.empty() || !publish_poses_) return;
    tf2_ros::Buffer buffer;
    const tf2_ros::TransformListener listener(buffer);
    constexpr double kWait_s = 20;
    try {
      T_radar_child_ =
          fromMsg(buffer.lookupTransform(radar_frame_, camera_frame_, ros::Time(0), ros::Duration(kWait_s)).transform);
    } catch (const tf2::TransformException& error) {
      throw InputError("no transform between " + camera_frame_ + " and " + radar_frame_ + " in tf (" + error.what() +
                       "): start a static_transform_publisher for the camera's mount, or leave camera_frame empty");
    }
  }

  void startEmulator() {
    std::vector<std::string> arguments = {session_path_, "--end-with-parent"};
    const auto add = [&arguments](const std::string& option, const std::string& value) {
      arguments.insert(arguments.end(), {option, value});
    };
    add("--first", std::to_string(selection_.first));
    add("--every", std::to_string(selection_.every));
    add("--count", std::to_string(selection_.count));
    add("--card-ip", card_ip_);
    add("--host-ip", host_ip_);
    if (!whole_rig_) {
      add("--config-port", std::to_string(config_port_));
      add("--data-port", std::to_string(data_port_));
      add("--start-delay-s", std::to_string(start_delay_s_));
      arguments.push_back("--once");
    }
    std::istringstream more(emulator_options_);
    for (std::string word; more >> word;) arguments.push_back(word);
    const std::string program = programBeside(whole_rig_ ? "emulated_rig" : "dca1000_emulator");
    emulator_ = std::make_unique<ChildProcess>(program, arguments);
  }

  /// Publishes poses for an emulated rig whose radar others start and stop: those of the running frames, and between
  /// runs the next pose. A frame's pose is constant from a quarter of a period before its start to a quarter after.
  /// Returns the exit status.
  int followRig() {
    constexpr std::int64_t kHold_ns = 50'000'000;
    const auto lead_ns = static_cast<std::int64_t>(tf_lead_s_ * 1e9);
    std::int64_t start_ns = 0, period_ns = 0, first = 0, sent = 0, last_stamp_ns = 0;
    bool run = false;
    const auto send = [&](std::int64_t frame, std::int64_t stamp_ns) {
      if (stamp_ns <= last_stamp_ns) return;
      last_stamp_ns = stamp_ns;
      sendPose(poseOfFrame(frame % session_.frames), toRosTime(stamp_ns));
    };
    while (ros::ok()) {
      while (const auto line = emulator_->readLine(5)) {
        ROS_INFO_STREAM("emulator: " << *line);
        std::istringstream words(*line);
        std::string what, how;
        words >> what >> how;
        if (what != "frames") continue;
        run = how == "run";
        for (std::string word; words >> word;) {
          const std::size_t equals = word.find('=');
          const std::int64_t value = std::stoll(word.substr(equals + 1));
          if (word.compare(0, equals, "first_frame_ns") == 0) start_ns = value;
          if (word.compare(0, equals, "period_ns") == 0) period_ns = value;
          if (word.compare(0, equals, "frame") == 0) first = value;
        }
        sent = 0;
      }
      if (const auto status = emulator_->exitStatus()) {
        ROS_ERROR_STREAM("the emulated rig has ended with status " << *status << ": its message stands above");
        return *status;
      }
      const std::int64_t now_ns = toNanoseconds(ros::Time::now());
      if (!run) {
        if (now_ns >= last_stamp_ns + kHold_ns) send(first, now_ns);
        continue;
      }
      // After a pause of this program only recent poses are sent.
      sent = std::max(sent, (now_ns - start_ns) / period_ns - 5);
      for (; start_ns + sent * period_ns - period_ns / 4 < now_ns + lead_ns; ++sent) {
        send(first + sent, start_ns + sent * period_ns - period_ns / 4);
        send(first + sent, start_ns + sent * period_ns + period_ns / 4);
      }
    }
    return 0;
  }

  const Eigen::Isometry3d& poseOfFrame(std::int64_t frame) const {
    for (const PlayedPose& pose : session_.poses) {
      if (frame < pose.first_frame + pose.frames) return pose.pose.T_map_radar;
    }
    return session_.poses.back().pose.T_map_radar;
  }

  std::optional<std::int64_t> waitUntilArmed() {
    const std::string kArmed = "armed first_frame_ns=";
    const ros::WallTime since = ros::WallTime::now();
    while (ros::ok()) {
      if (const auto line = emulator_->readLine(200)) {
        if (line->compare(0, kArmed.size(), kArmed) == 0) return std::stoll(line->substr(kArmed.size()));
        ROS_INFO_STREAM("emulator: " << *line);
        continue;
      }
      if (!emulatorRuns()) return std::nullopt;
      if ((ros::WallTime::now() - since).toSec() > 5) {
        ROS_WARN_STREAM_THROTTLE(10, "the emulated card at " << card_ip_
                                                             << " waits to be armed: start driver_node with card_ip "
                                                             << card_ip_ << " and host_ip " << host_ip_);
      }
    }
    return std::nullopt;
  }

  bool emulatorRuns() {
    const auto status = emulator_->exitStatus();
    if (!status) return true;
    ROS_ERROR_STREAM("the emulator has ended with status " << *status << ": its message stands above");
    return false;
  }

  void publishSession(std::int64_t start_ns) {
    std::vector<LivePose> poses;
    for (std::size_t i = 0; i < session_.poses.size(); ++i) {
      poses.push_back({session_.poses[i].pose.name, poseStart_ns(session_, i, start_ns), session_.poses[i].capture});
    }
    auto message = liveSessionMessage(session_path_, poses);
    message.header.frame_id = map_frame_;
    session_publisher_.publish(message);
  }

  bool followSchedule(std::int64_t start_ns) {
    std::optional<std::size_t> current;
    for (const ScheduledPose& due : schedulePoses(session_, start_ns)) {
      const ros::Time at = toRosTime(due.stamp_ns);
      const ros::WallTime send_at = ros::WallTime(at.sec, at.nsec) - ros::WallDuration(tf_lead_s_);
      while (ros::ok() && ros::WallTime::now() < send_at) {
        const double wait_s = std::min((send_at - ros::WallTime::now()).toSec(), 0.1);
        if (wait_s > 0) ros::WallDuration(wait_s).sleep();
      }
      if (!ros::ok()) return false;
      if (current != due.pose) {
        current = due.pose;
        if (!emulatorStillPlays()) return false;
        announce(due.pose);
      }
      sendPose(session_.poses[due.pose].pose.T_map_radar, at);
    }
    return true;
  }

  bool emulatorStillPlays() {
    while (const auto line = emulator_->readLine(0)) logEmulator(*line);
    return emulatorRuns();
  }

  void logEmulator(const std::string& line) {
    if (line.compare(0, 9, "completed") == 0) completed_ = true;
    ROS_INFO_STREAM("emulator: " << line);
  }

  void announce(std::size_t i) {
    const PlayedPose& played = session_.poses[i];
    ROS_INFO_STREAM("pose " << i + 1 << " of " << session_.poses.size() << ": " << played.pose.name << " at location "
                            << played.pose.location << ", " << played.frames << " frames");
    publishProgress(static_cast<double>(played.first_frame) / static_cast<double>(session_.frames));
  }

  void publishProgress(double share) {
    std_msgs::Float32 message;
    message.data = static_cast<float>(share);
    progress_publisher_.publish(message);
  }

  void sendPose(const Eigen::Isometry3d& T_map_radar, const ros::Time& stamp) {
    if (!publish_poses_) return;  // another node publishes them
    geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_map_radar * T_radar_child_);
    message.header.stamp = stamp;
    message.header.frame_id = map_frame_;
    message.child_frame_id = camera_frame_.empty() ? radar_frame_ : camera_frame_;
    broadcaster_.sendTransform(message);
  }

  /// Waits for the last samples, which follow some 2 s after the last frame.
  bool waitForEnd() {
    const ros::WallTime until = ros::WallTime::now() + ros::WallDuration(20);
    while (ros::ok() && ros::WallTime::now() < until) {
      while (const auto line = emulator_->readLine(100)) logEmulator(*line);
      if (emulator_->exitStatus()) break;
    }
    if (!completed_ && ros::ok()) ROS_ERROR("the emulator has not played the session to its end");
    return completed_;
  }

  std::string session_path_, card_ip_, host_ip_, map_frame_, radar_frame_, camera_frame_, emulator_options_,
      viewer_topic_;
  int config_port_ = 0, data_port_ = 0;
  double start_delay_s_ = 0, tf_lead_s_ = 0;
  bool exit_when_done_ = false, completed_ = false, whole_rig_ = false, publish_poses_ = true;
  PlayedSelection selection_;
  PlayedSession session_;
  Eigen::Isometry3d T_radar_child_ = Eigen::Isometry3d::Identity();  ///< child: what is published below map
  ros::NodeHandle nh_;
  ros::Publisher session_publisher_, progress_publisher_;
  tf2_ros::TransformBroadcaster broadcaster_;
  std::unique_ptr<ChildProcess> emulator_;
};

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  ros::init(argc, argv, "session_player");
  const ros::NodeHandle keep_alive;  // outlives the player: roscpp stops printing with the last handle
  // The spinner serves tf while this thread keeps the schedule.
  ros::AsyncSpinner spinner(1);
  spinner.start();
  try {
    mmradartwin::SessionPlayer player;
    const mmradartwin::MasterWatch master_watch;
    return player.play();
  } catch (const mmradartwin::InputError& error) {
    ROS_FATAL_STREAM(error.what());
    return 2;
  } catch (const std::exception& error) {
    ROS_FATAL_STREAM(error.what());
    return 1;
  }
}
