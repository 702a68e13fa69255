#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Bytes of one frame in the capture's layout -> cube samples. `bytes` holds radar.bytes_per_frame().
void decodeFrame(const RadarConfig& radar, const std::uint8_t* bytes, std::vector<std::int16_t>& samples);
/// The inverse of decodeFrame. Throws InputError where the number of samples is not the radar's.
std::vector<std::uint8_t> encodeFrame(const RadarConfig& radar, const std::vector<std::int16_t>& samples);

/// The files that a capture consists of. TI's tools begin another file when one is full: X_Raw_0.bin is followed by
/// X_Raw_1.bin, X_Raw_2.bin and so on (also _RAW_), which hold the rest of one stream of bytes. Throws InputError where
/// one in between is missing.
std::vector<std::string> captureParts(const std::string& file);

/// A capture that holds no whole number of frames.
class TruncatedCapture : public InputError {
 public:
  using InputError::InputError;
};

/// A capture file, or all that captureParts() names, one after the other: frames back to back, their number from the
/// file's size. Reading is safe from several threads.
class CaptureReader {
 public:
  enum class Rest { kRefused, kLeftOut };  ///< of bytes beyond the last whole frame
  /// Throws InputError: missing file; TruncatedCapture: no whole frame or, where it is refused, a rest.
  CaptureReader(const RadarConfig& radar, const std::string& file, Rest rest = Rest::kRefused);
  /// Throws TruncatedCapture where bytes were left out; says how many whole frames there are.
  void requireWholeFrames() const;
  int frames() const;
  /// Frame i with stamp first_stamp_ns + i*frame_period; all chirps valid.
  AdcCube frame(int i, std::int64_t first_stamp_ns) const;
  /// Whole frames as raw bytes.
  std::vector<std::uint8_t> bytes(int i) const;

 private:
  RadarConfig radar_;
  std::string file_;
  struct Part {
    std::shared_ptr<const int> descriptor;
    std::size_t begin, end;  ///< of its bytes in the capture
  };
  std::vector<Part> parts_;
  int frames_ = 0;  ///< whole ones
};

/// Writes cubes back to back in the radar's layout; lost chirps are written as the zeros they hold.
void writeCapture(const RadarConfig& radar, const std::vector<AdcCube>& cubes, const std::string& file);

}  // namespace mmradartwin
