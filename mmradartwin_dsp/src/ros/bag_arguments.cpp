#include "mmradartwin_dsp/ros/bag_arguments.h"

#include <CLI/CLI.hpp>
#include <iostream>

namespace mmradartwin {

void addBagArguments(CLI::App& app, BagOptions& options) {
  app.add_option("--map-frame", options.map_frame, "tf frame of the room, for bags")->capture_default_str();
  app.add_option("--radar-frame", options.radar_frame,
                 "tf frame of the radar, for bags (default: radar_link, or the one that the frames name)");
  app.add_option("--ns", options.ns, "namespace of the bag's topics; needed only where it holds several radars");
  app.add_option("--clock-offset", options.clock_offset_s,
                 "s by which a bag's frames are stamped later than its tf, where two computers' clocks differ")
      ->capture_default_str();
  options.on_note = [](const std::string& note) { std::cerr << "note: " << note << "\n"; };
}

}  // namespace mmradartwin
