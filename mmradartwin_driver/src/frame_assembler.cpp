#include "mmradartwin_driver/frame_assembler.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "mmradartwin_dsp/capture.h"

namespace mmradartwin {
namespace {

constexpr std::uint64_t kCountModulus = std::uint64_t{1} << 48;
constexpr std::size_t kRememberedPackets = 256;

constexpr std::size_t kLongestPayload = 1462;  // of a card's packet on Ethernet
constexpr std::size_t kMostSuspects = 16;
/// What is further ahead in the sequence has to be confirmed.
constexpr std::uint32_t kNearPackets = 64;
/// The card sends what is left of a recording 2 s after its last sample.
constexpr std::int64_t kRest_ns = 1'000'000'000;

bool sequenceAfter(std::uint32_t a, std::uint32_t b) { return static_cast<std::int32_t>(a - b) > 0; }

std::uint32_t sequenceDistance(std::uint32_t a, std::uint32_t b) { return sequenceAfter(a, b) ? a - b : b - a; }

}  // namespace

FrameAssembler::FrameAssembler(const RadarConfig& radar, Output output)
    : FrameAssembler(radar, std::move(output), Options()) {}

FrameAssembler::FrameAssembler(const RadarConfig& radar, Output output, const Options& options)
    : radar_(radar),
      output_(std::move(output)),
      options_(options),
      frame_bytes_(radar.bytes_per_frame()),
      window_bytes_(std::max<std::uint64_t>(options.window_frames * frame_bytes_, options.window_bytes)),
      far_window_bytes_(
          std::max<std::uint64_t>(window_bytes_, options.window_packets * std::uint64_t{kLongestPayload})),
      clock_(radar),
      recent_(kRememberedPackets) {
  // A frame is open until a byte beyond its end plus the window arrives, which bounds the number of open frames.
  slots_.resize(far_window_bytes_ / frame_bytes_ + 3);
  for (Slot& slot : slots_) slot.bytes.resize(frame_bytes_);
}

void FrameAssembler::add(const DataPacket& packet) {
  ++counters_.packets;
  const bool after_quiet = begun_ && packet.stamp_ns - newest_stamp_ns_ > options_.reorder_ns;
  const Header header = headerOf(packet);
  if (after_quiet && packet.sequence == 1 && packet.byte_count == 0) {
    rejectSuspects();
    return accept({{header, packet.stamp_ns, true, {packet.payload, packet.payload + packet.size}}});
  }
  // While a restart is suspected, a packet that continues it belongs to it, even where it would fit the old count as
  // well. So it is with one that continues what contradicts a newest packet of which nothing says that it is right.
  const bool newest_in_doubt = begun_ && !newest_sure_ && !fitsExactly(newest_, header);
  const auto continued = std::find_if(suspects_.begin(), suspects_.end(), [&](const Suspect& s) {
    return (s.behind || newest_in_doubt) && linked(s, header);
  });
  if (continued != suspects_.end()) return suspect(packet, continued->behind);
  const std::uint64_t offset = absoluteOffset(packet.byte_count);
  switch (fit(packet, offset)) {
    case Fit::kPlace:
      if (after_quiet && laterSuspects(packet) > 1) return suspect(packet, true);
      rejectSuspects();
      place(packet, offset);
      break;
    case Fit::kDuplicate:
      ++counters_.duplicate_packets;
      break;
    case Fit::kBehind:
      // A reordered packet arrives soon after the one that it should precede, a restart does not.
      if (after_quiet) {
        suspect(packet, true);
      } else {
        ++counters_.late_packets;
      }
      break;
    case Fit::kImplausible:
      suspect(packet, after_quiet && (offset < next_byte_ || laterSuspects(packet) > 0));
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

FrameAssembler::Header FrameAssembler::headerOf(const DataPacket& packet) {
  return {packet.sequence, packet.byte_count, packet.size};
}

/// True where sequence and count of `after`, the later one in the sequence, go on from `before` without a
/// contradiction: packets between them, and `before` too if it was cut short, are as long as the longest.
bool FrameAssembler::follows(const Header& before, const Header& after) const {
  const std::uint64_t packets = after.sequence - before.sequence;
  const std::uint64_t grown = (after.byte_count - before.byte_count) % kCountModulus;
  const std::uint64_t longest = std::max({longest_payload_, before.size, after.size});
  return grown == packets * longest || grown == before.size + (packets - 1) * longest;
}

/// As fitsExactly() of a recording whose packets are as long as the longer one of the two, whatever came before.
bool FrameAssembler::fitsOtherLength(const Header& a, const Header& b) const {
  if (a.sequence == b.sequence) return false;
  const bool forward = sequenceAfter(b.sequence, a.sequence);
  const Header &before = forward ? a : b, &after = forward ? b : a;
  const std::uint64_t packets = after.sequence - before.sequence;
  return (after.byte_count - before.byte_count) % kCountModulus == packets * std::max(before.size, after.size);
}

bool FrameAssembler::fitsExactly(const Header& a, const Header& b) const {
  if (a.sequence == b.sequence) return a.byte_count == b.byte_count;
  return sequenceAfter(b.sequence, a.sequence) ? follows(a, b) : follows(b, a);
}

/// The same where the lengths of packets between the two are unknown.
bool FrameAssembler::fitsRoughly(const Header& a, const Header& b) const {
  if (a.sequence == b.sequence) return a.byte_count == b.byte_count;
  const bool forward = sequenceAfter(b.sequence, a.sequence);
  const Header &before = forward ? a : b, &after = forward ? b : a;
  const std::uint64_t packets = after.sequence - before.sequence;
  const std::uint64_t grown = (after.byte_count - before.byte_count) % kCountModulus;
  return grown >= before.size + (packets - 1) && grown <= packets * std::max(longest_payload_, kLongestPayload);
}

bool FrameAssembler::fitsNewest(const Header& header) const {
  return fitsExactly(newest_, header) || (lengths_vary_ && fitsRoughly(newest_, header));
}

FrameAssembler::Fit FrameAssembler::fit(const DataPacket& packet, std::uint64_t offset) const {
  const Header header = headerOf(packet);
  if (!begun_) return packet.sequence == 1 && packet.byte_count == 0 ? Fit::kPlace : Fit::kImplausible;
  const bool fits = fitsNewest(header);
  if (offset >= next_byte_) {
    if (offset - next_byte_ > options_.plausible_gap_bytes) return Fit::kImplausible;
    // The sequence number must rise with the count, else the two belong to different recordings.
    if (!sequenceAfter(packet.sequence, newest_.sequence)) return Fit::kBehind;
    const bool near = packet.sequence - newest_.sequence <= kNearPackets;
    return fits && near ? Fit::kPlace : Fit::kImplausible;
  }
  if (sequenceAfter(packet.sequence, newest_.sequence)) return Fit::kImplausible;
  if (packet.stamp_ns - newest_stamp_ns_ > options_.reorder_ns) return Fit::kBehind;
  if (const Fingerprint* copy = findCopy(packet)) {
    return packet.size <= copy->size ? Fit::kDuplicate : Fit::kPlace;  // longer: the first copy was truncated
  }
  if (offset + packet.size <= base_frame_ * frame_bytes_) return Fit::kBehind;
  if (!fits) return Fit::kImplausible;
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

/// True where a packet belongs to the recording of a suspect: it fits exactly, and is not far away.
bool FrameAssembler::linked(const Suspect& suspect, const Header& header) const {
  return sequenceDistance(suspect.header.sequence, header.sequence) <=
             static_cast<std::uint32_t>(options_.confirm_packets) &&
         (fitsExactly(suspect.header, header) || fitsOtherLength(suspect.header, header));
}

/// Suspects that came long before the packet and are no earlier in the sequence: in one recording it does not go back.
int FrameAssembler::laterSuspects(const DataPacket& packet) const {
  return static_cast<int>(std::count_if(suspects_.begin(), suspects_.end(), [&](const Suspect& s) {
    return packet.stamp_ns - s.stamp_ns > options_.reorder_ns && !sequenceAfter(packet.sequence, s.header.sequence);
  }));
}

void FrameAssembler::suspect(const DataPacket& packet, bool behind) {
  const Header header = headerOf(packet);
  for (Suspect& known : suspects_) {
    if (known.header.sequence != header.sequence || known.header.byte_count != header.byte_count) continue;
    if (std::memcmp(known.payload.data(), packet.payload, std::min(known.payload.size(), packet.size)) != 0) {
      rejectSuspects();  // the same place of another recording, as a later start has it
      break;
    }
    ++counters_.duplicate_packets;
    if (known.payload.size() < packet.size) {
      known.payload.assign(packet.payload, packet.payload + packet.size);
      known.header.size = packet.size;
    }
    return;
  }
  if (suspects_.size() == kMostSuspects) {
    suspects_.erase(suspects_.begin());
    ++counters_.rejected_packets;
  }
  suspects_.push_back({header, packet.stamp_ns, behind, {packet.payload, packet.payload + packet.size}});
  std::vector<Suspect> confirmed = confirmedWith(header);
  if (static_cast<int>(confirmed.size()) < options_.confirm_packets) return;
  Suspect& first = confirmed.front();
  first.behind = first.behind || followsRestart(first.header);
  counters_.rejected_packets += suspects_.size() - confirmed.size();
  suspects_.clear();
  accept(std::move(confirmed));
}

/// The suspects that are linked with `header`, directly or by others, in their sequence. What came before the first one
/// of them is of no use: it may be of the recording before.
std::vector<FrameAssembler::Suspect> FrameAssembler::confirmedWith(const Header& header) const {
  std::vector<bool> in(suspects_.size());
  std::vector<Header> frontier{header};
  while (!frontier.empty()) {
    const Header from = frontier.back();
    frontier.pop_back();
    for (std::size_t i = 0; i < suspects_.size(); ++i) {
      if (in[i] || !linked(suspects_[i], from)) continue;
      in[i] = true;
      frontier.push_back(suspects_[i].header);
    }
  }
  std::size_t first = suspects_.size();
  for (std::size_t i = 0; i < suspects_.size(); ++i) {
    if (!in[i]) continue;
    if (first == suspects_.size() || sequenceAfter(suspects_[first].header.sequence, suspects_[i].header.sequence)) {
      first = i;
    }
  }
  std::vector<Suspect> confirmed;
  for (std::size_t i = first; i < suspects_.size(); ++i) {
    if (in[i]) confirmed.push_back(suspects_[i]);
  }
  std::stable_sort(confirmed.begin(), confirmed.end(), [](const Suspect& a, const Suspect& b) {
    return sequenceAfter(b.header.sequence, a.header.sequence);
  });
  return confirmed;
}

/// True where a packet of a restarted count came shortly before `first`, parted from it by lost ones of unknown length.
bool FrameAssembler::followsRestart(const Header& first) const {
  return std::any_of(suspects_.begin(), suspects_.end(), [&](const Suspect& s) {
    return s.behind && sequenceAfter(first.sequence, s.header.sequence) &&
           first.sequence - s.header.sequence <= kNearPackets && fitsRoughly(s.header, first);
  });
}

void FrameAssembler::rejectSuspects() {
  counters_.rejected_packets += suspects_.size();
  suspects_.clear();
}

/// Places packets that fit each other, in their sequence.
void FrameAssembler::accept(std::vector<Suspect> accepted) {
  const std::uint64_t first_count = accepted.front().header.byte_count;
  const std::uint64_t first_offset = beginOf(accepted.front());
  for (const Suspect& packet : accepted) {
    const std::uint64_t further = (packet.header.byte_count - first_count) % kCountModulus;
    if (further > kCountModulus / 2) {  // two of one sequence number, at two counts
      ++counters_.rejected_packets;
      continue;
    }
    const DataPacket view{packet.header.sequence, packet.header.byte_count, packet.payload.data(),
                          packet.payload.size(), packet.stamp_ns};
    place(view, first_offset + further);
  }
}

/// Where the first of confirmed suspects lies; begins an epoch where they are of another recording.
std::uint64_t FrameAssembler::beginOf(const Suspect& first) {
  const std::uint64_t count = first.header.byte_count;
  if (!begun_) return next_byte_ + (count - next_byte_) % kCountModulus;
  const bool later = sequenceAfter(first.header.sequence, newest_.sequence);
  const std::uint64_t ahead = (count - next_byte_) % kCountModulus;
  const bool another = first.stamp_ns - newest_stamp_ns_ > options_.reorder_ns && !fitsNewest(first.header);
  if (later && !first.behind && !another && ahead < kCountModulus / 2) return next_byte_ + ahead;
  const bool wrong_newest = !newest_sure_;
  if (wrong_newest) distrustNewest();
  if (later && !first.behind && wrong_newest) return absoluteOffset(count);
  closeBefore(base_frame_ + slots_.size());
  beginEpoch();
  ++counters_.epochs;
  return count;
}

/// Takes out again the newest packet, which others contradict.
void FrameAssembler::distrustNewest() {
  const std::uint64_t begin = absoluteOffset(newest_.byte_count), end = begin + newest_.size;
  next_byte_ = base_frame_ * frame_bytes_;
  for (std::uint64_t frame = base_frame_; frame < base_frame_ + slots_.size(); ++frame) {
    Slot& open = slot(frame);
    if (!open.begun) continue;
    const std::uint64_t start = frame * frame_bytes_;
    std::vector<Interval> kept;
    for (const Interval& have : open.received) {
      const Interval left{have.begin, std::min<std::uint64_t>(have.end, std::max(begin, start + have.begin) - start)};
      const Interval right{std::max<std::uint64_t>(have.begin, std::min(end, start + have.end) - start), have.end};
      if (start + have.end <= begin || start + have.begin >= end) {
        kept.push_back(have);
        continue;
      }
      if (left.begin < left.end) kept.push_back(left);
      if (right.begin < right.end) kept.push_back(right);
    }
    open.received = std::move(kept);
    std::size_t received = 0;
    for (const Interval& have : open.received) received += have.end - have.begin;
    counters_.bytes -= open.received_bytes - received;
    open.received_bytes = received;
    if (received > 0) next_byte_ = start + open.received.back().end;
  }
}

void FrameAssembler::advanceNewest(const DataPacket& packet, bool sure) {
  const Header header = headerOf(packet);
  const bool rested = begun_ && packet.stamp_ns - newest_stamp_ns_ > kRest_ns;
  // A short packet that another one follows at once was sent so, and not cut short.
  if (begun_ && header.sequence - newest_.sequence == 1 && newest_.size < longest_payload_ && !newest_rested_ &&
      (header.byte_count - newest_.byte_count) % kCountModulus == newest_.size) {
    lengths_vary_ = true;
  }
  newest_ = header;
  newest_stamp_ns_ = packet.stamp_ns;
  newest_sure_ = sure;
  newest_rested_ = rested;
}

void FrameAssembler::place(const DataPacket& packet, std::uint64_t offset) {
  remember(packet);
  const std::uint64_t packet_end = offset + packet.size;
  if (begun_ && offset < next_byte_) ++counters_.reordered_packets;
  // The card sends a packet as soon as it is full. A shorter one is the rest of a recording, sent seconds later.
  const bool sure = !begun_ || fitsExactly(newest_, headerOf(packet));
  longest_payload_ = std::max(longest_payload_, packet.size);
  const bool full = packet.size == longest_payload_;
  if (!begun_ || packet_end > next_byte_) advanceNewest(packet, sure);
  begun_ = true;

  const std::uint8_t* from = packet.payload;
  bool late = false;
  while (offset < packet_end) {
    const std::uint64_t frame = offset / frame_bytes_;
    const std::size_t begin = offset % frame_bytes_;
    const std::size_t size = std::min<std::uint64_t>(frame_bytes_ - begin, packet_end - offset);
    const std::uint64_t passed = next_byte_ / frame_bytes_;
    next_byte_ = std::max(next_byte_, offset + size);
    if (next_byte_ > far_window_bytes_) closeBefore((next_byte_ - far_window_bytes_) / frame_bytes_);
    passEnds(passed, packet.stamp_ns);
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

/// Notes when the ends of frames from `from` on were passed. A frame that was passed long enough ago gets nothing more.
void FrameAssembler::passEnds(std::uint64_t from, std::int64_t stamp_ns) {
  for (std::uint64_t f = std::max(from, base_frame_); f < next_byte_ / frame_bytes_; ++f) slot(f).passed_ns = stamp_ns;
  while ((base_frame_ + 1) * frame_bytes_ + window_bytes_ <= next_byte_ &&
         stamp_ns - slot(base_frame_).passed_ns > options_.reorder_ns) {
    closeBefore(base_frame_ + 1);
  }
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
  newest_ = {};
  newest_stamp_ns_ = 0;
  newest_sure_ = newest_rested_ = lengths_vary_ = false;
  longest_payload_ = 0;
  suspects_.clear();
  for (Fingerprint& entry : recent_) entry.size = 0;
  clock_.reset();
}

}  // namespace mmradartwin
