// Keeps the frames of the poses seen so far and finds, when asked, what the twin gets wrong about them: the action
// attribution/diagnose. A process of its own, since it may take minutes of all cores and much memory, and the stream
// has to go on whatever becomes of it.

#include <actionlib/server/simple_action_server.h>
#include <diagnostic_updater/diagnostic_updater.h>
#include <mmradartwin_msgs/DiagnoseAction.h>
#include <ros/callback_queue.h>
#include <ros/ros.h>
#include <std_srvs/Trigger.h>
#include <tf2_ros/buffer.h>
#include <tf2_ros/message_filter.h>
#include <visualization_msgs/MarkerArray.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <sstream>

#include "mmradartwin_attribution/diagnosed_poses.h"
#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/diagnosis_report.h"
#include "mmradartwin_attribution/ros/conversions.h"
#include "mmradartwin_attribution/ros/left_behind_folder.h"
#include "mmradartwin_attribution/ros/markers.h"
#include "mmradartwin_dsp/channel_correction.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/frame_spool.h"
#include "mmradartwin_dsp/ros/master_watch.h"
#include "mmradartwin_dsp/ros/node_program.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "mmradartwin_dsp/ros/topic_watch.h"
#include "mmradartwin_dsp/ros/transform_reader.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/pose_placement.h"

namespace {

using namespace mmradartwin;
namespace fs = std::filesystem;

constexpr double kWarnEvery_s = 30;
constexpr double kFeedbackEvery_s = 0.2;
/// Frames that may wait for tf, or while those kept so far are indexed for a diagnosis.
constexpr std::uint32_t kLongestQueue = 1000;

struct Settings {
  explicit Settings(StrictParameters& parameters);

