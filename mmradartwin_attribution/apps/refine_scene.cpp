// Tells how far each actor of a scene stands from where the scene has it, by the ranges of a session's echoes.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_attribution/scene_refinement.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_sim/pose_placement.h"
#include "recording_arguments.h"

namespace {

using namespace mmradartwin;

struct Arguments {
  RecordingArguments input;
  OutputArguments output;
  std::string diagnosis_config;
  int jobs = 0;
};

void print(const SceneRefinement& refinement) {
  std::printf("%-24s %10s %8s\n", "actor", "farther by", "+-");
  for (const RefinedActor& actor : refinement.actors) {
    std::printf("%-24s %7.1f mm %5.1f mm", actor.actor.c_str(), 1000 * actor.range_m, 1000 * actor.std_m);
    if (actor.shift) {
      const Eigen::Vector2d std_m = actor.shift->covariance_m2.diagonal().cwiseSqrt();
      std::printf("   moved by (%.1f +- %.1f, %.1f +- %.1f) mm", 1000 * actor.shift->mean_m.x(), 1000 * std_m.x(),
                  1000 * actor.shift->mean_m.y(), 1000 * std_m.y());
    }
    std::printf("\n");
  }
  const GainMetric& gain = refinement.held_out_nats_per_pose;
  if (!gain.difference_ci95) {
    std::printf("one location: the gain on held-out places cannot be measured\n");
    return;
  }
  std::printf("On places that have no part in it: %+.1f nats per pose (%.1f to %.1f)\n", gain.after - gain.before,
              (*gain.difference_ci95)[0], (*gain.difference_ci95)[1]);
}

int run(const Arguments& arguments) {
  std::vector<std::string> inputs = arguments.input.inputs();
  inputs.push_back(arguments.diagnosis_config);
  Output output = Output::folder(arguments.output, inputs, "refinement.yaml");
  const Recording recording = arguments.input.open(true);
  if (!arguments.input.sceneFile(recording) && arguments.input.twinFile(recording).empty()) {
    throw InputError(recording.source + ": names no scene that could be refined; add a line scene: to session.yaml");
  }
  DiagnosisOptions options;
  options.jobs = arguments.jobs;
  if (!arguments.diagnosis_config.empty()) options.accuracy = loadStatedAccuracy(arguments.diagnosis_config);
  SceneRefinement refinement;
  {
    ProgressLine line;
    options.on_progress = [&line](const DiagnosisProgress& progress) { line.show(progress.share, progress.stage); };
    Twin twin = twinAt(arguments.input.loadTwinOf(recording), recording.poses, recording.source);
    refinement = refineScene(recording, twin, options);
  }
  const std::filesystem::path file = std::filesystem::path(output.path()) / "refinement.yaml";
  std::ofstream out(file);
  out << refinement.toYaml(arguments.input.recording());
  out.close();
  if (!out) throw std::runtime_error(output.name() + ": cannot be written; check the free space");
  output.complete();
  print(refinement);
  std::printf("Written: %s\n", (std::filesystem::path(output.name()) / "refinement.yaml").c_str());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Tells how far each actor of a scene stands from where the scene has it, by the echoes' ranges.");
  arguments.input.addTo(app);
  arguments.input.addChannelsTo(app);
  addOutputArguments(app, arguments.output, "folder for refinement.yaml");
  app.add_option("--diagnosis-config", arguments.diagnosis_config,
                 "diagnosis.yaml with the stated accuracy of scene, levels and poses (default: as shipped; what the "
                 "session states itself comes first)");
  addJobsArgument(app, arguments.jobs);
  app.footer(
      "Example: refine_scene session --output refinement; make_scene room.ply --refine refinement --output better");
  return runProgram(app, argc, argv, [&] { return run(arguments); });
}
