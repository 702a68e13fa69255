// simulate: scene, radar, twin and poses of a session -> a session of simulated samples, and the paths of every pose.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <mutex>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/simulate_session.h"

using namespace mmradartwin;

int main(int argc, char** argv) {
  SimulateOptions options;
  CLI::App app("Simulates the poses of a session and writes a session of its own, with paths/{pose}.csv beside it.");
  app.add_option("SESSION", options.session, "session directory or its session.yaml; captures are not needed")
      ->required();
  app.add_option("--output", options.output, "session directory to write")->required();
  app.add_option("--twin", options.twin_file, "twin.yaml instead of the session's");
  std::string plugins;
  app.add_option("--plugins", plugins, "libraries with mechanisms of your own, parted by ':' (or MMRADARTWIN_PLUGINS)");
  app.add_option("--frames", options.frames, "frames per pose, alike but for mechanisms of frames")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of the phases of scatter points")->capture_default_str();
  std::string noise = "thermal";
  app.add_option("--noise", noise, "of samples, where the twin has no noise_floor: thermal noise of the radar, or none")
      ->check(CLI::IsMember({"thermal", "none"}))
      ->capture_default_str();
  std::string diffuse_records = "cells";
  app.add_option("--diffuse-records", diffuse_records, "in paths/{pose}.csv: summed by cells of a facet, or all points")
      ->check(CLI::IsMember({"cells", "points"}))
      ->capture_default_str();
  app.add_option("--jobs", options.jobs, "threads; 0 = all cores")->check(CLI::Range(0, 1024))->capture_default_str();
  return runProgram(app, argc, argv, [&] {
    options.noise = noise == "none" ? SimulatedNoise::kNone : SimulatedNoise::kThermal;
    options.diffuse_records = diffuseRecordsFrom(diffuse_records, "--diffuse-records");
    loadMechanismPlugins(plugins, "--plugins");
    std::unique_ptr<ProgressBar> bar;
    std::mutex mutex;
    int shown = 0;
    const SimulateResult result = simulateSession(options, [&](int done, int total) {
      const std::lock_guard<std::mutex> lock(mutex);
      if (!bar) bar = std::make_unique<ProgressBar>(total);
      if (done > shown) bar->show(shown = done);
    });
    bar.reset();
    if (result.noise_dbfs) {
      std::cerr << "note: thermal noise of " << *result.noise_dbfs
                << " dBFS is added to each sample; --noise none leaves it out\n";
    } else if (noise == "none") {
      std::cerr << "note: no noise is written but what the twin states\n";
    }
    for (const std::string& note : result.notes) std::cerr << "note: " << note << "\n";
    for (const PoseProblem& problem : result.problems) std::cerr << "error: " << problem.message << "\n";
    std::cerr << result.poses << " pose(s) in " << options.output << ", gain " << result.gain_db
              << " dB, records hold to " << std::max(result.worst_amplitude_error, result.worst_grid_error) << ", "
              << result.problems.size() << " pose(s) skipped\n";
    if (std::max(result.worst_amplitude_error, result.worst_grid_error) > 1e-12) {
      std::cerr << "error: records and grid disagree by more than 1e-12\n";
      return 1;
    }
    return result.problems.empty() ? 0 : 2;
  });
}
