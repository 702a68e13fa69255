// A DCA1000EVM without hardware: answers the command port and plays a session's captures, or one capture, as the card
// would send them.
#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <mutex>

#include "../emulator/emulated_card.h"
#include "../emulator/session_frames.h"
#include "mmradartwin_dsp/input_error.h"

namespace {

volatile sig_atomic_t interrupted = 0;

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

}  // namespace

int main(int argc, char** argv) {
  using mmradartwin::EmulatedCard;
  CLI::App app{"Emulates a DCA1000EVM that plays recorded captures over UDP at the radar's pace."};
  std::string input, radar;
  mmradartwin::PlayedSelection selection;
  EmulatedCard::Options options;
  std::vector<std::string> status_at;
  double start_delay_s = 1.0;
  bool once = false, end_with_parent = false;
  app.add_option("input", input, "session directory, or a capture (then --radar says what recorded it)")->required();
  app.add_option("--radar", radar, "radar.yaml of a bare capture");
  app.add_option("--first", selection.first, "index of the first pose played")->check(CLI::NonNegativeNumber);
  app.add_option("--every", selection.every, "then every so-manieth pose")->check(CLI::PositiveNumber);
  app.add_option("--count", selection.count, "poses played at most; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--card-ip", options.card_ip, "address of the emulated card")->capture_default_str();
  app.add_option("--host-ip", options.host_ip, "address that samples go to")->capture_default_str();
  app.add_option("--config-port", options.config_port, "command port of both sides")->capture_default_str();
  app.add_option("--data-port", options.data_port, "the host's data port")->capture_default_str();
  app.add_option("--source-port", options.source_port, "port that the card sends from")->capture_default_str();
  app.add_option("--payload-bytes", options.payload_bytes, "sample bytes in a full packet")
      ->capture_default_str()
      ->check(CLI::Range(1, 1462));
  app.add_option("--start-delay-s", start_delay_s, "from the first RECORD_START to the first frame")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--flush-s", options.flush_s, "from the last sample to the short last packet")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--deaf-s", options.deaf_s, "silence after CONFIG_FPGA")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--loss", options.loss, "probability that a data packet is lost")->check(CLI::Range(0.0, 1.0));
  app.add_option("--duplicate", options.duplicate, "probability that it comes twice")->check(CLI::Range(0.0, 1.0));
  app.add_option("--reorder", options.reorder, "probability that it is overtaken")->check(CLI::Range(0.0, 1.0));
  app.add_option("--reorder-depth", options.reorder_depth, "packets that overtake it at most")
      ->capture_default_str()
      ->check(CLI::PositiveNumber);
  app.add_option("--truncate", options.truncate, "probability that its end is missing")->check(CLI::Range(0.0, 1.0));
  app.add_option("--jitter-us", options.jitter_us, "packets leave late by an exponential time of this mean")
      ->check(CLI::Range(0.0, 1e5));
  app.add_option("--stall-us", options.stall_us, "with --jitter-us: one packet in twenty by up to so much more")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--seed", options.seed, "of these chances")->capture_default_str();
  app.add_option("--status-at", status_at, "FRAME:BITS: status datagram as that frame begins");
  app.add_flag("--once", once, "end when the last frame was played");
  app.add_flag("--end-with-parent", end_with_parent, "end when the program ends that started this one");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (end_with_parent) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (getppid() == 1) return 1;
  }
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::mutex output;
  const auto log = [&output](const std::string& line) {
    const std::lock_guard<std::mutex> lock(output);
    std::printf("%s\n", line.c_str());
  };
  try {
    for (const std::string& text : status_at) options.status_at_frame.insert(parseStatusAt(text));
    const auto session = mmradartwin::openPlayedSession(input, radar, selection);
    for (const auto& problem : session.problems) {
      std::fprintf(stderr, "pose %s left out: %s\n", problem.pose.c_str(), problem.message.c_str());
    }
    mmradartwin::SessionFrames frames(session, start_delay_s, log);
    EmulatedCard card(frames, options, log);
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted = 1; };
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    log("ready poses=" + std::to_string(session.poses.size()) + " frames=" + std::to_string(session.frames));
    while (!interrupted && !(once && card.completed())) card.serve(100);
    // The host answers the end of a recording with RECORD_STOP.
    for (int i = 0; i < 10 && !interrupted; ++i) card.serve(100);
    return session.problems.empty() ? 0 : 2;
  } catch (const mmradartwin::InputError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
