#pragma once

#include "mmradartwin_dsp/ros/bag.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// Adds what the offline programs take of bags alike: --map-frame, --radar-frame, --ns and --clock-offset. Notes on a
/// bag go to stderr.
void addBagArguments(CLI::App& app, BagOptions& options);

}  // namespace mmradartwin
