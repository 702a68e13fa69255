// Finds what a twin gets wrong about a recording, names the cause, extends the twin by it and measures the gain.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>

#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/diagnosis_report.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/bag.h"

namespace {

using namespace mmradartwin;

struct Arguments {
  std::string recording, output, twin, scene, config, radar;
  int jobs = 0;
};

int run(const Arguments& arguments, const std::vector<std::string>& command) {
  Recording recording;
  if (std::filesystem::path(arguments.recording).extension() == ".bag") {
    recording = openRecording(arguments.recording, arguments.radar);
  } else {
    SessionOptions options;
    options.radar_file = arguments.radar;
    recording = openSession(arguments.recording, options);
  }
  const std::string twin_file = arguments.twin.empty() ? recording.twin_file.value_or("") : arguments.twin;
  std::optional<std::string> scene = recording.scene_file;
  if (!arguments.scene.empty()) scene = arguments.scene;

  const DiagnosisReport report(arguments.output);
  DiagnosisOptions options;
  options.jobs = arguments.jobs;
  if (!arguments.config.empty()) options.config = loadAttributionConfig(arguments.config);
  std::size_t width = 0;
  options.on_progress = [&](const DiagnosisProgress& p) {
    std::ostringstream line;
    line << '\r' << std::setw(3) << static_cast<int>(100 * p.share) << " % " << p.stage;
    std::string text = line.str();
    const std::size_t length = text.size();
    if (length < width) text.append(width - length, ' ');
    width = length;
    std::cerr << text << std::flush;
  };
  Diagnosis diagnosis;
  if (!scene && twin_file.empty()) {
    std::cerr << "the recording names no scene: only its frames are judged\n";
    diagnosis = diagnoseReceiver(recording, options);
  } else {
    Twin twin(loadTwin(twin_file, scene, recording.radar));
    diagnosis = diagnose(recording, twin, options);
  }
  std::cerr << '\r' << std::string(width, ' ') << '\r';
  report.write(diagnosis, command);
  for (const PoseProblem& problem : diagnosis.problems) std::cerr << "error: " << problem.message << '\n';
  std::cout << diagnosisText(diagnosis) << "Findings: " << arguments.output << "/findings.json\n"
            << "Report: " << arguments.output << "/index.html\n";
  return diagnosis.problems.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Finds what a twin gets wrong about a recording, and why.");
  app.name("diagnose");
  app.add_option("recording", arguments.recording, "session directory, session.yaml or bag")->required();
  app.add_option("--output", arguments.output, "folder for findings.json, report and extended twin")->required();
  app.add_option("--twin", arguments.twin, "twin.yaml (default: the session's, or the base mechanisms)");
  app.add_option("--scene", arguments.scene, "scene.yaml where the recording names none");
  app.add_option("--config", arguments.config, "attribution.yaml of the paper's metrics (default: as shipped)");
  app.add_option("--radar", arguments.radar, "radar.yaml for a recording without one");
  app.add_option("--jobs", arguments.jobs, "threads (default: one per core)")->check(CLI::Range(1, 1024));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const int status = app.exit(error, std::cout, std::cerr);
    return status == 0 ? 0 : 2;
  }
  try {
    return run(arguments, std::vector<std::string>(argv, argv + argc));
  } catch (const InputError& error) {
    std::cerr << "\nerror: " << error.what() << '\n';
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "\nerror: " << error.what() << '\n';
    return 1;
  }
}
