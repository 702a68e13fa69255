#include "emulator_program.h"

#include <signal.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "mmradartwin_dsp/program.h"

namespace mmradartwin {
namespace {

volatile sig_atomic_t interrupted_by_signal = 0;

}  // namespace

EmulatorProgram::EmulatorProgram(CLI::App& app, EmulatedCard::Options& card) : app_(app) {
  app.add_option("--first", selection_.first, "index of the first pose played")->check(CLI::NonNegativeNumber);
  app.add_option("--every", selection_.every, "then every so-manieth pose")->check(CLI::PositiveNumber);
  app.add_option("--count", selection_.count, "poses played at most; 0: all")->check(CLI::NonNegativeNumber);
  app.add_option("--card-ip", card.card_ip, "address of the emulated card")->capture_default_str();
  app.add_option("--host-ip", card.host_ip, "address of this host that samples go to")->capture_default_str();
  app.add_option("--deaf-s", card.deaf_s, "silence after CONFIG_FPGA")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--fpga-version", card.fpga_version,
                 "answer to READ_FPGA_VERSION: 0x0402 is 2.8, 0x4000 the playback bit")
      ->capture_default_str();
  app.add_option("--flush-s", card.flush_s, "from the last sample to the short last packet")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 60.0));
  app.add_option("--loss", card.loss, "probability that a data packet is lost")->check(CLI::Range(0.0, 1.0));
  app.add_option("--jitter-us", card.jitter_us, "packets leave late by an exponential time of this mean")
      ->check(CLI::Range(0.0, 1e5));
  app.add_option("--stall-us", card.stall_us, "with --jitter-us: one packet in twenty by up to so much more")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--seed", card.seed, "of these chances")->capture_default_str();
  app.add_flag("--end-with-parent", end_with_parent_, "end when the program ends that started this one");
}

int EmulatorProgram::run(int argc, char** argv, const std::function<int()>& play) {
  return runProgram(app_, argc, argv, [&] {
    if (end_with_parent_) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      if (getppid() == 1) return 1;
    }
    std::setvbuf(stdout, nullptr, _IOLBF, 0);
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted_by_signal = 1; };
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
    return play();
  });
}

PlayedSession EmulatorProgram::open(const std::string& input, const std::string& radar_file) const {
  PlayedSession session = openPlayedSession(input, radar_file, selection_);
  for (const auto& problem : session.problems) {
    std::fprintf(stderr, "pose %s left out: %s\n", problem.pose.c_str(), problem.message.c_str());
  }
  return session;
}

void EmulatorProgram::log(const std::string& line) {
  const std::lock_guard<std::mutex> lock(output_);
  std::printf("%s\n", line.c_str());
}

bool EmulatorProgram::interrupted() { return interrupted_by_signal != 0; }

}  // namespace mmradartwin
