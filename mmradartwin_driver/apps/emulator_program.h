#pragma once

#include <functional>
#include <mutex>
#include <string>

#include "../emulator/emulated_card.h"
#include "../emulator/played_session.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// Common part of dca1000_emulator and emulated_rig: options of session and card, lines on stdout, and the end, by a
/// signal or with the program that started them. One per process.
class EmulatorProgram {
 public:
  /// Adds the options, which set `card`; both must outlive this.
  EmulatorProgram(CLI::App& app, EmulatedCard::Options& card);

  /// Parses the command line and plays; returns the exit status (0 done, 2 bad input or use, 1 failed).
  int run(int argc, char** argv, const std::function<int()>& play);
  /// The selected poses; reports on stderr which poses are left out. Throws InputError.
  PlayedSession open(const std::string& input, const std::string& radar_file) const;
  /// Writes a line to stdout, from any thread.
  void log(const std::string& line);
  /// True after SIGINT or SIGTERM.
  static bool interrupted();

 private:
  CLI::App& app_;
  PlayedSelection selection_;
  bool end_with_parent_ = false;
  std::mutex output_;
};

}  // namespace mmradartwin