  FrameSpoolLimits limits;
  std::string plugins, map_frame, output_folder, config_file, diagnosis_config_file, channels_file;
  int jobs;
};

Settings::Settings(StrictParameters& parameters) {
  plugins = parameters.text("plugins", "", "libraries with further mechanisms, with colons between");
  config_file = parameters.existingPath("config", "attribution.yaml: thresholds and windows; empty: the defaults");
  diagnosis_config_file = parameters.existingPath(
      "diagnosis_config", "diagnosis.yaml: stated accuracy of scene, levels and poses; empty: the defaults");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene");
  output_folder = parameters.path("output", "folder of the reports; empty: mmradartwin in ROS_HOME");
  channels_file =
      parameters.existingPath("channels", "channels.yaml of calibrate, by which frames are corrected; empty: none");
  jobs = parameters.integer("jobs", 0, 0, 1024, "cores of a diagnosis; 0: all");
  limits.folder = parameters.path("spool_folder", "where frames are kept; empty: the system's temporary folder");
  limits.frames_per_pose = parameters.integer("frames_per_pose", limits.frames_per_pose, 1, 1000000,
                                              "frames kept while the radar stands, the first so many");
  limits.max_bytes =
      static_cast<std::uint64_t>(1e6 * parameters.number("max_mb", 2000, 1, 1e6, "frames kept in all, MB"));
  limits.min_free_bytes = static_cast<std::uint64_t>(
      1e6 * parameters.number("min_free_mb", 1000, 0, 1e6, "space that is left free on the disk, MB"));
  parameters.ofDiagnosticUpdater();
}

NodeDescription description() {
  return {"diagnosis_node",
          "diagnosis",
          "Keeps the frames of the poses seen so far and finds, when asked, what the twin gets wrong about them "
          "(request_diagnosis asks).",
          {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
           topic<mmradartwin_msgs::Session>("session", "files of the recorded session; latched"),
           topic<mmradartwin_msgs::Scene>("twin/scene", "scene and twin that are simulated; latched"),
           topic<mmradartwin_msgs::AdcCube>("radar/adc", "raw samples, a message per frame"),
           topic<mmradartwin_msgs::DiagnoseActionGoal>("attribution/diagnose/goal", "action: asks for a diagnosis"),
           topic<actionlib_msgs::GoalID>("attribution/diagnose/cancel", "action: ends it early"),
           topic<tf2_msgs::TFMessage>("/tf", "where the radar is in the scene"),
           topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
          {topic<mmradartwin_msgs::Findings>("attribution/findings", "of the last diagnosis; latched"),
           topic<visualization_msgs::MarkerArray>("attribution/finding_markers", "their places for rviz; latched"),
           topic<mmradartwin_msgs::DiagnoseActionFeedback>("attribution/diagnose/feedback", "action: how far it is"),
           topic<mmradartwin_msgs::DiagnoseActionResult>("attribution/diagnose/result", "action: what was found"),
           topic<actionlib_msgs::GoalStatusArray>("attribution/diagnose/status", "action: whether it runs"),
           topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "whether frames are kept, and why not")},
          {service<std_srvs::Trigger>("attribution/forget_poses", "forget all frames: poses begin anew")},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

bool sameBytes(const std::string& a, const std::string& b) {
  std::ifstream x(a, std::ios::binary), y(b, std::ios::binary);
  std::ostringstream s, t;
  s << x.rdbuf();
  t << y.rdbuf();
  return x && y && s.str() == t.str();
}

class DiagnosisNode {
 public:
  using Goal = mmradartwin_msgs::DiagnoseGoalConstPtr;
  using Cube = mmradartwin_msgs::AdcCube;

  explicit DiagnosisNode(const Settings& settings)
      : settings_(settings),
        spool_(settings.limits),
        tf_reader_(tf_buffer_),
        posed_frames_(tf_buffer_, settings.map_frame, kLongestQueue, &spool_queue_),
        updater_(nh_, ros::NodeHandle("~")),
        server_(
            nh_, "attribution/diagnose", [this](const Goal& goal) { execute(goal); }, false) {
    countTfWarningsOfProcess();
    loadMechanismPlugins(settings_.plugins, "parameter plugins");
    if (!settings_.channels_file.empty()) channels_ = loadChannelCorrection(settings_.channels_file);
    if (!settings_.config_file.empty()) config_ = loadAttributionConfig(settings_.config_file);
    if (!settings_.diagnosis_config_file.empty()) accuracy_ = loadStatedAccuracy(settings_.diagnosis_config_file);
    findings_ = nh_.advertise<mmradartwin_msgs::Findings>("attribution/findings", 1, true);
    finding_markers_ = nh_.advertise<visualization_msgs::MarkerArray>("attribution/finding_markers", 1, true);
    forget_ = nh_.advertiseService("attribution/forget_poses", &DiagnosisNode::onForget, this);
    // What feeds the spool has a queue of its own: it may wait there while goals and cancels go on.
    ros::NodeHandle spool_nh;
    spool_nh.setCallbackQueue(&spool_queue_);
    subscribers_.push_back(spool_nh.subscribe("radar/config", 2, &DiagnosisNode::onRadar, this));
    subscribers_.push_back(spool_nh.subscribe("session", 2, &DiagnosisNode::onSession, this));
    subscribers_.push_back(spool_nh.subscribe("twin/scene", 2, &DiagnosisNode::onScene, this));
    subscribers_.push_back(spool_nh.subscribe("radar/adc", kLongestQueue, &DiagnosisNode::onCube, this));
    posed_frames_.registerCallback(&DiagnosisNode::onPosedCube, this);
    spool_spinner_.start();
    updater_.setHardwareID("none");
    updater_.add("diagnosis", [this](diagnostic_updater::DiagnosticStatusWrapper& status) { describe(status); });
    diagnostics_timer_ = nh_.createWallTimer(ros::WallDuration(kDiagnosticsEvery_s), &DiagnosisNode::onTick, this);
    server_.start();
  }

  ~DiagnosisNode() {
    spool_spinner_.stop();
    server_.shutdown();
  }

 private:
  /// What cannot be kept is told; the node goes on.
  static void guarded(const char* what, const std::function<void()>& action) {
    try {
      action();
    } catch (const std::exception& error) {
      ROS_ERROR_THROTTLE(kWarnEvery_s, "%s left out: %s", what, error.what());
    }
  }
  void onRadar(const mmradartwin_msgs::RadarConfig::ConstPtr& msg) {
    guarded("radar/config", [&] { spool_.setRadar(*msg); });
  }
  void onSession(const mmradartwin_msgs::Session::ConstPtr& msg) {
    guarded("session", [&] { spool_.setSession(*msg); });
  }
  void onScene(const mmradartwin_msgs::Scene::ConstPtr& msg) {
    guarded("twin/scene", [&] { spool_.setScene(*msg); });
  }

  void onCube(const Cube::ConstPtr& cube) {
    cubes_.heard();
    if (!usableStamp(cube->header.stamp)) {
      ROS_WARN_THROTTLE(kWarnEvery_s, "frame left out: its stamp, %u s, is no time", cube->header.stamp.sec);
      return;
    }
    // With simulated time the reader clears tf by itself when time goes back.
    if (cube->header.stamp < newest_ && !ros::Time::isSimTime()) tf_buffer_.clear();
    newest_ = cube->header.stamp;
    tf_reader_.measuredAt(newest_);
    posed_frames_.add(cube);
  }

  void onPosedCube(const Cube::ConstPtr& cube) {
    try {
      const geometry_msgs::TransformStamped T =
          tf_buffer_.lookupTransform(settings_.map_frame, cube->header.frame_id, cube->header.stamp);
      spool_.add(cube, fromMsg(T.transform));
    } catch (const std::exception& error) {  // forgotten by tf in between, or not to be written
      ROS_WARN_THROTTLE(kWarnEvery_s, "frame at %.6f left out: %s", cube->header.stamp.toSec(), error.what());
    }
  }

  bool onForget(std_srvs::Trigger::Request&, std_srvs::Trigger::Response& response) {
    spool_.forget();
    response.success = true;
    response.message = "poses begin anew";
    return true;
  }

  void onTick(const ros::WallTimerEvent&) {
    updater_.force_update();
    const std::string problem = spool_.state().problem;
    if (!problem.empty()) ROS_WARN_THROTTLE(kWarnEvery_s, "%s", problem.c_str());
  }

  void describe(diagnostic_updater::DiagnosticStatusWrapper& status) const {
    using Level = diagnostic_msgs::DiagnosticStatus;
    const FrameSpoolState s = spool_.state();
    const std::string silence = cubes_.silence(subscribers_.back());
    if (!silence.empty()) {
      status.summary(Level::ERROR, silence);
    } else if (!s.problem.empty()) {
      status.summary(Level::WARN, s.problem);
    } else {
      status.summary(Level::OK, s.frames > 0 ? "keeping frames" : "waiting for frames with a pose");
    }
    status.add("frames kept", s.frames);
    status.add("frames left out", s.left_out);
    status.add("kept [MB]", static_cast<double>(s.bytes) / 1e6);
    status.add("transforms of the future left out", tf_reader_.futureCount());
  }

  std::string outputFolder(const std::string& asked) const {
    if (asked.empty()) {
      const fs::path given = settings_.output_folder;
      return ((given.empty() ? leftBehindFolder() : given) / nameWithTime("diagnosis")).string();
    }
    if (asked.front() != '/') throw InputError("output '" + asked + "': give an absolute path, or none");
    return asked;
  }

  struct ChosenTwin {
    TwinDescription description;
    bool scene_of_session = false;  ///< then it stands in a temporary folder and is better not named
  };

  /// Nothing where there is no scene.
  std::optional<ChosenTwin> chooseTwin(const std::string& asked, const Recording& recording) const {
    const std::optional<mmradartwin_msgs::Scene> in_use = spool_.scene();
    std::optional<std::string> scene = recording.scene_file;
    const bool session_scene = spool_.session() && scene;
    // The twin node has unpacked the same session elsewhere.
    if (in_use && !(session_scene && sameBytes(in_use->scene_file, *scene))) scene = in_use->scene_file;
    const bool of_session = session_scene && scene == recording.scene_file;
    if (!asked.empty() && asked.front() != '/') {
      throw InputError("twin '" + asked + "': give an absolute path, or none");
    }
    if (asked.empty() && in_use) {
      const TemporaryFolder folder;
      const std::string file = folder.path() + "/twin.yaml";
      std::ofstream(file, std::ios::binary) << in_use->twin_yaml;
      ChosenTwin twin{loadTwin(file, scene, recording.radar), of_session};
      twin.description.scene_file = *scene;
      if (!fs::exists(*scene)) {
        throw InputError(*scene +
                         ": the scene that is simulated is not on this machine; run the diagnosis where the "
                         "twin runs, or give a twin with the goal");
      }
      return twin;
    }
    const std::string file = asked.empty() ? recording.twin_file.value_or("") : asked;
    if (file.empty() && !scene) return std::nullopt;
    ChosenTwin twin{loadTwin(file, scene, recording.radar), false};
    twin.scene_of_session = of_session && twin.description.scene_file == *scene;
    return twin;
  }

  /// What a report is written of.
  struct Diagnosed {
    Diagnosis diagnosis;
    std::optional<DiagnosedPoses> poses;
  };

  Diagnosed diagnosePoses(const Recording& recording, const std::string& asked_twin) {
    DiagnosisOptions options;
    options.jobs = settings_.jobs;
    options.config = config_;
    options.accuracy = accuracy_;
    options.cancelled = [this] { return server_.isPreemptRequested() || !ros::ok(); };
    options.on_progress = [this](const DiagnosisProgress& p) { tell(p.stage, p.share); };
    const std::optional<ChosenTwin> chosen = chooseTwin(asked_twin, recording);
    if (!chosen) return {diagnoseReceiver(recording, options), std::nullopt};
    if (recording.channels) refuseSameChannelError(chosen->description, *recording.channels);
    Twin twin = twinAt(chosen->description, recording.poses, recording.source);
    Diagnosed diagnosed{diagnose(recording, twin, options), std::nullopt};
    try {
      diagnosed.poses = compareDiagnosedPoses(recording, twin, diagnosed.diagnosis, options);
    } catch (const InputError& error) {  // what was found stands without it
      ROS_WARN_STREAM("The report shows no single poses: " << error.what());
    }
    if (chosen->scene_of_session) diagnosed.diagnosis.extended.scene_file.clear();
    return diagnosed;
  }

  void tell(const std::string& stage, double share) {
    const ros::WallTime now = ros::WallTime::now();
    if (stage == told_.stage && (now - told_at_).toSec() < kFeedbackEvery_s) return;
    told_at_ = now;
    told_.stage = stage;
    told_.share = static_cast<float>(share);
    server_.publishFeedback(told_);
  }

  void execute(const Goal& goal) {
    mmradartwin_msgs::DiagnoseResult result;
    try {
      const std::string output = outputFolder(goal->output);
      tell("collecting poses", 0);
      Recording recording = spool_.recording();
      if (channels_) requireChannelsOf(recording.radar, *channels_);
      recording.channels = channels_;
      const auto [diagnosis, poses] = diagnosePoses(recording, goal->twin);
      RunDescription run;
      run.command = {"attribution/diagnose", output, goal->twin};
      run.recording = recording.source;
      run.version = packageVersion();
      run.attribution_yaml = toYaml(config_);
      run.radar_yaml = toYaml(recording.radar);
      DiagnosisReport(output).write(diagnosis, run, poses ? &*poses : nullptr);
      result.findings_file = output + "/findings.json";
      result.report_file = output + "/report.html";
      const Findings written = readFindings(result.findings_file);
      if (written.extended_twin) result.extended_twin_file = output + "/" + *written.extended_twin;
      result.findings = toMsg(written);
      result.findings.header.stamp = ros::Time::now();
      result.findings.header.frame_id = settings_.map_frame;
      result.poses = static_cast<std::uint32_t>(written.poses);
      result.locations = static_cast<std::uint32_t>(written.locations);
      for (const PoseProblem& problem : diagnosis.problems) result.problems.push_back(problem.message);
      findings_.publish(result.findings);
      finding_markers_.publish(findingMarkers(written, settings_.map_frame));
      const std::string text = diagnosisText(diagnosis);
      ROS_INFO("%sReport: %s", text.c_str(), result.report_file.c_str());
      server_.setSucceeded(result, text);
    } catch (const DiagnosisCancelled&) {
      server_.setPreempted(result, "cancelled; nothing was written");
    } catch (const InputError& error) {
      ROS_ERROR("diagnosis: %s", error.what());
      server_.setAborted(result, error.what());
    } catch (const std::exception& error) {
      ROS_ERROR("diagnosis failed: %s", error.what());
      server_.setAborted(result, std::string("failed: ") + error.what());
    }
  }

  const Settings settings_;
  AttributionConfig config_;
  StatedAccuracy accuracy_;
  std::optional<ChannelCorrection> channels_;  ///< errors to take out, as the signal chain does
  ros::NodeHandle nh_;
  FrameSpool spool_;
  ros::CallbackQueue spool_queue_;
  tf2_ros::Buffer tf_buffer_;
  TransformReader tf_reader_;
  tf2_ros::MessageFilter<Cube> posed_frames_;
  ros::Time newest_;
  TopicWatch cubes_{"the driver (or the bag's player)"};
  std::vector<ros::Subscriber> subscribers_;
  ros::Publisher findings_, finding_markers_;
  ros::ServiceServer forget_;
  diagnostic_updater::Updater updater_;
  ros::WallTimer diagnostics_timer_;
  mmradartwin_msgs::DiagnoseFeedback told_;
  ros::WallTime told_at_;
  ros::AsyncSpinner spool_spinner_{1, &spool_queue_};
  actionlib::SimpleActionServer<mmradartwin_msgs::DiagnoseAction> server_;
};

}  // namespace

int main(int argc, char** argv) {
  return runNode(argc, argv, description(), [] {
    DiagnosisNode node(readSettings<Settings>(ros::NodeHandle("~")));
    const MasterWatch master_watch;
    ros::spin();
    return 0;
  });
}
