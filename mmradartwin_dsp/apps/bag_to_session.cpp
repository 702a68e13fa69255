#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/ros/bag_arguments.h"

int main(int argc, char** argv) {
  std::vector<std::string> paths;
  mmradartwin::BagOptions options;
  CLI::App app("Writes a rosbag as a session directory: the one it was made from, or one of the poses found in tf.");
  app.add_option("BAG... SESSION", paths,
                 "bag with radar/adc, radar/config and tf (several, the parts of one recording, are read as one), and "
                 "the folder to write")
      ->required()
      ->expected(2, 10000);
  mmradartwin::addBagArguments(app, options);
  app.add_option("--radar", options.ns, "namespace of one of several radars");
  return mmradartwin::runProgram(app, argc, argv, [&] {
    std::optional<mmradartwin::ProgressBar> progress;
    const std::string& session = paths.back();
    options.further.assign(paths.begin() + 1, paths.end() - 1);
    const auto show = [&progress](int done, int total) {
      if (!progress) progress.emplace(total);
      progress->show(done);
    };
    mmradartwin::bagToSession(paths.front(), session, show, options);
    std::cerr << session << " written\n";
    return 0;
  });
}
