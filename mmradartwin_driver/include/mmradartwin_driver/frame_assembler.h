#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_driver/frame_clock.h"
#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Puts the payload of data packets together to frames, each byte at its absolute offset in the recording: byte b
/// belongs to frame b / bytes_per_frame. A byte that never arrives is zero in the cube, counted in lost_bytes, and its
/// chirp is not valid; the other half of a 16-bit word that was torn goes with it. Packets may have any length, span
/// any number of frames and come late, twice, cut short or not at all.
///
/// Frames are handed out in order: a complete one at once, one with holes as soon as data arrive that lie further than
/// the reorder window behind its end, or at flush(). That window is `window_packets` of the longest; a smaller one,
/// `window_frames` and `window_bytes`, is enough where `reorder_ns` have passed since the frame's end. Frames of which
/// not a single byte came are left out (a gap in the sequence). Bytes for frames already handed out are counted as late
/// and dropped.
///
/// Nothing but the Ethernet checksum protects a packet's header, so sequence and count are held against each other:
/// from one packet to the next in the sequence the count grows by the payload, and by the longest payload for each
/// packet that is missing. A recording in which a short packet is followed at once shows that its packets vary in
/// length; there the count must grow by 1 byte at least and 1462 at most for each. A packet that does not fit is held
/// back as suspect, and so are one more than 64 packets ahead and the first of a recording, unless that is sequence 1
/// at byte 0: it may be of the recording before. Suspects are placed when `confirm_packets` of them, each at most as
/// many behind another, fit each other; a packet that fits what is placed rejects them. What is rejected is missing at
/// its true place, and flagged there as lost. Where lengths vary, a packet that fits roughly and is contradicted by
/// four that follow is taken out again; two wrong headers within these may go unnoticed.
///
/// A packet that goes back in the count more than `reorder_ns` after the newest one is no reordered one. If it is the
/// first of a recording, or suspects that begin with it are confirmed, then the count has been restarted: that ends all
/// open frames, and a new epoch begins with frame 0. So it is where the sequence goes back behind suspects that came as
/// long before, and where suspects that came so long after the newest packet do not fit it. A restart whose first
/// packets are lost and that lands ahead of the old count, as a continuation would, cannot be told from loss; arming
/// through restart() leaves no such doubt.
class FrameAssembler {
 public:
  struct Options {
    int window_frames = 2;                          ///< at least
    std::size_t window_bytes = 4 * 1472;            ///< at least
    int window_packets = 64;                        ///< for what comes within reorder_ns
    std::uint64_t plausible_gap_bytes = 64u << 20;  ///< ahead of the newest byte
    std::int64_t reorder_ns = 20'000'000;           ///< what comes later than this was not reordered
    int confirm_packets = 4;
  };
  struct Counters {
    std::uint64_t packets = 0;
    std::uint64_t bytes = 0;       ///< placed in frames
    std::uint64_t lost_bytes = 0;  ///< in finished frames, those never received included
    std::uint64_t duplicate_packets = 0;
    std::uint64_t late_packets = 0;       ///< entirely or partly for frames already handed out
    std::uint64_t reordered_packets = 0;  ///< behind the newest byte, but in time
    std::uint64_t rejected_packets = 0;   ///< sequence or count did not fit, and no later packets bore them out
    std::uint64_t frames = 0;             ///< handed out
    std::uint64_t incomplete_frames = 0;  ///< of these
    std::uint64_t missing_frames = 0;     ///< without any byte before later data
    std::uint64_t epochs = 1;             ///< restarts + 1
  };
  using Output = std::function<void(AdcCube&&)>;

  FrameAssembler(const RadarConfig& radar, Output output);  ///< with default options
  FrameAssembler(const RadarConfig& radar, Output output, const Options& options);

  void add(const DataPacket& packet);
  /// Hands out all frames that have begun. Packets may follow; those for frames handed out here are late.
  void flush();
  /// Begins a new recording, after the card was armed: open frames end, and the next packet counts from byte 0 and
  /// frame 0.
  void restart();

