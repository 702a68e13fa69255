// Compares a recording with its twin (or with a simulated session): the paper's table, per-pose results, pictures, a
// report.

#include <CLI/CLI.hpp>
#include <iostream>
#include <memory>

#include "mmradartwin_attribution/evaluation.h"
#include "mmradartwin_attribution/pose_picture.h"
#include "mmradartwin_attribution/report.h"
#include "mmradartwin_attribution/ros/results_bag.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_sim/pose_placement.h"
#include "recording_arguments.h"

namespace {

using namespace mmradartwin;

struct Arguments {
  RecordingArguments input;
  OutputArguments output;
  std::string simulated, config;
  int jobs = 0;
  std::string diffuse_records = "cells";
  bool no_pictures = false, no_bag = false;
};

/// What was run, with what. other: the simulated recording, empty where a twin was simulated.
RunDescription describeRun(const Arguments& arguments, const std::vector<std::string>& command,
                           const Recording& recording, const Recording& other, const EvaluationOptions& options,
                           const TwinDescription& twin) {
  const bool from_twin = arguments.simulated.empty();
  RunDescription description;
  description.command = command;
  description.recording = arguments.input.recording();
  description.simulated = from_twin ? "twin" : arguments.simulated;
  description.version = packageVersion();
  description.attribution_yaml = toYaml(options.config);
  description.radar_yaml = toYaml(recording.radar);
  std::vector<std::string> more = {arguments.config, arguments.input.radarFile(), arguments.input.channels, twin.file,
                                   twin.scene_file};
  more.insert(more.end(), arguments.input.recordings.begin() + 1, arguments.input.recordings.end());
  if (!from_twin) {
    const std::vector<std::string> files = inputFiles(arguments.simulated, other, {});
    more.insert(more.end(), files.begin(), files.end());
  }
  description.inputs = hashFiles(inputFiles(arguments.input.recording(), recording, more));
  return description;
}

int run(const Arguments& arguments, const std::vector<std::string>& command) {
  std::vector<std::string> inputs = arguments.input.inputs();
  inputs.insert(inputs.end(), {arguments.simulated, arguments.config});
  Output output = Output::folder(arguments.output, inputs, "report.html");
  const Recording recording = arguments.input.open();
  const bool from_twin = arguments.simulated.empty();
  // The twin also brings the scene that the expected regions come from; beside a simulated session it is that of the
  // base mechanisms.
  Twin twin = placedTwin(from_twin ? arguments.input.loadTwinOf(recording)
                                   : loadTwin("", arguments.input.sceneFile(recording), recording.radar),
                         recording.poses, recording.source);
  EvaluationOptions options;
  if (!arguments.config.empty()) options.config = loadAttributionConfig(arguments.config);
  options.jobs = arguments.jobs;
  const SignalChain chain(recording.radar);
  const EvaluationField field(options.config, recording.radar, chain.axes());
  Recording other;
  SimulatedBranch simulated;
  if (from_twin) {
    std::vector<Eigen::Isometry3d> poses;
    for (const Pose& pose : recording.poses) poses.push_back(pose.T_map_radar);
    twin.prepare(poses);
    simulated = simulatedByTwin(twin, diffuseRecordsFrom(arguments.diffuse_records, "--diffuse-records"), &field);
  } else {
    other = arguments.input.open(arguments.simulated);
    simulated = simulatedBySession(other);
  }

  const ReportWriter report(output.path(), arguments.input.templates);
  std::unique_ptr<ResultsBag> bag;
  std::string twin_yaml;
  if (from_twin) {
    TwinDescription written = twin.description();
    RecordingArguments::leaveOutTemporary(written);
    twin_yaml = written.toYaml();
  }
  if (!arguments.no_bag) {
    bag = std::make_unique<ResultsBag>(output.path() + "/results.bag", field, recording.radar, twin.scene(), twin_yaml);
  }
  options.on_pose = [&](const PoseResult& pose) {
    if (!arguments.no_pictures) writePicture(drawPose(field, pose), report.pictureFile(pose.pose.name));
    if (bag) bag->add(pose);
  };
  ProgressLine progress;
  options.on_progress = [&](std::size_t done, std::size_t all) { progress.count(done, all, "poses"); };
  const Evaluation evaluation = evaluate(recording, refusingEmpty(simulated), twin.scene(), twin.rays(), options);
  progress.clear();

  std::vector<Pose> used;
  for (const PoseResult& pose : evaluation.poses) {
    if (pose.used) used.push_back(pose.pose);
  }
  if (used.empty() && !evaluation.problems.empty()) {
    throw InputError(recording.source + ": no pose can be compared; the first: " + evaluation.problems.front().message);
  }
  ReportPictures pictures;
  if (!arguments.no_pictures) pictures.field = &field;
  pictures.coverage = drawCoverage(twin.scene(), used);
  writePicture(pictures.coverage, output.path() + "/coverage.png");
  if (bag) bag->finish(evaluation);

  RunDescription description = describeRun(arguments, command, recording, other, options, twin.description());
  description.twin_yaml = twin_yaml;
  report.write(evaluation, options.config, description, pictures);
  output.complete();

  sayProblems(evaluation.problems);
  std::cout << reportText(evaluation, options.config) << "Report: " << output.name() << "/report.html\n";
  return evaluation.problems.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Compares a recorded session with its twin and attributes what differs.");
  arguments.input.addTo(app);
  arguments.input.addChannelsTo(app);
  addOutputArguments(app, arguments.output, "folder for table, CSV, pictures and report");
  app.add_option("--simulated", arguments.simulated, "take the simulated maps from this session instead of a twin");
  app.add_option("--config", arguments.config, "attribution.yaml (default: the built-in values, as shipped)");
  app.add_option("--diffuse-records", arguments.diffuse_records,
                 "records of rough surfaces: summed by cells of a facet, or all points")
      ->check(CLI::IsMember({"cells", "points"}))
      ->capture_default_str();
  arguments.input.addTemplatesTo(app);
  addJobsArgument(app, arguments.jobs);
  app.add_flag("--no-pictures", arguments.no_pictures, "leave the per-pose pictures out");
  app.add_flag("--no-bag", arguments.no_bag, "leave results.bag (for rviz) out");
  app.footer("Example: evaluate lab.bag --output report");
  const std::vector<std::string> command(argv, argv + argc);
  return runProgram(app, argc, argv, [&] { return run(arguments, command); });
}
