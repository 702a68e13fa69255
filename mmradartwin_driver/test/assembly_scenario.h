#pragma once

#include <cstdint>
#include <string>

namespace mmradartwin {

/// What came of one random stream of packets through the assembler, held byte by byte against what was sent and what
/// arrived of it.
struct AssemblyScenario {
  std::uint64_t packets = 0;    ///< that arrived
  std::uint64_t frames = 0;     ///< handed out
  std::uint64_t bytes = 0;      ///< that found their place
  std::uint64_t lost = 0;       ///< bytes of these frames that did not, and are flagged
  std::uint64_t misplaced = 0;  ///< bytes that are not those of their place in the recording
  std::uint64_t unflagged = 0;  ///< bytes that never came, in a chirp that is said to be whole or not in lost_bytes
  std::string problem;          ///< any other disagreement with the rule of assembly; empty where there is none
};

/// Scenario `seed`: two of three are one recording with loss, duplication, reordering (by a few packets, or by many),
/// truncation, a lost head and flushes; every third is two to four recordings one after the other, without a word from
/// outside, impaired or not. Bounds of the rule are told from the arrivals alone (ArrivalOracle).
AssemblyScenario runAssemblyScenario(std::uint64_t seed);

}  // namespace mmradartwin
