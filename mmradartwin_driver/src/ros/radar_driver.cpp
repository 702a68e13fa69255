#include "mmradartwin_driver/ros/radar_driver.h"

#include <algorithm>
#include <boost/make_shared.hpp>
#include <cstdio>

#include "mmradartwin_driver/link_budget.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"

namespace mmradartwin {
namespace {

using diagnostic_msgs::DiagnosticStatus;

void logEvent(Rig::Level level, const std::string& text) {
  switch (level) {
    case Rig::Level::kInfo:
      ROS_INFO_STREAM(text);
      break;
    case Rig::Level::kWarning:
      ROS_WARN_STREAM(text);
      break;
    case Rig::Level::kError:
      ROS_ERROR_STREAM(text);
      break;
  }
}

std::string seconds(double value_s) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f s", value_s);
  return text;
}

}  // namespace

RadarDriver::RadarDriver(const ros::NodeHandle& nh, const ros::NodeHandle& private_nh)
    : settings_(readSettings<Settings>(private_nh)),
      updater_(nh, private_nh, ros::this_node::getName()),
      pose_watch_(settings_.pose),
      diagnosed_at_(ros::WallTime::now()) {
  loadRadar();
  mmradartwin_msgs::RadarConfig config = toMsg(radar_);
  radar_hash_ = radarHash(config);
  config.header.stamp = ros::Time::now();
  config.header.frame_id = settings_.frame_id;

  ros::NodeHandle handle(nh);
  config_publisher_ = handle.advertise<mmradartwin_msgs::RadarConfig>("radar/config", 1, true);
  adc_publisher_ = handle.advertise<mmradartwin_msgs::AdcCube>("radar/adc", 100);
  config_publisher_.publish(config);

  updater_.setHardwareID("DCA1000 " + options_.card_ip);
  updater_.add("radar stream", this, &RadarDriver::diagnose);
  updater_.add("capture card", this, &RadarDriver::diagnoseCard);
  if (options_.radar) updater_.add("radar device", this, &RadarDriver::diagnoseDevice);
  if (!settings_.map_frame.empty()) {
    updater_.add("radar pose", this, &RadarDriver::diagnosePose);
    countTfWarningsOfProcess();
    tf_buffer_ = std::make_unique<tf2_ros::Buffer>();
    tf_reader_ = std::make_unique<TransformReader>(*tf_buffer_);
    pose_timer_ =
        handle.createWallTimer(ros::WallDuration(0.02), [this](const ros::WallTimerEvent&) { observePose(); });
  }
  rig_ = std::make_unique<Rig>(
      radar_, options_, [this](AdcCube&& cube) { publish(std::move(cube)); }, logEvent);
  // A timer drives the report, since silence must be reported as well.
  timer_ = handle.createWallTimer(ros::WallDuration(1.0), [this](const ros::WallTimerEvent&) { updater_.update(); });
}

RadarDriver::Settings::Settings(StrictParameters& parameters) {
  radar_file = parameters.requiredPath("radar", "the path of the device's radar.yaml");
  rig.host_ip = parameters.text("host_ip", rig.host_ip, "address of this host that the card sends to");
  rig.card_ip = parameters.text("card_ip", rig.card_ip, "address of the DCA1000EVM");
  rig.config_port = parameters.integer("config_port", rig.config_port, 1, 65535, "UDP port of the card's commands");
  rig.data_port = parameters.integer("data_port", rig.data_port, 1, 65535, "UDP port of the card's samples");
  rig.packet_delay_us =
      parameters.number("packet_delay_us", rig.packet_delay_us, 0, 524.28, "pause of the card between two packets, us");
  rig.record_pcap = parameters.path("record_pcap", "pcap file for everything between card and host; empty: none");
  rig.configure_card =
      parameters.boolean("configure_card", rig.configure_card, "false: another program configures and arms the card");
  configure_radar = parameters.boolean("configure_radar", false, "true: bring the radar up over USB by radar.yaml");
  rig.radar_firmware = parameters.existingPath(
      "radar_firmware", "TI's meta image, for a radar that is configured here and whose flash is empty");
  frame_id = parameters.text("frame_id", "radar_link", "tf frame of the radar");
  map_frame = parameters.text("map_frame", "map", "tf frame of the scene, in which the radar's pose is watched");
  pose.age_limit_s = parameters.number("pose_age_limit_s", pose.age_limit_s, 0.05, 3600,
                                       "an older pose is reported in diagnostics, s");
  parameters.ofDiagnosticUpdater();
}

