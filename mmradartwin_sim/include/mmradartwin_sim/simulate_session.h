#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/cell_records.h"

namespace mmradartwin {

struct SimulateOptions {
  std::string session;                                      ///< session directory; its captures are not needed
  std::string output;                                       ///< session directory to write
  std::string twin_file;                                    ///< "" = the session's, or the base
  int frames = 1;                                           ///< per pose; alike but for mechanisms of frames
  std::uint64_t seed = 1;                                   ///< of the scatter points' phases
  int jobs = 0;                                             ///< threads; 0 = all
  DiffuseRecords diffuse_records = DiffuseRecords::kCells;  ///< in paths/{pose}.csv
};

struct SimulateResult {
  int poses = 0;  ///< written
  double gain_db = 0;
  double worst_amplitude_error = 0, worst_grid_error = 0;  ///< RecordCheck over all poses
  std::vector<std::string> notes;                          ///< what the user should know, a line each
  std::vector<PoseProblem> problems;                       ///< poses left out
};

/// Simulates all poses of a session and writes them as a session directory of its own: session.yaml with the gain_db
/// that puts the strongest max(|I|,|Q|) ahead of noise and converter at -6 dBFS (adc_saturation drives it higher),
/// radar.yaml, poses.csv, captures, twin.resolved.yaml and
/// paths/{pose}.csv. Throws InputError where nothing can be simulated. `progress` is told poses done of poses in all,
/// from any thread.
SimulateResult simulateSession(const SimulateOptions& options, const std::function<void(int, int)>& progress = {});

}  // namespace mmradartwin
