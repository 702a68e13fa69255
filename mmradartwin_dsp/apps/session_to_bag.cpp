#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/ros/bag.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::string session;
  OutputArguments output;
  CLI::App app("Writes a session directory as a rosbag, from which bag_to_session makes the same directory again.");
  app.add_option("SESSION", session, "session directory or its session.yaml")->required();
  app.add_option("BAG", output.path, "bag to write")->required();
  addForceArgument(app, output);
  app.footer("Example: session_to_bag lab lab.bag");
  return runProgram(app, argc, argv, [&] {
    Output bag = Output::file(output, {session});
    ProgressLine progress;
    const std::vector<PoseProblem> problems = sessionToBag(session, bag.path(), [&progress](int done, int total) {
      progress.count(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "poses");
    });
    bag.complete();
    progress.clear();
    sayProblems(problems);
    std::cout << bag.name() << " written\n";
    return problems.empty() ? 0 : 2;
  });
}
