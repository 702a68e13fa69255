#pragma once

#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/output.h"
#include "mmradartwin_dsp/program_version.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// Runs an offline program: parses the command line, calls `run`, and turns what goes wrong into one line on stderr and
/// the exit status (0 done, 2 bad input or use, 1 failed). `run` returns the status itself where it came to an end.
/// Adds
/// --version and --quiet; an unknown option is told first, with the one that was meant. A program that is interrupted
/// leaves no temporary folder and no unfinished output.
int runProgram(CLI::App& app, int argc, char** argv, const std::function<int()>& run);

/// InputError where a number of the command line is not finite: CLI::Range lets nan through.
void checkFinite(const CLI::App& app);

/// Says on stderr what a user may want to know and need not act on; not in a quiet program.
void note(const std::string& text);

/// Says on stderr what was wrong with parts of the input, one line each; of many, the first and how many more there
/// are.
void sayErrors(const std::vector<std::string>& errors);
/// The same of poses' problems.
template <typename Problems>
void sayProblems(const Problems& problems) {
  std::vector<std::string> errors;
  for (const auto& problem : problems) errors.push_back(problem.message);
  sayErrors(errors);
}
/// As sayErrors(), of what a user need not act on.
void noteAll(const std::vector<std::string>& notes);

/// Adds --output and --force.
void addOutputArguments(CLI::App& app, OutputArguments& output, const std::string& description);
/// Adds --force alone, for programs whose output is a positional argument.
void addForceArgument(CLI::App& app, OutputArguments& output);
/// Adds --jobs; 0 stands for all cores.
void addJobsArgument(CLI::App& app, int& jobs);

}  // namespace mmradartwin