  const Counters& counters() const { return counters_; }
  /// True where data of a frame have arrived that has not been handed out.
  bool open() const { return next_byte_ > base_frame_ * frame_bytes_ || !suspects_.empty(); }

 private:
  struct Interval {
    std::size_t begin, end;
  };
  struct Slot {
    bool begun = false;
    std::vector<std::uint8_t> bytes;
    std::vector<Interval> received;  ///< sorted, disjoint, not touching
    std::size_t received_bytes = 0;
    std::optional<std::int64_t> observed_start_ns;  ///< from the packet with the frame's first byte
    std::int64_t rough_start_ns = 0;                ///< from the first packet with any byte of the frame
    std::int64_t passed_ns = 0;                     ///< when data beyond the frame's end first came
  };
  /// What a packet's header says, and how long its payload is.
  struct Header {
    std::uint32_t sequence = 0;
    std::uint64_t byte_count = 0;
    std::size_t size = 0;
  };
  struct Suspect {
    Header header;
    std::int64_t stamp_ns;
    bool behind;  ///< of a restarted count, maybe
    std::vector<std::uint8_t> payload;
  };
  /// Properties of a packet by which a copy of it is recognised.
  struct Fingerprint {
    std::uint32_t sequence = 0;
    std::uint64_t byte_count = 0;
    std::size_t size = 0;  ///< 0: none
    std::array<std::uint8_t, 64> head{};
  };
  enum class Fit { kPlace, kDuplicate, kBehind, kImplausible };

  Slot& slot(std::uint64_t frame) { return slots_[frame % slots_.size()]; }
  std::uint64_t absoluteOffset(std::uint64_t byte_count) const;
  Fit fit(const DataPacket& packet, std::uint64_t offset) const;
  bool overlapsReceived(std::uint64_t offset, std::size_t size) const;
  const Fingerprint* findCopy(const DataPacket& packet) const;
  static Header headerOf(const DataPacket& packet);
  bool follows(const Header& before, const Header& after) const;
  bool fitsExactly(const Header& a, const Header& b) const;
  bool fitsOtherLength(const Header& a, const Header& b) const;
  bool fitsNewest(const Header& header) const;
  bool fitsRoughly(const Header& a, const Header& b) const;
  bool linked(const Suspect& suspect, const Header& header) const;
  int laterSuspects(const DataPacket& packet) const;
  void suspect(const DataPacket& packet, bool behind);
  std::vector<Suspect> confirmedWith(const Header& header) const;
  bool followsRestart(const Header& first) const;
  void rejectSuspects();
  void accept(std::vector<Suspect> accepted);
  std::uint64_t beginOf(const Suspect& first);
  void distrustNewest();
  void advanceNewest(const DataPacket& packet, bool sure);
  void place(const DataPacket& packet, std::uint64_t offset);
  void remember(const DataPacket& packet);
  std::size_t copyMissing(Slot& slot, std::size_t begin, const std::uint8_t* from, std::size_t size);
  void closeBefore(std::uint64_t frame);
  void passEnds(std::uint64_t from, std::int64_t stamp_ns);
  void handOut(std::uint64_t frame);
  void handOutComplete();
  void beginEpoch();

  RadarConfig radar_;
  Output output_;
  Options options_;
  std::uint64_t frame_bytes_, window_bytes_, far_window_bytes_;
  FrameClock clock_;
  Counters counters_;

  std::vector<Slot> slots_;
  std::uint64_t base_frame_ = 0;  ///< first one not handed out
  std::uint64_t next_byte_ = 0;   ///< end of the data seen in this epoch
  bool begun_ = false;            ///< a packet of this epoch has been placed
  Header newest_;
  std::int64_t newest_stamp_ns_ = 0;
  bool newest_sure_ = false;    ///< it fits its predecessor exactly
  bool newest_rested_ = false;  ///< it came long after its predecessor: the rest of a recording, sent when that ended
  bool lengths_vary_ = false;
  std::size_t longest_payload_ = 0;
  std::vector<Suspect> suspects_;
  std::vector<Fingerprint> recent_;
  std::size_t recent_next_ = 0;
};

}  // namespace mmradartwin
