#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// The recording whose poses simulate takes. A build without ROS reads sessions alone.
class SimulatedInput {
 public:
  SimulatedInput();
  ~SimulatedInput();
  SimulatedInput(const SimulatedInput&) = delete;
  SimulatedInput& operator=(const SimulatedInput&) = delete;

  /// Adds the argument RECORDING and, where bags are read, what is taken of them.
  void addTo(CLI::App& app);
  const std::vector<std::string>& recordings() const;
  const std::string& radar() const;  ///< as --radar gives it
  /// The recording with all its poses, duplicates too; captures are not needed. What a bag brings of scene and twin is
  /// written below `folder`.
  Recording open(const std::string& folder) const;

 private:
  struct Arguments;
  std::unique_ptr<Arguments> arguments_;
};

}  // namespace mmradartwin
