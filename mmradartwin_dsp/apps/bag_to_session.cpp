#include <CLI/CLI.hpp>
#include <iostream>
#include <optional>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/ros/bag.h"

int main(int argc, char** argv) {
  std::string bag, session;
  CLI::App app("Writes a rosbag as a session directory: the one it was made from, or one of the poses found in tf.");
  app.add_option("BAG", bag, "bag with radar/adc, radar/config and tf")->required();
  app.add_option("SESSION", session, "folder to write")->required();
  return mmradartwin::runProgram(app, argc, argv, [&] {
    std::optional<mmradartwin::ProgressBar> progress;
    mmradartwin::bagToSession(bag, session, [&progress](int done, int total) {
      if (!progress) progress.emplace(total);
      progress->show(done);
    });
    std::cerr << session << " written\n";
    return 0;
  });
}
