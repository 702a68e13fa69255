#include "mmradartwin_driver/pcap_capture.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <set>

#include "mmradartwin_driver/udp_socket.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// Longest hole that is filled with zeros: a damaged count must not fill the disk.
constexpr std::uint64_t kLongestHole_bytes = 64u << 20;

/// Holes that are so many times the samples are no losses: the counts are not those of one card's recordings.
constexpr std::uint64_t kMostHolesOfSamples = 16;

class CaptureOutput {
 public:
  CaptureOutput(const RadarConfig& radar, const std::string& pcap, const std::string& file)
      : radar_(radar), pcap_(pcap), file_(file), out_(file, std::ios::binary | std::ios::trunc) {
    if (!out_) {
      throw InputError(file + ": cannot be written (" + std::strerror(errno) + "); give a file in another folder");
    }
  }
  /// The previous frame is written once it is known not to be the last one.
  void take(AdcCube&& cube) {
    settle(false);
    if (new_recording_) {
      result.recordings.push_back(result.frames);
      // Without the recording's start in the file, the frames before the first packet are not known to be lost.
      const bool under_way = result.recordings.size() == 1 && !start_seen_;
      if (under_way) result.before_file = cube.sequence;
      expected_ = under_way ? cube.sequence : 0;
      new_recording_ = false;
    }
    const std::uint64_t missing = cube.sequence - std::min<std::uint64_t>(expected_, cube.sequence);
    if (missing * radar_.bytes_per_frame() > kLongestHole_bytes) {
      result.recordings.push_back(result.frames);
    } else {
      demandMoreSamplesThanHoles(missing);
      for (std::uint64_t i = 0; i < missing; ++i) leaveOut();
    }
    expected_ = cube.sequence + std::uint64_t{1};
    held_ = std::move(cube);
  }
  void seeStart() { start_seen_ = true; }
  /// Ends the recording to which everything so far belongs.
  void endRecording() {
    settle(true);
    new_recording_ = true;
  }
  void finish() {
    settle(true);
    out_.close();
    if (!out_) throw std::runtime_error(file_ + ": cannot be written to its end; check the free space");
  }

  PcapCapture result;

 private:
  void demandMoreSamplesThanHoles(std::uint64_t further_frames) {
    hole_frames_ += further_frames;
    const std::uint64_t whole = result.frames + further_frames - hole_frames_;
    if (hole_frames_ * radar_.bytes_per_frame() <= kLongestHole_bytes || hole_frames_ <= kMostHolesOfSamples * whole) {
      return;
    }
    throw InputError(pcap_ + ": the counts of its packets leave out " + std::to_string(hole_frames_) +
                     " frame(s) beside " + std::to_string(whole) +
                     " that have samples; it is damaged, or no recording of this radar");
  }
  void settle(bool last) {
    if (!held_) return;
    const AdcCube cube = std::move(*held_);
    held_.reset();
    // A recording may be stopped within a frame, whose rest then never arrives.
    if (last && !cube.chirp_valid.back()) {
      result.cut_off.push_back(radar_.bytes_per_frame() - cube.lost_bytes);
      return;
    }
    if (result.frames == 0) result.first_stamp_ns = cube.stamp_ns;
    if (cube.lost_bytes > 0) {
      CaptureFlaw flaw{result.frames, cube.lost_bytes, {}};
      for (std::size_t chirp = 0; chirp < cube.chirp_valid.size(); ++chirp) {
        if (!cube.chirp_valid[chirp]) flaw.chirps.push_back(static_cast<int>(chirp));
      }
      result.flaws.push_back(flaw);
    }
    write(encodeFrame(radar_, cube.data));
  }
  /// Appends a frame of zeros, which the file system need not store.
  void leaveOut() {
    CaptureFlaw flaw{result.frames, radar_.bytes_per_frame(), {}};
    for (int chirp = 0; chirp < radar_.chirps_per_frame(); ++chirp) flaw.chirps.push_back(chirp);
    result.flaws.push_back(flaw);
    out_.seekp(static_cast<std::streamoff>(radar_.bytes_per_frame()), std::ios::cur);
    ++result.frames;
  }
  void write(const std::vector<std::uint8_t>& bytes) {
    out_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    ++result.frames;
  }

  const RadarConfig& radar_;
  std::string pcap_, file_;
  std::ofstream out_;
  std::uint64_t hole_frames_ = 0;
  std::optional<AdcCube> held_;
  std::uint64_t expected_ = 0;
  bool new_recording_ = true, start_seen_ = false;
};

/// Counts packets that never came, by the numbers that the card gives them.
class LostPackets {
 public:
  void add(std::uint32_t sequence) {
    const std::int64_t ahead = next_ ? static_cast<std::int64_t>(sequence) - *next_ : 0;
    if (ahead >= 0 && ahead <= kMost) {
      if (static_cast<std::int64_t>(missing_.size()) + ahead > kMost) endRecording();  // these come no more
      for (std::int64_t i = 0; i < ahead; ++i) missing_.insert(missing_.end(), static_cast<std::uint32_t>(*next_ + i));
    } else if (-kMost <= ahead && ahead < 0 && sequence != 1) {
      missing_.erase(sequence);  // late, or a copy
      return;
    } else {
      endRecording();
    }
    next_ = sequence + std::int64_t{1};
  }
  /// The card was armed: its packets begin at 1.
  void begin() {
    endRecording();
    next_ = 1;
  }
  std::uint64_t total() const { return before_ + missing_.size(); }

 private:
  static constexpr std::int64_t kMost = kLongestHole_bytes / 1456;

  void endRecording() {
    before_ += missing_.size();
    missing_.clear();
  }

  std::optional<std::int64_t> next_;
  std::set<std::uint32_t> missing_;
  std::uint64_t before_ = 0;
};

}  // namespace

PcapCapture pcapToCapture(const std::string& pcap, const RadarConfig& radar, const std::string& output,
                          const PcapSource& source) {
  if (!source.card_ip.empty()) parseIpv4(source.card_ip);
  CaptureOutput out(radar, pcap, output);
  std::uint64_t epochs = 1;
  FrameAssembler* counted = nullptr;
  FrameAssembler assembler(radar, [&](AdcCube&& cube) {
    // The count restarted without a command in the file.
    if (counted->counters().epochs != epochs) {
      epochs = counted->counters().epochs;
      out.endRecording();
    }
    out.take(std::move(cube));
  });
  counted = &assembler;
  PcapVisitor visitor;
  LostPackets lost;
  visitor.data = [&](const DataPacket& packet) {
    lost.add(packet.sequence);
    assembler.add(packet);
  };
  visitor.reply = [&](const Dca1000Reply& reply, std::int64_t) {
    if (reply.code != static_cast<std::uint16_t>(Dca1000Command::kRecordStart)) return;
    out.seeStart();
    lost.begin();
    assembler.restart();
  };
  const PcapCounters counters = readPcap(pcap, visitor, source);
  assembler.flush();
  out.finish();
  out.result.counters = assembler.counters();
  out.result.lost_packets = lost.total();
  try {
    demandOneCard(pcap, counters, source, "--card-ip");
  } catch (const InputError&) {
    std::error_code error;
    if (std::filesystem::is_regular_file(output, error)) std::filesystem::remove(output, error);
    throw;
  }
  return std::move(out.result);
}

}  // namespace mmradartwin
