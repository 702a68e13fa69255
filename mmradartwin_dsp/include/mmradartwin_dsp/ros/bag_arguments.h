#pragma once

#include "mmradartwin_dsp/ros/bag.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// Adds what the offline programs take of bags alike: --map-frame, --radar-frame, --ns and --clock-offset. Notes on a
/// bag go to stderr.
void addBagArguments(CLI::App& app, BagOptions& options);

/// Adds --keep-duplicates.
void addDuplicatesArgument(CLI::App& app, BagOptions& options);
/// Notes on stderr which poses were left out as duplicates, and by what rule.
void noteDuplicates(const Recording& recording);

}  // namespace mmradartwin