NodeDescription RadarDriver::description() {
  return {"driver_node",
          "radar_driver",
          "Receives the samples of a DCA1000EVM, and where it is told to configures card and radar.",
          {topic<tf2_msgs::TFMessage>("/tf", "where the radar is in the scene: watched for age, gaps and jumps"),
           topic<tf2_msgs::TFMessage>("/tf_static", "the same of what does not move")},
          {topic<mmradartwin_msgs::RadarConfig>("radar/config", "the radar; latched"),
           topic<mmradartwin_msgs::AdcCube>("radar/adc", "raw samples, a message per frame"),
           topic<diagnostic_msgs::DiagnosticArray>("/diagnostics", "stream, card, radar and the radar's pose")},
          {},
          [](StrictParameters& parameters) { const Settings settings(parameters); }};
}

void RadarDriver::loadRadar() {
  options_ = settings_.rig;
  radar_ = loadRadarConfig(settings_.radar_file);
  fromMsg(toMsg(radar_));  // what nobody could read is not sent
  if (settings_.configure_radar) {
    if (!options_.configure_card) {
      throw InputError(
          "parameter configure_radar: true needs configure_card: true, since the radar is started when the card has "
          "been "
          "armed");
    }
    options_.radar = radarDevice(radar_, settings_.radar_file);
    radar_ = options_.radar->quantised(radar_, settings_.radar_file);
  } else if (!options_.radar_firmware.empty()) {
    throw InputError("parameter radar_firmware: " + options_.radar_firmware +
                     ": is used with configure_radar: true only");
  }
  // The packet delay of another program is unknown here.
  if (options_.configure_card) {
    try {
      checkLinkBudget(radar_, options_.packet_delay_us);
    } catch (const InputError& error) {
      throw InputError(settings_.radar_file + ": " + error.what());
    }
  }
}

RadarDriver::~RadarDriver() {
  timer_.stop();
  pose_timer_.stop();
  rig_.reset();
}

void RadarDriver::publish(AdcCube&& cube) {
  const auto message = boost::make_shared<mmradartwin_msgs::AdcCube>(toMsg(cube, radar_hash_));
  message->header.frame_id = settings_.frame_id;
  adc_publisher_.publish(boost::shared_ptr<const mmradartwin_msgs::AdcCube>(message));
}

void RadarDriver::diagnose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const RigState state = rig_->state();
  const ros::WallTime now = ros::WallTime::now();
  const double elapsed_s = std::max((now - diagnosed_at_).toSec(), 1e-3);
  const double rate_hz = static_cast<double>(state.frames.frames - diagnosed_frames_.frames) / elapsed_s;
  const std::uint64_t lost = state.frames.lost_bytes - diagnosed_frames_.lost_bytes;
  const std::uint64_t dropped = state.packets.kernel_drops - diagnosed_packets_.kernel_drops;
  diagnosed_at_ = now;
  diagnosed_frames_ = state.frames;
  diagnosed_packets_ = state.packets;

  const double silence_limit_s = std::max(1.0, 3 * radar_.frame_period_s);
  if (!state.problem.empty()) {
    status.summary(DiagnosticStatus::ERROR, state.problem);
  } else if (state.phase == RigState::Phase::kConnecting) {
    status.summary(DiagnosticStatus::WARN, "setting up the card");
  } else if (state.silent_s > silence_limit_s) {
    status.summary(DiagnosticStatus::ERROR,
                   "no samples for " + seconds(state.silent_s) +
                       (options_.radar ? ": card and radar were started; check the LVDS ribbon"
                                       : ": the card is ready; start the radar's frames, and check the LVDS ribbon if "
                                         "they run"));
  } else if (dropped > 0) {
    status.summary(DiagnosticStatus::WARN, "this host dropped " + std::to_string(dropped) +
                                               " packets: raise net.core.rmem_max or free the processor");
  } else if (state.frames_not_taken > diagnosed_not_taken_) {
    status.summary(DiagnosticStatus::WARN, std::to_string(state.frames_not_taken - diagnosed_not_taken_) +
                                               " frames dropped, published too slowly: free the processor");
  } else if (state.packets_not_recorded > 0) {
    status.summary(DiagnosticStatus::WARN, "packets are missing from the recording " + options_.record_pcap +
                                               ": check the free space, record to a faster disk");
  } else if (lost > 0) {
    status.summary(DiagnosticStatus::WARN,
                   std::to_string(lost) + " bytes lost: raise packet_delay_us, check the cable");
  } else {
    status.summary(DiagnosticStatus::OK, "streaming");
  }
  diagnosed_not_taken_ = state.frames_not_taken;
  status.add("frame rate [Hz]", rate_hz);
  status.add("frame rate expected [Hz]", 1 / radar_.frame_period_s);
  status.add("frames", state.frames.frames);
  status.add("incomplete frames", state.frames.incomplete_frames);
  status.add("missing frames", state.frames.missing_frames);
  status.add("lost bytes", state.frames.lost_bytes);
  status.add("packets", state.packets.packets);
  status.add("duplicate packets", state.frames.duplicate_packets);
  status.add("late packets", state.frames.late_packets);
  status.add("packets whose header did not fit", state.frames.rejected_packets);
  status.add("packets dropped by this host", state.packets.kernel_drops);
  status.add("packets from other addresses", state.packets.foreign);
  status.add("socket buffer [kB]", state.buffer_bytes >> 10);
  status.add("frames published too slowly", state.frames_not_taken);
  if (!options_.record_pcap.empty()) {
    status.add("packets recorded", state.packets_recorded);
    status.add("packets missing from the recording", state.packets_not_recorded);
  }
  status.add("silent for [s]", state.silent_s);
}

