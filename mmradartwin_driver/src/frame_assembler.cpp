#include "mmradartwin_driver/frame_assembler.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "mmradartwin_dsp/capture.h"

namespace mmradartwin {
namespace {

constexpr std::uint64_t kCountModulus = std::uint64_t{1} << 48;
constexpr std::size_t kRememberedPackets = 256;

bool sequenceAfter(std::uint32_t a, std::uint32_t b) { return static_cast<std::int32_t>(a - b) > 0; }

}  // namespace

FrameAssembler::FrameAssembler(const RadarConfig& radar, Output output)
    : FrameAssembler(radar, std::move(output), Options()) {}

FrameAssembler::FrameAssembler(const RadarConfig& radar, Output output, const Options& options)
    : radar_(radar),
      output_(std::move(output)),
      options_(options),
      frame_bytes_(radar.bytes_per_frame()),
      window_bytes_(std::max<std::uint64_t>(options.window_frames * frame_bytes_, options.window_bytes)),
      clock_(radar),
      recent_(kRememberedPackets) {
  // A frame is open until a byte beyond its end plus the window arrives, which bounds the number of open frames.
  slots_.resize(window_bytes_ / frame_bytes_ + 3);
  for (Slot& slot : slots_) slot.bytes.resize(frame_bytes_);
}

void FrameAssembler::add(const DataPacket& packet) {
  ++counters_.packets;
  const bool after_quiet = begun_ && packet.stamp_ns - newest_stamp_ns_ > options_.reorder_ns;
  if (after_quiet && packet.sequence == 1 && packet.byte_count == 0) {
    suspect(packet, false);
    return acceptSuspects();
  }
  // While a restart is suspected, a packet that continues it belongs to it, even where it would fit the old count as
  // well.
  if (!suspects_.empty() && !suspects_.front().ahead && continuesSuspects(packet)) return suspect(packet, false);
  const std::uint64_t offset = absoluteOffset(packet.byte_count);
  switch (fit(packet, offset)) {
    case Fit::kPlace:
      rejectSuspects();
      place(packet, offset);
      break;
    case Fit::kDuplicate:
      ++counters_.duplicate_packets;
      break;
    case Fit::kBehind:
      // A reordered packet arrives soon after the one that it should precede, a restart does not.
      if (after_quiet) {
        suspect(packet, false);
      } else {
        ++counters_.late_packets;
      }
      break;
    case Fit::kAhead:
      suspect(packet, true);
      break;
  }
}

/// The 48-bit count extended to 64 bits near the newest byte.
std::uint64_t FrameAssembler::absoluteOffset(std::uint64_t byte_count) const {
  const std::uint64_t ahead = (byte_count - next_byte_) % kCountModulus;
  if (ahead <= options_.plausible_gap_bytes) return next_byte_ + ahead;
  const std::uint64_t behind = kCountModulus - ahead;
  return behind <= next_byte_ && behind <= kCountModulus / 2 ? next_byte_ - behind : byte_count;
}

FrameAssembler::Fit FrameAssembler::fit(const DataPacket& packet, std::uint64_t offset) const {
  if (offset >= next_byte_) {
    if (offset - next_byte_ > options_.plausible_gap_bytes) return Fit::kAhead;
    // The sequence number must rise with the count, else the two belong to different recordings.
    if (begun_ && !sequenceAfter(packet.sequence, newest_sequence_)) return Fit::kBehind;
    return Fit::kPlace;
  }
  if (packet.stamp_ns - newest_stamp_ns_ > options_.reorder_ns) return Fit::kBehind;
  if (const Fingerprint* copy = findCopy(packet)) {
    return packet.size <= copy->size ? Fit::kDuplicate : Fit::kPlace;  // longer: the first copy was truncated
  }
  if (offset + packet.size <= base_frame_ * frame_bytes_) return Fit::kBehind;
  if (overlapsReceived(offset, packet.size)) return Fit::kBehind;
  return Fit::kPlace;
}

bool FrameAssembler::overlapsReceived(std::uint64_t offset, std::size_t size) const {
  const std::uint64_t end = offset + size;
  for (std::uint64_t frame = std::max(offset / frame_bytes_, base_frame_); frame * frame_bytes_ < end; ++frame) {
    if (frame >= base_frame_ + slots_.size()) break;
    const Slot& slot = slots_[frame % slots_.size()];
    if (!slot.begun) continue;
    const std::uint64_t start = frame * frame_bytes_;
    for (const Interval& have : slot.received) {
      if (start + have.begin < end && offset < start + have.end) return true;
    }
  }
  return false;
}

const FrameAssembler::Fingerprint* FrameAssembler::findCopy(const DataPacket& packet) const {
  for (const Fingerprint& known : recent_) {
    if (known.size == 0 || known.sequence != packet.sequence || known.byte_count != packet.byte_count) continue;
    const std::size_t compared = std::min({known.size, packet.size, known.head.size()});
    if (std::memcmp(known.head.data(), packet.payload, compared) == 0) return &known;
  }
  return nullptr;
}

void FrameAssembler::remember(const DataPacket& packet) {
  Fingerprint& entry = recent_[recent_next_];
  recent_next_ = (recent_next_ + 1) % recent_.size();
  entry.sequence = packet.sequence;
  entry.byte_count = packet.byte_count;
  entry.size = packet.size;
  std::memcpy(entry.head.data(), packet.payload, std::min(packet.size, entry.head.size()));
}

/// True where a packet is near the held packets in count and sequence. A packet that goes back after a pause does not
/// continue them, but is the next restart.
bool FrameAssembler::continuesSuspects(const DataPacket& packet) const {
  constexpr std::uint64_t kNear = 64 * 1472;
  const Suspect& last = suspects_.back();
  const bool forward = packet.byte_count >= last.byte_count;
  const std::uint64_t distance = forward ? packet.byte_count - last.byte_count : last.byte_count - packet.byte_count;
  if (distance > window_bytes_ + kNear) return false;
  if (packet.sequence == last.sequence) return distance == 0;
  return forward == sequenceAfter(packet.sequence, last.sequence) &&
         (forward || packet.stamp_ns - last.stamp_ns <= options_.reorder_ns);
}

void FrameAssembler::suspect(const DataPacket& packet, bool ahead) {
  if (!suspects_.empty() && (suspects_.front().ahead != ahead || !continuesSuspects(packet))) rejectSuspects();
  for (Suspect& known : suspects_) {
    if (known.sequence != packet.sequence || known.byte_count != packet.byte_count) continue;
    ++counters_.duplicate_packets;
    if (known.payload.size() < packet.size) known.payload.assign(packet.payload, packet.payload + packet.size);
    return;
  }
  suspects_.push_back({packet.sequence, packet.byte_count, packet.stamp_ns, ahead,
                       std::vector<std::uint8_t>(packet.payload, packet.payload + packet.size)});
  if (static_cast<int>(suspects_.size()) >= options_.confirm_packets) acceptSuspects();
}

void FrameAssembler::rejectSuspects() {
  counters_.rejected_packets += suspects_.size();
  suspects_.clear();
}

void FrameAssembler::acceptSuspects() {
  std::vector<Suspect> accepted;
  accepted.swap(suspects_);
  if (accepted.empty()) return;
  std::stable_sort(accepted.begin(), accepted.end(),
                   [](const Suspect& a, const Suspect& b) { return sequenceAfter(b.sequence, a.sequence); });
  const std::uint64_t first_count = accepted.front().byte_count;
  std::uint64_t first_offset = first_count;
  if (accepted.front().ahead) {
    first_offset = next_byte_ + (first_count - next_byte_) % kCountModulus;
  } else {
    closeBefore(base_frame_ + slots_.size());
    beginEpoch();
    ++counters_.epochs;
  }
  for (const Suspect& packet : accepted) {
    const DataPacket view{packet.sequence, packet.byte_count, packet.payload.data(), packet.payload.size(),
                          packet.stamp_ns};
    // Counts that go back among them are late or overlap; they are not a whole 48-bit count ahead.
    const std::uint64_t apart = (packet.byte_count - first_count) % kCountModulus;
    const bool behind = apart > kCountModulus / 2 && kCountModulus - apart <= first_offset;
    place(view, behind ? first_offset - (kCountModulus - apart) : first_offset + apart);
  }
}

void FrameAssembler::place(const DataPacket& packet, std::uint64_t offset) {
  remember(packet);
  const std::uint64_t packet_end = offset + packet.size;
  if (begun_ && offset < next_byte_) ++counters_.reordered_packets;
  // The card sends a packet as soon as it is full. A shorter one is the rest of a recording, sent seconds later.
  longest_payload_ = std::max(longest_payload_, packet.size);
  const bool full = packet.size == longest_payload_;
  if (!begun_ || packet_end > next_byte_) {
    newest_sequence_ = packet.sequence;
    newest_stamp_ns_ = packet.stamp_ns;
  }
  begun_ = true;

  const std::uint8_t* from = packet.payload;
  bool late = false;
  while (offset < packet_end) {
    const std::uint64_t frame = offset / frame_bytes_;
    const std::size_t begin = offset % frame_bytes_;
    const std::size_t size = std::min<std::uint64_t>(frame_bytes_ - begin, packet_end - offset);
    next_byte_ = std::max(next_byte_, offset + size);
    if (next_byte_ > window_bytes_) closeBefore((next_byte_ - window_bytes_) / frame_bytes_);
    if (frame < base_frame_) {
      late = true;
    } else {
      Slot& target = slot(frame);
      if (!target.begun) {
        target.begun = true;
        target.received.clear();
        target.received_bytes = 0;
        target.observed_start_ns.reset();
        target.rough_start_ns = clock_.startFromPacket(frame, packet_end - 1, packet.stamp_ns);
      }
      if (begin == 0 && full) {
        target.observed_start_ns = clock_.startFromPacket(frame, packet_end - 1, packet.stamp_ns);
      }
      const std::size_t copied = copyMissing(target, begin, from, size);
      target.received_bytes += copied;
      counters_.bytes += copied;
      if (frame == base_frame_) handOutComplete();
    }
    offset += size;
    from += size;
  }
  if (late) ++counters_.late_packets;
}

/// Copies the bytes of [begin, begin + size) that are missing yet. Returns their number.
std::size_t FrameAssembler::copyMissing(Slot& slot, std::size_t begin, const std::uint8_t* from, std::size_t size) {
  std::vector<Interval>& have = slot.received;
  const std::size_t end = begin + size;
  if (have.empty() || begin >= have.back().end) {  // in order, which is almost always the case
    std::memcpy(slot.bytes.data() + begin, from, size);
    if (!have.empty() && have.back().end == begin) {
      have.back().end = end;
    } else {
      have.push_back({begin, end});
    }
    return size;
  }
  std::size_t copied = 0, position = begin;
  for (const Interval& interval : have) {
    if (interval.end <= position) continue;
    if (interval.begin >= end) break;
    if (interval.begin > position) {
      std::memcpy(slot.bytes.data() + position, from + (position - begin), interval.begin - position);
      copied += interval.begin - position;
    }
    position = std::max(position, interval.end);
  }
  if (position < end) {
    std::memcpy(slot.bytes.data() + position, from + (position - begin), end - position);
    copied += end - position;
  }
  std::vector<Interval> merged;
  Interval added{begin, end};
  bool inserted = false;
  for (const Interval& interval : have) {
    if (interval.end < added.begin) {
      merged.push_back(interval);
    } else if (interval.begin > added.end) {
      if (!std::exchange(inserted, true)) merged.push_back(added);
      merged.push_back(interval);
    } else {
      added = {std::min(added.begin, interval.begin), std::max(added.end, interval.end)};
    }
  }
  if (!inserted) merged.push_back(added);
  have = std::move(merged);
  return copied;
}

void FrameAssembler::closeBefore(std::uint64_t frame) {
  if (frame <= base_frame_) return;
  const std::uint64_t last_open = std::min<std::uint64_t>(frame, base_frame_ + slots_.size());
  for (std::uint64_t f = base_frame_; f < last_open; ++f) {
    if (slot(f).begun) {
      handOut(f);
    } else if ((f + 1) * frame_bytes_ <= next_byte_) {
      ++counters_.missing_frames;
      counters_.lost_bytes += frame_bytes_;
    }
  }
  if (frame > last_open) {
    counters_.missing_frames += frame - last_open;
    counters_.lost_bytes += (frame - last_open) * frame_bytes_;
  }
  base_frame_ = frame;
  handOutComplete();
}

void FrameAssembler::handOutComplete() {
  while (slot(base_frame_).begun && slot(base_frame_).received_bytes == frame_bytes_) handOut(base_frame_++);
}

void FrameAssembler::handOut(std::uint64_t frame) {
  Slot& done = slot(frame);
  done.begun = false;
  AdcCube cube;
  cube.sequence = static_cast<std::uint32_t>(frame);
  cube.chirps = radar_.chirps_per_frame();
  cube.samples = radar_.samples_per_chirp;
  cube.receivers = radar_.receivers();
  cube.lost_bytes = frame_bytes_ - done.received_bytes;
  cube.chirp_valid.assign(cube.chirps, 1);

  if (done.observed_start_ns) {
    cube.stamp_ns = clock_.observe(frame, *done.observed_start_ns);
  } else {
    cube.stamp_ns = clock_.predict(frame).value_or(done.rough_start_ns);
  }

  if (cube.lost_bytes > 0) {
    const std::size_t chirp_bytes = frame_bytes_ / cube.chirps;
    std::size_t position = 0;
    const auto loseUntil = [&](std::size_t end) {
      if (position >= end) return;
      // Half a word is no sample: the hole is extended to whole words.
      const std::size_t from = position & ~std::size_t{1},
                        to = std::min<std::size_t>((end + 1) & ~std::size_t{1}, frame_bytes_);
      std::memset(done.bytes.data() + from, 0, to - from);
      for (std::size_t chirp = position / chirp_bytes; chirp <= (end - 1) / chirp_bytes; ++chirp) {
        cube.chirp_valid[chirp] = 0;
      }
    };
    for (const Interval& interval : done.received) {
      loseUntil(interval.begin);
      position = interval.end;
    }
    loseUntil(frame_bytes_);
    ++counters_.incomplete_frames;
    counters_.lost_bytes += cube.lost_bytes;
  }
  decodeFrame(radar_, done.bytes.data(), cube.data);
  ++counters_.frames;
  output_(std::move(cube));
}

void FrameAssembler::flush() {
  rejectSuspects();
  closeBefore((next_byte_ + frame_bytes_ - 1) / frame_bytes_);
}

void FrameAssembler::restart() {
  flush();
  beginEpoch();
  ++counters_.epochs;
}

void FrameAssembler::beginEpoch() {
  for (Slot& slot : slots_) slot.begun = false;
  base_frame_ = 0;
  next_byte_ = 0;
  begun_ = false;
  newest_sequence_ = 0;
  newest_stamp_ns_ = 0;
  longest_payload_ = 0;
  suspects_.clear();
  for (Fingerprint& entry : recent_) entry.size = 0;
  clock_.reset();
}

}  // namespace mmradartwin
