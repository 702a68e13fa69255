#include "mmradartwin_dsp/ros/bag_arguments.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {

void addBagArguments(CLI::App& app, BagOptions& options) {
  app.add_option("--map-frame", options.map_frame, "tf frame of the room, for bags")->capture_default_str();
  app.add_option("--radar-frame", options.radar_frame,
                 "tf frame of the radar, for bags (default: radar_link, or the one that the frames name)");
  app.add_option("--ns", options.ns, "namespace of the bag's topics; needed only where it holds several radars");
  app.add_option("--clock-offset", options.clock_offset_s,
                 "s by which a bag's frames are stamped later than its tf, where two computers' clocks differ")
      ->capture_default_str();
  options.on_note = [](const std::string& text) { note(text); };
}

void addDuplicatesArgument(CLI::App& app, BagOptions& options) {
  app.add_flag_callback(
      "--keep-duplicates", [&options] { options.exclude_duplicates = false; },
      "keep poses within 10 cm, 2 cm of height and 1 deg of heading of an earlier one, too");
}

void noteDuplicates(const Recording& recording) {
  constexpr std::size_t kNamed = 5;
  if (recording.duplicates.empty()) return;
  const auto first = recording.duplicates.begin();
  const std::size_t count = recording.duplicates.size(), named = std::min(count, kNamed);
  note(std::to_string(count) + " pose(s) left out as duplicates: " +
       join({first, first + static_cast<std::ptrdiff_t>(named)}, ", ") + (count > named ? ", ..." : "") +
       "; each is within 10 cm, 2 cm of height and 1 deg of heading of an earlier one (--keep-duplicates keeps them)");
}

}  // namespace mmradartwin
