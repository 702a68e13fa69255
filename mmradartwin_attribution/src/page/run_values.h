#pragma once

#include "mmradartwin_attribution/run_description.h"
#include "page/page_values.h"

namespace mmradartwin::page {

/// Names that runValues() fills, for pageNames().
inline constexpr const char* kRunNames =
    "version command recording texts[name text] inputs[sha256 file] input_count has_inputs[] problems[message] "
    "has_problems[]";
/// How to repeat a run: version, command, configuration, inputs with hashes, and what was left out.
void addRunValues(const RunDescription& run, const std::vector<PoseProblem>& problems, PageValues& values);

/// A command as a shell takes it.
std::string commandText(const std::vector<std::string>& words);
/// A word of a command, in quotes where a shell needs them.
std::string shellWord(const std::string& word);

}  // namespace mmradartwin::page
