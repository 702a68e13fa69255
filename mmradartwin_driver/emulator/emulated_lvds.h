#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "lvds_source.h"
#include "session_frames.h"

namespace mmradartwin {

/// What a radar sends over its lanes, by what it was configured with.
struct LvdsActivity {
  enum class Kind { kSilent, kFrames, kTestPattern };
  Kind kind = Kind::kSilent;
  int samples = 0, chirps = 0;  ///< per chirp, per frame
  std::int64_t period_ns = 0, chirp_ns = 0, sampled_ns = 0;
  double start_frequency_hz = 0, slope_hz_per_s = 0, sample_rate_hz = 0, adc_start_s = 0;
  bool q_first = false, lanes_reversed = false;

  /// Two synthetic targets instead of what the antennas see; y is boresight.
  bool test_source = false;
  struct Target {
    double position_m[3] = {}, velocity_m_per_s[3] = {}, level_dbfs = 0;
  };
  Target targets[2];
  double rx_position_wavelengths[4][2] = {};  ///< x, z

  /// Ramps: [rx][I, Q].
  struct Ramp {
    std::uint16_t start = 0, increment = 0;
  };
  Ramp ramps[4][2];
  std::int64_t pattern_packets = 0;  ///< 0: without end
};

/// Bytes of one frame of the test source that begins `elapsed_s` after the first, or of one packet of the test pattern.
std::vector<std::uint8_t> synthesiseLvds(const LvdsActivity& activity, double elapsed_s);

/// The lanes of an emulated radar that looks at a session: while its frames run, they are the session's, one after the
/// other, going on after a stop where they ended. Its test modes are synthesised.
class EmulatedLvds : public LvdsSource {
 public:
  struct Options {
    bool once = false;            ///< the radar ends with the session instead of beginning it anew
    bool lanes_reversed = false;  ///< wiring fault: lane k carries receiver 3 - k
    bool iq_swapped = false;      ///< wiring fault
  };
  using Log = std::function<void(const std::string&)>;
  /// `log` gets "frames run first_frame_ns=... frame=... period_ns=..." (of CLOCK_REALTIME, and which frame of the
  /// session comes first) and "frames stop frame=...".
  EmulatedLvds(const PlayedSession& session, const Options& options, Log log);

  /// The radar's doing from now on; its first frame begins 2 ms later.
  void set(const LvdsActivity& activity);
  /// Fault: the ribbon to the card is out. The radar's frames run on.
  void setRibbon(bool in);

  void connected() override;
  bool next(LvdsFrame& frame) override;
  bool over() const override;
  int lanes() const override { return 4; }

 private:
  void fill(LvdsFrame& frame);

  PlayedSession session_;
  SessionReader reader_;
  Options options_;
  Log log_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  LvdsActivity activity_;
  std::uint64_t run_ = 0;
  std::int64_t run_start_ns_ = 0, run_frame_ = 0, session_frame_ = 0;
  bool skip_ = false, over_ = false, ribbon_ = true;
};

}  // namespace mmradartwin
