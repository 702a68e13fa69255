#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/ros/bag.h"

int main(int argc, char** argv) {
  std::string session, bag;
  CLI::App app("Writes a session directory as a rosbag, from which bag_to_session makes the same directory again.");
  app.add_option("SESSION", session, "session directory or its session.yaml")->required();
  app.add_option("BAG", bag, "bag to write")->required();
  return mmradartwin::runProgram(app, argc, argv, [&] {
    std::optional<mmradartwin::ProgressBar> progress;
    mmradartwin::sessionToBag(session, bag, [&progress](int done, int total) {
      if (!progress) progress.emplace(total);
      progress->show(done);
    });
    std::cerr << bag << " written\n";
    return 0;
  });
}
