#include <CLI/CLI.hpp>

#include "mmradartwin_dsp/input_error.h"
#include "simulated_input.h"

namespace mmradartwin {

struct SimulatedInput::Arguments {
  std::vector<std::string> recordings;
  std::string radar;
};

SimulatedInput::SimulatedInput() : arguments_(std::make_unique<Arguments>()) {}
SimulatedInput::~SimulatedInput() = default;

void SimulatedInput::addTo(CLI::App& app) {
  app.add_option("RECORDING", arguments_->recordings,
                 "session directory or session.yaml, whose poses are simulated; captures are not needed");
  app.add_option("--radar", arguments_->radar, "radar.yaml instead of the session's");
}

const std::vector<std::string>& SimulatedInput::recordings() const { return arguments_->recordings; }
const std::string& SimulatedInput::radar() const { return arguments_->radar; }

Recording SimulatedInput::open(const std::string&) const {
  if (recordings().size() > 1) throw InputError("give one session; this build reads no bags");
  SessionOptions options;
  options.need_captures = options.exclude_duplicates = false;
  options.radar_file = arguments_->radar;
  return openSession(recordings().front(), options);
}

}  // namespace mmradartwin
