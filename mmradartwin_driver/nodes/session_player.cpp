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
#include "mmradartwin_dsp/ros/node_program.h"

namespace mmradartwin {
namespace {

struct Settings {
  explicit Settings(StrictParameters& parameters);

  std::string session_path, card_ip, host_ip, map_frame, radar_frame, camera_frame, emulator_options, viewer_topic;
  int config_port, data_port;
  double start_delay_s, tf_lead_s;
  bool whole_rig, publish_poses, exit_when_done;
  PlayedSelection selection;
};

Settings::Settings(StrictParameters& parameters) {
  session_path = parameters.requiredPath("session", "a session directory");
  card_ip = parameters.text("card_ip", "127.0.0.2", "address of the emulated card");
  host_ip = parameters.text("host_ip", "127.0.0.1", "address that it sends to");
  config_port = parameters.integer("config_port", 4096, 1, 65535, "UDP port of the card's commands");
  data_port = parameters.integer("data_port", 4098, 1, 65535, "UDP port of the card's samples");
  start_delay_s = parameters.number("start_delay_s", 1.0, 0.0, 60.0, "from the card's start to the first frame, s");
  selection.first = parameters.integer("first", 0, 0, 1 << 20, "index of the first pose that is played");
  selection.every = parameters.integer("every", 1, 1, 1 << 20, "then every so-manieth pose");
  selection.count = parameters.integer("count", 0, 0, 1 << 20, "poses that are played at most; 0: all");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  radar_frame = parameters.text("radar_frame", "radar_link", "tf frame of the radar");
  camera_frame =
      parameters.text("camera_frame", "",
                      "tf frame whose pose is published, joined to the radar by a static transform; empty: the radar");
  tf_lead_s = parameters.number("tf_lead_s", 0.1, 0.0, 1.0, "poses are published so long before their frames, s");
  emulator_options = parameters.text("emulator_options", "", "further options of dca1000_emulator or emulated_rig");
  whole_rig = parameters.boolean("whole_rig", false, "true: emulate radar and card, else the card alone");
  publish_poses = parameters.boolean("publish_poses", true, "false: another node publishes them");
  exit_when_done = parameters.boolean("exit_when_done", false, "true: end with the session");
  viewer_topic = parameters.text("viewer_topic", "", "wait until somebody listens to this topic; empty: do not wait");
}

NodeDescription description() {
  return {"session_player",
          "session_player",
          "Plays a session as if it were being measured: starts an emulator on its captures, and publishes its poses.",
          {topic<tf2_msgs::TFMessage>("/tf", "with camera_frame: where the radar is on the camera"),
           topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
          {topic<mmradartwin_msgs::Session>("session", "files of the session, with poses as they are played; latched"),
           topic<std_msgs::Float32>("~progress", "share of the session that has been played, 0 to 1; latched"),
           topic<tf2_msgs::TFMessage>("/tf", "poses of the radar, or of the camera")},
          {},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

class SessionPlayer {
 public:
  SessionPlayer() : settings_(readSettings<Settings>(ros::NodeHandle("~"))) {
    session_ = openPlayedSession(settings_.session_path, "", settings_.selection);
    for (const PoseProblem& problem : session_.problems) {
      ROS_ERROR_STREAM("pose " << problem.pose << " is left out: " << problem.message);
    }
    session_publisher_ = nh_.advertise<mmradartwin_msgs::Session>("session", 1, true);
    progress_publisher_ = ros::NodeHandle("~").advertise<std_msgs::Float32>("progress", 1, true);
  }

  /// Plays the session; returns the exit status of the program.
  int play() {
    findMount();
    if (!settings_.viewer_topic.empty()) waitForViewer(nh_.resolveName(settings_.viewer_topic));
    startEmulator();
    if (settings_.whole_rig) return followRig();
    const std::optional<std::int64_t> start_ns = waitUntilArmed();
    if (!start_ns) return ros::ok() ? 1 : 0;
    publishSession(*start_ns);
    if (!followSchedule(*start_ns) || !waitForEnd()) return ros::ok() ? 1 : 0;
    publishProgress(1.0);
    ROS_INFO("the session has been played");
    if (!settings_.exit_when_done) ros::waitForShutdown();  // the spinner of main() continues
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
    if (settings_.camera_frame.empty() || !settings_.publish_poses) return;
    tf2_ros::Buffer buffer;
    const tf2_ros::TransformListener listener(buffer);
    constexpr double kWait_s = 20;
    try {
      T_radar_child_ = fromMsg(
          buffer.lookupTransform(settings_.radar_frame, settings_.camera_frame, ros::Time(0), ros::Duration(kWait_s))
              .transform);
    } catch (const tf2::TransformException& error) {
      throw InputError("no transform between " + settings_.camera_frame + " and " + settings_.radar_frame + " in tf (" +
                       error.what() +
                       "): start a static_transform_publisher for the camera's mount, or leave camera_frame empty");
    }
  }

  void startEmulator() {
    std::vector<std::string> arguments = {settings_.session_path, "--end-with-parent"};
    const auto add = [&arguments](const std::string& option, const std::string& value) {
      arguments.insert(arguments.end(), {option, value});
    };
    add("--first", std::to_string(settings_.selection.first));
    add("--every", std::to_string(settings_.selection.every));
    add("--count", std::to_string(settings_.selection.count));
    add("--card-ip", settings_.card_ip);
    add("--host-ip", settings_.host_ip);
    if (!settings_.whole_rig) {
      add("--config-port", std::to_string(settings_.config_port));
      add("--data-port", std::to_string(settings_.data_port));
      add("--start-delay-s", std::to_string(settings_.start_delay_s));
      arguments.push_back("--once");
    }
    std::istringstream more(settings_.emulator_options);
    for (std::string word; more >> word;) arguments.push_back(word);
    const std::string program = programBeside(settings_.whole_rig ? "emulated_rig" : "dca1000_emulator");
    emulator_ = std::make_unique<ChildProcess>(program, arguments);
  }

  /// Publishes poses for an emulated rig whose radar others start and stop: those of the running frames, and between
  /// runs the next pose. A frame's pose is constant from a quarter of a period before its start to a quarter after.
  /// Returns the exit status.
  int followRig() {
    constexpr std::int64_t kHold_ns = 50'000'000;
    const auto lead_ns = static_cast<std::int64_t>(settings_.tf_lead_s * 1e9);
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
        ROS_WARN_STREAM_THROTTLE(10, "the emulated card at "
                                         << settings_.card_ip << " waits to be armed: start driver_node with card_ip "
                                         << settings_.card_ip << " and host_ip " << settings_.host_ip);
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
    auto message = liveSessionMessage(settings_.session_path, poses);
    message.header.frame_id = settings_.map_frame;
    session_publisher_.publish(message);
  }

  bool followSchedule(std::int64_t start_ns) {
    std::optional<std::size_t> current;
    for (const ScheduledPose& due : schedulePoses(session_, start_ns)) {
      const ros::Time at = toRosTime(due.stamp_ns);
      const ros::WallTime send_at = ros::WallTime(at.sec, at.nsec) - ros::WallDuration(settings_.tf_lead_s);
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
    if (!settings_.publish_poses) return;  // another node publishes them
    geometry_msgs::TransformStamped message = tf2::eigenToTransform(T_map_radar * T_radar_child_);
    message.header.stamp = stamp;
    message.header.frame_id = settings_.map_frame;
    message.child_frame_id = settings_.camera_frame.empty() ? settings_.radar_frame : settings_.camera_frame;
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

  const Settings settings_;
  bool completed_ = false;
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
  constexpr double kMasterWithin_s = 10;
  const auto play = [] {
    // The spinner serves tf while this thread keeps the schedule.
    ros::AsyncSpinner spinner(1);
    spinner.start();
    mmradartwin::SessionPlayer player;
    const mmradartwin::MasterWatch master_watch;
    return player.play();
  };
  return mmradartwin::runNode(argc, argv, mmradartwin::description(), play, kMasterWithin_s);
}
