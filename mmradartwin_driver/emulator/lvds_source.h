#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mmradartwin {

/// A frame as it comes over the LVDS lanes.
struct LvdsFrame {
  std::int64_t start_ns = 0;    ///< CLOCK_MONOTONIC
  std::int64_t number = 0;      ///< of the session that is played
  int chirps = 1;               ///< of equal size
  std::int64_t chirp_ns = 0;    ///< from chirp to chirp
  std::int64_t sampled_ns = 0;  ///< from a chirp's start to its last sample
  std::vector<std::uint8_t> bytes;
};

/// The radar on the other side of an emulated card's LVDS ribbon. Called from the card's threads.
class LvdsSource {
 public:
  virtual ~LvdsSource() = default;
  /// The card has power: what the lanes carried until now went nowhere.
  virtual void connected() {}
  /// RECORD_START.
  virtual void armed() {}
  /// Waits some 20 ms for a frame to begin. False where none did.
  virtual bool next(LvdsFrame& frame) = 0;
  /// Nothing will come any more.
  virtual bool over() const { return false; }
  virtual int lanes() const = 0;
};

}  // namespace mmradartwin
