// Finds the radar's mount, range bias and channel errors from poses in front of a corner reflector or a wall.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>

#include "mmradartwin_attribution/mount_calibration.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/twin.h"
#include "recording_arguments.h"

namespace {

namespace fs = std::filesystem;
using namespace mmradartwin;

struct Arguments {
  RecordingArguments input;
  OutputArguments output;
  std::string wall, lasers;
  std::string channels_to = "twin";
  std::vector<double> reflector_m, mount;
  MountCalibrationOptions options;
};

void write(const fs::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  out.close();
  if (!out) throw InputError(file.string() + ": cannot be written; is there space, and may you write there?");
}

/// Values of a list, in its order.
std::vector<double> valuesOf(const std::vector<CalibratedValue>& list) {
  std::vector<double> values;
  for (const CalibratedValue& v : list) values.push_back(v.value);
  return values;
}

/// The mechanisms that a calibration answers, in place of what the twin had of them. Channel errors go into the twin,
/// or the measured branch takes them out and the twin has none, or all stays as it is.
void calibrate(TwinDescription& twin, const MountCalibration& c, const std::string& channels) {
  const auto replace = [&twin](const std::string& mechanism, const Parameters* values) {
    auto& all = twin.mechanisms;
    all.erase(std::remove_if(all.begin(), all.end(), [&](const auto& m) { return m.mechanism == mechanism; }),
              all.end());
    if (values) all.push_back({mechanism, *values});
  };
  Parameters yaw, position, range, channel;
  yaw.set("yaw_deg", c.yaw_deg.value);
  position.set("forward_m", c.forward_m.value);
  position.set("left_m", c.left_m.value);
  range.set("range_m", c.range_m.value);
  channel.set("phase_deg", valuesOf(c.phase_deg));
  channel.set("gain_db", valuesOf(c.gain_db));
  if (c.yaw_deg.observable) replace("radar_yaw_offset", &yaw);
  if (c.forward_m.observable || c.left_m.observable) replace("radar_position_offset", &position);
  if (c.range_m.observable) replace("range_bias", &range);
  const bool known = c.phase_deg.back().observable;
  if (channels != "none" && known) replace("channel_phase_error", channels == "twin" ? &channel : nullptr);
}

void print(const CalibratedValue& v, const std::string& label) {
  if (v.observable) {
    std::printf("%-22s %10.4f %-3s  95 %%: %.4f to %.4f\n", label.c_str(), v.value, v.unit.c_str(), v.ci95[0],
                v.ci95[1]);
  } else {
    std::printf("%-22s %s\n", label.c_str(), v.note.c_str());
  }
}

/// Refuses a mount in other units than m and rad. Antennas of a rig do not stand 5 m beside its camera, and no angle is
/// beyond a full turn.
void checkMount(const std::vector<double>& mount) {
  constexpr double kFarthest_m = 5, kTurn_rad = 2 * M_PI;
  const std::vector<const char*> names = {"x", "y", "z", "yaw", "pitch", "roll"};
  const auto refuse = [&](std::size_t i, const std::string& allowed, const std::string& unit, const char* si,
                          double factor) {
    std::ostringstream text;
    text << "--mount: " << names[i] << " is " << mount[i] << "; x y z yaw pitch roll are in [m, rad], allowed: at most "
         << allowed << " either way; is it in " << unit << "? then " << mount[i] * factor << " " << si;
    throw InputError(text.str());
  };
  for (std::size_t i = 0; i < mount.size(); ++i) {
    if (!std::isfinite(mount[i]))
      throw InputError(std::string("--mount: ") + names[i] + " is no number; give [m, rad]");
    if (i < 3 && std::abs(mount[i]) > kFarthest_m) refuse(i, "5 m", "mm", "m", 1e-3);
    if (i >= 3 && std::abs(mount[i]) > kTurn_rad) refuse(i, "2 pi", "degrees", "rad", M_PI / 180);
  }
}

int run(const Arguments& arguments) {
  checkMount(arguments.mount);
  if (arguments.reflector_m.empty() == arguments.wall.empty()) {
    throw InputError("give what the radar was held in front of: either --reflector X Y Z (map, m) or --wall ACTOR");
  }
  std::vector<std::string> inputs = arguments.input.inputs();
  inputs.push_back(arguments.lasers);
  Output output = Output::folder(arguments.output, inputs, "calibration.yaml");
  const Recording recording = arguments.input.open();
  TwinDescription twin = arguments.input.loadTwinOf(recording);
  if (!twin.scene_file.empty()) twin.scene_file = fs::absolute(twin.scene_file).lexically_normal().string();

  CalibrationTarget target;
  std::optional<Twin> room;  // says where a wall's echo comes alone
  if (!arguments.wall.empty()) {
    room.emplace(placedTwin(twin, recording.poses, recording.source));
    target = wallTarget(room->scene(), arguments.wall);
  } else {
    target.name = "the corner reflector";
    target.reflector_map_m =
        Eigen::Vector3d(arguments.reflector_m[0], arguments.reflector_m[1], arguments.reflector_m[2]);
  }
  const std::vector<LaserDistance> lasers =
      arguments.lasers.empty() ? std::vector<LaserDistance>() : readLaserDistances(arguments.lasers);
  MountCalibration calibration;
  {
    ProgressLine progress;
    calibration = calibrateMount(recording, target, lasers, arguments.options, room ? &*room : nullptr, [&](int done) {
      progress.count(static_cast<std::size_t>(done), recording.poses.size(), "poses");
    });
  }

  const fs::path folder(output.path()), named(output.name());
  calibrate(twin, calibration, arguments.channels_to);
  RecordingArguments::leaveOutTemporary(twin);
  write(folder / "twin.yaml", twin.toYaml());
  const bool measured_channels = arguments.channels_to == "measured" && calibration.phase_deg.back().observable;
  if (measured_channels) {
    write(folder / "channels.yaml",
          toYaml(ChannelCorrection{"", valuesOf(calibration.phase_deg), valuesOf(calibration.gain_db)}));
  }
  write(folder / "calibration.yaml", toYaml(calibration));
  writePicture(drawCalibration(calibration), (folder / "calibration.png").string());
  output.complete();

  sayProblems(calibration.problems);
  for (const std::string& line : calibration.notes) note(line);
  if (!calibration.undetermined.empty()) std::cerr << "error: " << calibration.undetermined << '\n';
  print(calibration.yaw_deg, "yaw");
  print(calibration.forward_m, "forward");
  print(calibration.left_m, "left");
  print(calibration.range_m, "range bias");
  for (std::size_t k = 1; k < calibration.phase_deg.size(); ++k) {
    print(calibration.phase_deg[k], "phase of channel " + std::to_string(k));
    print(calibration.gain_db[k], "gain of channel " + std::to_string(k));
  }
  if (!arguments.mount.empty()) {
    const auto& m = arguments.mount;
    const Eigen::Isometry3d T =
        Eigen::Translation3d(m[0], m[1], m[2]) * Eigen::AngleAxisd(m[3], Eigen::Vector3d::UnitZ()) *
        Eigen::AngleAxisd(m[4], Eigen::Vector3d::UnitY()) * Eigen::AngleAxisd(m[5], Eigen::Vector3d::UnitX());
    const Eigen::Isometry3d better = correctedMount(calibration, T);
    const Eigen::Matrix3d R = better.linear();
    std::printf(
        "mount:=\"%.4f %.4f %.4f %.5f %.5f %.5f\"  (use it without radar_yaw_offset and radar_position_offset)\n",
        better.translation().x(), better.translation().y(), better.translation().z(), std::atan2(R(1, 0), R(0, 0)),
        std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))), std::atan2(R(2, 1), R(2, 2)));
  }
  std::cout << "Twin: " << (named / "twin.yaml").string() << ", picture: " << (named / "calibration.png").string()
            << '\n';
  if (measured_channels) {
    std::cout << "Channels: " << (named / "channels.yaml").string()
              << "; give it as --channels to process, evaluate and diagnose, and as channels:= to live.launch\n";
  }
  return calibration.problems.empty() && calibration.undetermined.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Finds the radar's mount, range bias and channel errors from poses in front of a known target.");
  arguments.input.addTo(app);
  addOutputArguments(app, arguments.output, "folder for twin.yaml, calibration.yaml, calibration.png");
  app.add_option("--reflector", arguments.reflector_m, "corner reflector's apex in map: X Y Z [m]")->expected(3);
  app.add_option("--wall", arguments.wall, "actor of the scene that the radar was held in front of");
  app.add_option("--laser", arguments.lasers, "CSV pose,distance_m: radar to target as a laser meter gave it");
  app.add_option(
         "--channels", arguments.channels_to,
         "twin: channel errors go into twin.yaml; measured: into channels.yaml, by which the measured branch is "
         "corrected; none: they are only reported")
      ->check(CLI::IsMember({"twin", "measured", "none"}))
      ->capture_default_str();
  app.add_option("--mount", arguments.mount,
                 "camera_link -> radar_link that the poses were made with, x y z yaw pitch roll [m, rad]: prints the "
                 "corrected one for live.launch")
      ->expected(6);
  app.add_option("--search", arguments.options.search_m, "the echo is looked for within this of its place [m]")
      ->check(CLI::Range(0.05, 2.0))
      ->capture_default_str();
  app.footer("Example: calibrate lab.bag --reflector 3.2 1.0 1.1 --output calibrated");
  return runProgram(app, argc, argv, [&arguments] { return run(arguments); });
}
