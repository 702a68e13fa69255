// DCA1000EVM without hardware: answers the command port and plays a session's captures, or one capture, as the card
// would send them.

#include <CLI/CLI.hpp>

#include "../emulator/emulated_card.h"
#include "../emulator/session_frames.h"
#include "emulator_program.h"
#include "mmradartwin_dsp/input_error.h"

namespace {

std::pair<std::int64_t, std::uint16_t> parseStatusAt(const std::string& text) {
  const std::size_t colon = text.find(':');
  try {
    if (colon == std::string::npos) throw std::invalid_argument(text);
    const long bits = std::stol(text.substr(colon + 1), nullptr, 0);
    if (bits < 0 || bits > 0xffff) throw std::out_of_range(text);
    return {std::stoll(text.substr(0, colon)), static_cast<std::uint16_t>(bits)};
  } catch (const std::logic_error&) {
    throw mmradartwin::InputError("--status-at " + text + ": must be FRAME:BITS, as in 40:0x80");
  }
}

std::pair<std::int64_t, std::int64_t> parseSilenceAt(const std::string& text) {
  const std::size_t colon = text.find(':');
  try {
    if (colon == std::string::npos) throw std::invalid_argument(text);
    const long long frames = std::stoll(text.substr(colon + 1));
    if (frames < 1) throw std::out_of_range(text);
    return {std::stoll(text.substr(0, colon)), frames};
  } catch (const std::logic_error&) {
    throw mmradartwin::InputError("--silence-at " + text + ": must be FRAME:FRAMES, as in 40:5");
  }
}

}  // namespace

int main(int argc, char** argv) {
  using mmradartwin::EmulatedCard;
  CLI::App app{"Emulates a DCA1000EVM that plays recorded captures over UDP at the radar's pace."};
  std::string input, radar;
  EmulatedCard::Options options;
  std::vector<std::string> status_at, silence_at;
  double start_delay_s = 1.0;
  bool once = false;
  app.add_option("input", input, "session directory, or a capture (then --radar says what recorded it)")->required();
  app.add_option("--radar", radar, "radar.yaml of a bare capture");
  mmradartwin::EmulatorProgram program(app, options);
  app.add_option("--config-port", options.config_port, "command port of both sides")->capture_default_str();
  app.add_option("--data-port", options.data_port, "the host's data port")->capture_default_str();
  app.add_option("--source-port", options.source_port, "port that the card sends from")->capture_default_str();
  app.add_option("--payload-bytes", options.payload_bytes, "sample bytes in a full packet")
      ->capture_default_str()
      ->check(CLI::Range(1, 1462));
  app.add_option("--start-delay-s", start_delay_s, "from the first RECORD_START to the first frame")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--duplicate", options.duplicate, "probability that it comes twice")->check(CLI::Range(0.0, 1.0));
  app.add_option("--reorder", options.reorder, "probability that it is overtaken")->check(CLI::Range(0.0, 1.0));
  app.add_option("--reorder-depth", options.reorder_depth, "packets that overtake it at most")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--truncate", options.truncate, "probability that its end is missing")->check(CLI::Range(0.0, 1.0));
  app.add_option("--status-at", status_at, "FRAME:BITS: status datagram as that frame begins");
  app.add_option("--restart-at", options.restart_at_frame, "both counts begin anew with that frame");
  app.add_option("--silence-at", silence_at, "FRAME:FRAMES: nothing leaves for so many frames, and the counts go on");
  app.add_flag("--once", once, "end when the last frame was played");
  app.footer("Example: dca1000_emulator lab --card-ip 127.0.0.2 --host-ip 127.0.0.1 --once");
  return program.run(argc, argv, [&] {
    for (const std::string& text : status_at) options.status_at_frame.insert(parseStatusAt(text));
    for (const std::string& text : silence_at) options.silence_at_frame.insert(parseSilenceAt(text));
    const auto log = [&program](const std::string& line) { program.log(line); };
    const auto session = program.open(input, radar);
    mmradartwin::SessionFrames frames(session, start_delay_s, log);
    EmulatedCard card(frames, options, log);
    program.log("ready poses=" + std::to_string(session.poses.size()) + " frames=" + std::to_string(session.frames));
    while (!program.interrupted() && !(once && card.completed())) card.serve(100);
    // The host answers the end of a recording with RECORD_STOP.
    for (int i = 0; i < 10 && !program.interrupted(); ++i) card.serve(100);
    return session.problems.empty() ? 0 : 2;
  });
}
