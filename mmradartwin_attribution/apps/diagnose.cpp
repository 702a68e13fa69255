// Finds what a twin gets wrong about a recording, names the cause, extends the twin by it and measures the gain.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "mmradartwin_attribution/diagnosed_poses.h"
#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/diagnosis_report.h"
#include "mmradartwin_attribution/report.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/pose_placement.h"
#include "recording_arguments.h"

namespace {

using namespace mmradartwin;

struct Arguments {
  RecordingArguments input;
  OutputArguments output;
  std::string config, diagnosis_config;
  std::vector<std::string> compared;
  int jobs = 0, findings = DiagnosisOptions().most_findings;
};

void requireSameScene(const TwinDescription& other, const TwinDescription& twin) {
  if (other.scene_file == twin.scene_file) return;
  throw InputError(other.file + ": its scene is " + other.scene_file + ", that of the twin in question " +
                   twin.scene_file +
                   "; --compare takes twins of one scene, give the other as --twin in a run of its own");
}

int run(const Arguments& arguments, const std::vector<std::string>& command) {
  std::vector<std::string> inputs = arguments.input.inputs();
  inputs.insert(inputs.end(), arguments.compared.begin(), arguments.compared.end());
  inputs.insert(inputs.end(), {arguments.config, arguments.diagnosis_config});
  Output output = Output::folder(arguments.output, inputs, "findings.json");
  const Recording recording = arguments.input.open(true);
  const std::optional<std::string> scene = arguments.input.sceneFile(recording);
  const std::string twin_file = arguments.input.twinFile(recording);

  const DiagnosisReport report(output.path(), arguments.input.templates);
  DiagnosisOptions options;
  options.jobs = arguments.jobs;
  options.most_findings = arguments.findings;
  if (!arguments.config.empty()) options.config = loadAttributionConfig(arguments.config);
  if (!arguments.diagnosis_config.empty()) options.accuracy = loadStatedAccuracy(arguments.diagnosis_config);
  Diagnosis diagnosis;
  std::optional<DiagnosedPoses> poses;
  std::string given_twin_yaml;
  {
    ProgressLine line;
    options.on_progress = [&line](const DiagnosisProgress& progress) { line.show(progress.share, progress.stage); };
    if (!scene && twin_file.empty()) {
      if (!arguments.compared.empty()) {
        throw InputError(recording.source +
                         ": names no scene that twins could be compared in; leave --compare out, or "
                         "add a line scene: to session.yaml");
      }
      note("the recording names no scene: only its frames and channels are judged");
      diagnosis = diagnoseReceiver(recording, options);
    } else {
      Twin twin = twinAt(arguments.input.loadTwinOf(recording), recording.poses, recording.source);
      TwinDescription given = twin.description();
      RecordingArguments::leaveOutTemporary(given);
      given_twin_yaml = given.toYaml();
      for (const std::string& line : meshNotes(twin.scene())) note(line);
      for (const std::string& file : arguments.compared) {
        options.compared.push_back(arguments.input.loadTwinOf(recording, file));
        requireSameScene(options.compared.back(), twin.description());
      }
      diagnosis = diagnose(recording, twin, options);
      try {
        poses = compareDiagnosedPoses(recording, twin, diagnosis, options);
      } catch (const InputError& error) {  // what was found stands without it
        note("the report shows no single poses: " + std::string(error.what()));
      }
    }
  }
  // Scene and radar are the recording's wherever it is read from: a bag's stand in a temporary folder.
  TwinDescription& extended = diagnosis.extended;
  if (recording.scene_file && std::filesystem::path(extended.scene_file).lexically_normal() ==
                                  std::filesystem::path(*recording.scene_file).lexically_normal()) {
    extended.scene_file.clear();
  }
  if (radarHash(extended.radar) == radarHash(recording.radar)) extended.radar_file.clear();
  RecordingArguments::leaveOutTemporary(extended);
  RunDescription description;
  description.command = command;
  description.recording = arguments.input.recording();
  description.simulated = "twin";
  description.version = packageVersion();
  description.attribution_yaml = toYaml(options.config);
  description.radar_yaml = toYaml(recording.radar);
  if (diagnosis.has_twin) description.twin_yaml = given_twin_yaml;
  std::vector<std::string> more = {
      arguments.config, arguments.diagnosis_config, arguments.input.radarFile(), arguments.input.channels,
      twin_file,        scene.value_or("")};
  more.insert(more.end(), arguments.compared.begin(), arguments.compared.end());
  more.insert(more.end(), arguments.input.recordings.begin() + 1, arguments.input.recordings.end());
  description.inputs = hashFiles(inputFiles(arguments.input.recording(), recording, more));
  report.write(diagnosis, description, poses ? &*poses : nullptr);
  output.complete();
  sayProblems(diagnosis.problems);
  std::cout << diagnosisText(diagnosis) << "Findings: " << output.name() << "/findings.json\n"
            << "Report: " << output.name() << "/report.html\n";
  return diagnosis.problems.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Finds what a twin gets wrong about a recording, and why.");
  arguments.input.addTo(app);
  arguments.input.addChannelsTo(app);
  addOutputArguments(app, arguments.output, "folder for findings.json, report and extended twin");
  app.add_option("--config", arguments.config, "attribution.yaml of the paper's metrics (default: as shipped)");
  app.add_option("--diagnosis-config", arguments.diagnosis_config,
                 "diagnosis.yaml with the stated accuracy of scene, levels and poses (default: as shipped; what the "
                 "session states itself comes first)");
  app.add_option("--compare", arguments.compared,
                 "other twin.yaml of the same scene: how much likelier or less likely each makes the same channels")
      ->allow_extra_args(false);
  arguments.input.addTemplatesTo(app);
  addJobsArgument(app, arguments.jobs);
  app.add_option(
         "--findings", arguments.findings,
         "most causes to look for among echoes (default 6; 0: how much of the measured power the twin explains)")
      ->check(CLI::Range(0, 16));
  app.footer("Example: diagnose lab.bag --output diagnosis");
  const std::vector<std::string> command(argv, argv + argc);
  return runProgram(app, argc, argv, [&] { return run(arguments, command); });
}
