#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/cell_records.h"

namespace mmradartwin {

/// Noise that a simulated session gets where its twin has no `noise_floor`.
enum class SimulatedNoise {
  kThermal,  ///< of thermalNoise_db()
  kNone      ///< frames of a twin without mechanisms of frames are alike to the bit
};

/// Thermal noise of a complex sample of one receiver, rms against the amplitude of a path, dB: k T B F over the
/// transmitted power and the gain of both antennas. Those are typical of the AWR2243BOOST (data sheets: noise figure
/// 12 dB, 12 dBm, 10.5 dBi); B is the sample rate, T 290 K.
double thermalNoise_db(double sample_rate_hz);

struct SimulateOptions {
  std::string session;                                      ///< session directory; its captures are not needed
  std::string output;                                       ///< session directory to write
  std::string written_as;                                   ///< folder that becomes `output` at last; "" = output
  std::string twin_file;                                    ///< "" = the session's, or the base
  int frames = 1;                                           ///< per pose; alike but for mechanisms of frames
  std::uint64_t seed = 1;                                   ///< of the scatter points' phases
  SimulatedNoise noise = SimulatedNoise::kThermal;          ///< where the twin states none
  int jobs = 0;                                             ///< threads; 0 = all
  DiffuseRecords diffuse_records = DiffuseRecords::kCells;  ///< in paths/{pose}.csv
};

struct SimulateResult {
  int poses = 0;  ///< written
  double gain_db = 0;
  std::optional<double> noise_dbfs;                        ///< rms of a complex sample of the noise that was added
  double worst_amplitude_error = 0, worst_grid_error = 0;  ///< RecordCheck over all poses
  std::vector<std::string> notes;                          ///< what the user should know, a line each
  std::vector<PoseProblem> problems;                       ///< poses left out
};

/// Simulates all poses of a session and writes them as a session directory of its own: session.yaml with the gain_db
/// that puts the strongest max(|I|,|Q|) ahead of noise and converter at -6 dBFS (adc_saturation drives it higher),
/// radar.yaml, poses.csv, captures, twin.resolved.yaml (with the noise that was added) and
/// paths/{pose}.csv. Throws InputError where nothing can be simulated. `progress` is told poses done of poses in all,
/// from any thread.
SimulateResult simulateSession(const SimulateOptions& options, const std::function<void(int, int)>& progress = {});
/// Likewise, of the poses of any recording instead of options.session; what it was read from must outlive the call.
SimulateResult simulateRecording(const Recording& recording, const SimulateOptions& options,
                                 const std::function<void(int, int)>& progress = {});

}  // namespace mmradartwin
