#pragma once

#include <cstdint>
#include <functional>
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

/// True for a file that is a capture of its own (another pose's).
using OtherCaptures = std::function<bool(const std::string& file)>;

/// The files that a capture consists of. TI's tools begin another file when one is full: X_Raw_0.bin is followed by
/// X_Raw_1.bin, X_Raw_2.bin and so on (also _RAW_), which hold the rest of one stream of bytes. With `others`, so is
/// X_0.bin by X_1.bin, unless one of these is a capture of its own. Throws InputError where one in between is missing.
std::vector<std::string> captureParts(const std::string& file, const OtherCaptures& others = {});

/// A capture that holds no whole number of frames.
class TruncatedCapture : public InputError {
 public:
  using InputError::InputError;
};

class CaptureStream;

/// A capture file, or all that captureParts() names, one after the other: frames back to back, their number from the
/// file's size. Heads of packets are taken out, and chirps of which bytes were lost are not valid. Reading is safe from
/// several threads.
class CaptureReader {
 public:
  enum class Rest { kRefused, kLeftOut };  ///< of bytes beyond the last whole frame
  /// Throws InputError: missing file, a file of another kind; TruncatedCapture: no whole frame or, where it is refused,
  /// a rest.
  CaptureReader(const RadarConfig& radar, const std::string& file, Rest rest = Rest::kRefused,
                const OtherCaptures& others = {});
  /// The capture begins so many bytes into a frame: that frame's first chirps are then not valid.
  void beginWithin(std::size_t bytes);
  /// Throws TruncatedCapture where bytes were left out; says how many whole frames there are.
  void requireWholeFrames() const;
  int frames() const;
  /// Frame i with stamp first_stamp_ns + i*frame_period; chirps valid whose bytes are there.
  AdcCube frame(int i, std::int64_t first_stamp_ns) const;
  /// Whole frames as raw bytes.
  std::vector<std::uint8_t> bytes(int i) const;
  /// What was recognised and read in another way than as it lies, one line each.
  const std::vector<std::string>& notes() const { return notes_; }
  bool plain() const;        ///< no heads, and it begins with a frame
  std::size_t size() const;  ///< bytes of samples
  /// Bytes of samples as they follow each other. Throws InputError.
  void read(std::size_t offset, std::size_t size, std::uint8_t* out) const;

 private:
  RadarConfig radar_;
  std::string file_;
  std::shared_ptr<const CaptureStream> stream_;
  std::vector<std::string> notes_;
  std::size_t missing_bytes_ = 0;  ///< of the first frame
  int frames_ = 0;                 ///< whole ones
};

/// Writes cubes back to back in the radar's layout; lost chirps are written as the zeros they hold.
void writeCapture(const RadarConfig& radar, const std::vector<AdcCube>& cubes, const std::string& file);

}  // namespace mmradartwin