void RadarDriver::diagnoseCard(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const RigState state = rig_->state();
  const std::uint16_t bits = state.last_status.value_or(0);
  if (!state.problem.empty()) {
    status.summary(DiagnosticStatus::ERROR, state.problem);
  } else if (state.phase == RigState::Phase::kConnecting) {
    status.summary(DiagnosticStatus::WARN, "setting up the card");
  } else if (bits & static_cast<std::uint16_t>(~kRecordCompleted)) {
    status.summary(DiagnosticStatus::WARN, "the card reported " + describeStatus(bits));
  } else {
    status.summary(DiagnosticStatus::OK, !options_.configure_card ? "configured by another program" : "armed");
  }
  status.add("recordings armed", state.armings);
  status.add("last card status", state.last_status ? describeStatus(*state.last_status) : "none since armed");
  status.add("card version", state.version ? describeVersion(*state.version) : "unknown");
}

void RadarDriver::diagnoseDevice(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const RadarHealth state = *rig_->state().radar;
  const auto now = std::chrono::system_clock::now();
  const auto recent = std::find_if(state.latest.begin(), state.latest.end(), [&](const RadarEvent& event) {
    return event.level != RadarEvent::Level::kInfo && now - event.at < std::chrono::seconds(10);
  });
  if (!state.problem.empty()) {
    status.summary(DiagnosticStatus::ERROR, state.problem);
  } else if (recent != state.latest.end()) {
    const bool error = recent->level == RadarEvent::Level::kError;
    status.summary(error ? DiagnosticStatus::ERROR : DiagnosticStatus::WARN, "event: " + recent->text);
  } else if (!state.running) {
    status.summary(DiagnosticStatus::WARN,
                   state.configured ? "configured, its frames do not run" : "not configured yet");
  } else {
    status.summary(DiagnosticStatus::OK, "frames run");
  }
  status.add("firmware", state.version.empty() ? "unknown" : state.version);
  status.add("temperature at calibration [deg C]",
             state.temperature_deg_c ? std::to_string(*state.temperature_deg_c) : "unknown");
  status.add("slope as configured [MHz/us]", radar_.slope_hz_per_s * 1e-12);
  status.add("bring-ups", state.bring_ups);
  status.add("starts of the frames", state.starts);
  status.add("events", state.events);
  status.add("events that warn", state.warnings);
  status.add("events that report an error", state.errors);
  for (std::size_t i = 0; i < state.latest.size(); ++i) {
    status.add(
        "event " + std::to_string(i + 1) + " before now",
        seconds(std::chrono::duration<double>(now - state.latest[i].at).count()) + " ago: " + state.latest[i].text);
  }
}

/// Reads the latest pose, often enough that no pose of a usual source stays unseen for long.
void RadarDriver::observePose() {
  try {
    const geometry_msgs::TransformStamped T =
        tf_buffer_->lookupTransform(settings_.map_frame, settings_.frame_id, ros::Time(0));
    pose_watch_.observe(toNanoseconds(T.header.stamp), fromMsg(T.transform));
  } catch (const std::exception&) {
    // There is no pose yet, or its frames are not connected: the report states its age.
  }
}

void RadarDriver::diagnosePose(diagnostic_updater::DiagnosticStatusWrapper& status) {
  const PoseWatch::Report report = pose_watch_.report(toNanoseconds(ros::Time::now()));
  status.summary(report.level == PoseWatch::Level::kFine      ? DiagnosticStatus::OK
                 : report.level == PoseWatch::Level::kWarning ? DiagnosticStatus::WARN
                                                              : DiagnosticStatus::ERROR,
                 report.text);
  status.add("transform", settings_.map_frame + " -> " + settings_.frame_id);
  status.add("age [s]", report.age_s ? seconds(*report.age_s) : "unknown");
  status.add("gaps", report.gaps);
  status.add("jumps", report.jumps);
  status.add("transforms of the future left out", tf_reader_->futureCount());
}

}  // namespace mmradartwin
