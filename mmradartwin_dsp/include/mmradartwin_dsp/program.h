#pragma once

#include <functional>
#include <memory>

namespace CLI {
class App;
}

namespace mmradartwin {

/// Runs an offline program: parses the command line, calls `run`, and turns what goes wrong into one line on stderr and
/// the exit status (0 done, 2 bad input or use, 1 failed). `run` returns the status itself where it came to an end.
int runProgram(CLI::App& app, int argc, char** argv, const std::function<int()>& run);

/// A bar on stderr. Counts up to `total`; may be told the same count twice.
class ProgressBar {
 public:
  explicit ProgressBar(int total);
  ~ProgressBar();
  void show(int done);

 private:
  struct Display;
  std::unique_ptr<Display> display_;
};

}  // namespace mmradartwin
