#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/ros/bag_arguments.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::vector<std::string> paths;
  BagOptions options;
  OutputArguments output;
  CLI::App app("Writes a rosbag as a session directory: the one it was made from, or one of the poses found in tf.");
  app.add_option("BAG... SESSION", paths,
                 "bag with radar/adc, radar/config and tf (several, the parts of one recording, are read as one), and "
                 "the folder to write")
      ->required()
      ->expected(2, 10000);
  addForceArgument(app, output);
  addBagArguments(app, options);
  app.add_option("--radar", options.ns, "namespace of one of several radars; the same as --ns");
  app.footer("Example: bag_to_session lab.bag lab");
  return runProgram(app, argc, argv, [&] {
    output.path = paths.back();
    paths.pop_back();
    options.further.assign(paths.begin() + 1, paths.end());
    Output session = Output::folder(output, paths, "session.yaml");
    ProgressLine progress;
    const auto show = [&progress](int done, int total) {
      progress.count(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "poses");
    };
    const std::vector<PoseProblem> problems = bagToSession(paths.front(), session.path(), show, options);
    session.complete();
    progress.clear();
    sayProblems(problems);
    std::cout << session.name() << " written\n";
    return problems.empty() ? 0 : 2;
  });
}
