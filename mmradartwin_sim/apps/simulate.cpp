// simulate: scene, radar, twin and poses of a recording -> a session of simulated samples, and the paths of every pose.
// Or of one place that is named: pictures of map, room and paths. Or what mechanisms a twin may have.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_sim/mechanism_list.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/simulate_session.h"
#include "simulate_place.h"
#include "simulated_input.h"

using namespace mmradartwin;

namespace {

namespace fs = std::filesystem;

struct Arguments {
  SimulatedInput input;
  SimulateOptions options;
  OutputArguments output;
  std::string scene, plugins, noise = "thermal", diffuse_records = "cells", mechanism;
  std::vector<double> at;
  bool list_mechanisms = false;
};

std::vector<std::string> inputsOf(const Arguments& arguments) {
  std::vector<std::string> inputs = arguments.input.recordings();
  inputs.insert(inputs.end(), {arguments.input.radar(), arguments.scene, arguments.options.twin_file});
  return inputs;
}

int simulateRecordings(Arguments& arguments) {
  if (arguments.input.recordings().empty()) {
    throw InputError("RECORDING is missing; give a session or a bag, or a place by --at, or --mechanisms");
  }
  SimulateOptions& options = arguments.options;
  Output output = Output::folder(arguments.output, inputsOf(arguments), "session.yaml");
  options.output = output.place();
  options.written_as = output.path();
  // What a bag brings of scene and twin becomes a part of the session.
  const std::string recorded = (fs::path(output.path()) / "recorded").string();
  Recording recording = arguments.input.open(recorded);
  if (!arguments.scene.empty()) recording.scene_file = fs::absolute(arguments.scene).lexically_normal().string();
  std::error_code not_empty;
  fs::remove(recorded, not_empty);
  ProgressLine progress;
  const SimulateResult result = simulateRecording(recording, options, [&](int done, int total) {
    progress.count(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "poses");
  });
  progress.clear();
  if (result.noise_dbfs) {
    std::ostringstream text;
    text << "thermal noise of " << *result.noise_dbfs << " dBFS is added to each sample; --noise none leaves it out";
    note(text.str());
  } else if (options.noise == SimulatedNoise::kNone) {
    note("no noise is written but what the twin states");
  }
  for (const std::string& line : result.notes) note(line);
  sayProblems(result.problems);
  const double worst = std::max(result.worst_amplitude_error, result.worst_grid_error);
  if (worst > 1e-12) throw std::runtime_error("records and grid disagree by more than 1e-12");
  output.complete();
  std::cout << result.poses << " pose(s) in " << output.name() << ", gain " << result.gain_db << " dB, records hold to "
            << worst << ", " << result.problems.size() << " pose(s) skipped\n";
  return result.problems.empty() ? 0 : 2;
}

int simulateOnePlace(const Arguments& arguments) {
  if (!arguments.input.recordings().empty()) {
    throw InputError("--at names the place itself; leave RECORDING out, and give --scene and --radar");
  }
  if (arguments.scene.empty() || arguments.input.radar().empty()) {
    throw InputError("--at needs a scene and a radar; give --scene scene.yaml and --radar radar.yaml");
  }
  Output output = Output::folder(arguments.output, inputsOf(arguments), "place.yaml");
  PlaceOptions options;
  options.scene_file = fs::absolute(arguments.scene).lexically_normal().string();
  options.radar_file = arguments.input.radar();
  options.twin_file = arguments.options.twin_file;
  std::copy_n(arguments.at.begin(), 3, options.position_m.data());
  options.yaw_deg = arguments.at[3];
  options.seed = arguments.options.seed;
  options.diffuse_records = arguments.options.diffuse_records;
  const PlaceResult result = simulatePlace(options, output.path());
  output.complete();
  for (const std::string& line : result.warnings) std::cerr << "warning: " << line << "\n";
  for (const std::string& line : result.notes) note(line);
  std::cout << result.paths << " path(s): " << output.name() << "/map.png, room.png, map.csv, paths.csv\n";
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  SimulateOptions& options = arguments.options;
  CLI::App app("Simulates the poses of a recording and writes a session of its own, with paths/{pose}.csv beside it.");
  arguments.input.addTo(app);
  app.add_option("--output", arguments.output.path,
                 "session directory to write; with --at, folder of pictures and CSV");
  addForceArgument(app, arguments.output);
  app.add_option("--twin", options.twin_file, "twin.yaml instead of the recording's");
  app.add_option("--scene", arguments.scene, "scene.yaml instead of the recording's");
  app.add_option(
         "--at", arguments.at,
         "X Y Z YAW_DEG: map, room and paths of a radar at this one place, m and deg in the map; with --scene and "
         "--radar instead of a recording")
      ->expected(4);
  auto* mechanisms = app.add_option("--mechanisms", arguments.mechanism,
                                    "list what a twin may state, or say all about one mechanism, and exit")
                         ->expected(0, 1);
  app.add_option("--plugins", arguments.plugins,
                 "libraries with mechanisms of your own, parted by ':' (or MMRADARTWIN_PLUGINS)");
  app.add_option("--frames", options.frames, "frames per pose, alike but for mechanisms of frames")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the phases of scatter points")->capture_default_str();
  app.add_option("--noise", arguments.noise,
                 "of samples, where the twin has no noise_floor: thermal noise of the radar, or none")
      ->check(CLI::IsMember({"thermal", "none"}))
      ->capture_default_str();
  app.add_option("--diffuse-records", arguments.diffuse_records,
                 "in paths/{pose}.csv: summed by cells of a facet, or all points")
      ->check(CLI::IsMember({"cells", "points"}))
      ->capture_default_str();
  addJobsArgument(app, options.jobs);
  app.footer(
      "Examples: simulate lab --output simulated\n"
      "          simulate --at 1 2 1.1 90 --scene scene.yaml --radar radar.yaml --output place\n"
      "          simulate --mechanisms range_bias");
  return runProgram(app, argc, argv, [&] {
    options.noise = arguments.noise == "none" ? SimulatedNoise::kNone : SimulatedNoise::kThermal;
    options.diffuse_records = diffuseRecordsFrom(arguments.diffuse_records, "--diffuse-records");
    loadMechanismPlugins(arguments.plugins, "--plugins");
    if (mechanisms->count() > 0) {
      loadMechanismPluginsOfEnvironment();
      std::cout << (arguments.mechanism.empty() ? mechanismList() : mechanismText(arguments.mechanism));
      return 0;
    }
    if (arguments.output.path.empty()) throw InputError("--output is required; run with --help for the options");
    return arguments.at.empty() ? simulateRecordings(arguments) : simulateOnePlace(arguments);
  });
}
