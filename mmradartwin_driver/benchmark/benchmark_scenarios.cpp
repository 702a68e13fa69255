// Random streams of packets through the frame assembler, as many as one likes: every byte at its place or flagged lost.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <cstdio>

#include "../test/assembly_scenario.h"
#include "mmradartwin_dsp/program.h"

int main(int argc, char** argv) {
  using mmradartwin::AssemblyScenario;
  std::uint64_t count = 100000, from = 0;
  CLI::App app("Checks frame assembly on random scenarios (loss, reordering, duplication, truncation, restarts).");
  app.add_option("--count", count, "scenarios")->capture_default_str();
  app.add_option("--from", from, "seed of the first one; the others follow")->capture_default_str();
  return mmradartwin::runProgram(app, argc, argv, [&] {
    AssemblyScenario total;
    std::uint64_t wrong = 0;
    for (std::uint64_t done = 1; done <= count; ++done) {
      const std::uint64_t seed = from + done - 1;
      const AssemblyScenario one = mmradartwin::runAssemblyScenario(seed);
      total.packets += one.packets;
      total.frames += one.frames;
      total.bytes += one.bytes;
      total.lost += one.lost;
      total.misplaced += one.misplaced;
      total.unflagged += one.unflagged;
      if (one.misplaced || one.unflagged || !one.problem.empty()) {
        std::printf("seed %llu: misplaced=%llu unflagged=%llu %s\n", static_cast<unsigned long long>(seed),
                    static_cast<unsigned long long>(one.misplaced), static_cast<unsigned long long>(one.unflagged),
                    one.problem.c_str());
        ++wrong;
      }
      if (done % 10000 != 0 && done != count) continue;
      std::printf(
          "%llu scenarios to seed %llu: %llu packets, %llu frames, %llu bytes placed, %llu flagged lost, "
          "misplaced=%llu unflagged=%llu, %llu scenarios wrong\n",
          static_cast<unsigned long long>(done), static_cast<unsigned long long>(seed),
          static_cast<unsigned long long>(total.packets), static_cast<unsigned long long>(total.frames),
          static_cast<unsigned long long>(total.bytes), static_cast<unsigned long long>(total.lost),
          static_cast<unsigned long long>(total.misplaced), static_cast<unsigned long long>(total.unflagged),
          static_cast<unsigned long long>(wrong));
      std::fflush(stdout);
    }
    return wrong == 0 ? 0 : 1;
  });
}
