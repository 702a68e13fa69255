#include <CLI/CLI.hpp>

#include "mmradartwin_dsp/ros/bag_arguments.h"
#include "simulated_input.h"

namespace mmradartwin {

struct SimulatedInput::Arguments {
  std::vector<std::string> recordings;
  std::string radar;
  BagOptions bag;
};

SimulatedInput::SimulatedInput() : arguments_(std::make_unique<Arguments>()) {}
SimulatedInput::~SimulatedInput() = default;

void SimulatedInput::addTo(CLI::App& app) {
  app.add_option("RECORDING", arguments_->recordings,
                 "session directory, session.yaml or bag, whose poses are simulated; captures are not needed; several "
                 "bags, the parts of one, are read as one");
  app.add_option("--radar", arguments_->radar,
                 "radar.yaml instead of the session's; of a bag with several radars the namespace of one");
  addBagArguments(app, arguments_->bag);
}

const std::vector<std::string>& SimulatedInput::recordings() const { return arguments_->recordings; }
const std::string& SimulatedInput::radar() const { return arguments_->radar; }

Recording SimulatedInput::open(const std::string& folder) const {
  BagOptions options = arguments_->bag;
  options.further.assign(recordings().begin() + 1, recordings().end());
  options.exclude_duplicates = options.need_captures = false;
  options.unpack_to = folder;
  return openRecording(recordings().front(), arguments_->radar, std::nullopt, options);
}

}  // namespace mmradartwin
