#include "emulated_awr2243.h"

#include <algorithm>
#include <cstddef>

namespace mmradartwin {
namespace {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::microseconds;
using std::chrono::milliseconds;

constexpr std::size_t kReadOnly = 0;
constexpr std::size_t kAnySize = 9999;

/// Data sizes without the four bytes of id and length, as the document's tables give them.
const std::map<std::uint16_t, std::size_t>& knownSubBlocks() {
  static const std::map<std::uint16_t, std::size_t> sizes = {
      {0x0080, 8},        {0x0082, 8},  {0x0083, 4},        {0x0085, 4},  {0x0086, 12}, {0x008D, 16},
      {0x00C0, 0},        {0x0100, 44}, {0x0101, 20},       {0x0102, 24}, {0x0140, 4},  {0x0220, kReadOnly},
      {0x02C2, 68},       {0x02C3, 4},  {0x02CC, 4},        {0x4000, 0},  {0x4041, 12}, {0x4042, 8},
      {0x4043, 4},        {0x4044, 4},  {0x4045, 4},        {0x404B, 44}, {0x404C, 12}, {0x404E, 16},
      {0x4080, kAnySize}, {0x40C0, 8},  {0x40E0, kReadOnly}};
  return sizes;
}

unsigned half(const Bytes& data, std::size_t at) { return data.at(at) | data.at(at + 1) << 8; }
unsigned long full(const Bytes& data, std::size_t at) {
  return half(data, at) | static_cast<unsigned long>(half(data, at + 2)) << 16;
}

unsigned onesComplementSum(const std::vector<std::uint16_t>& words, std::size_t count) {
  unsigned long sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += words[i];
    if (sum > 0xFFFF) sum = sum - 0x10000 + 1;
  }
  return static_cast<unsigned>(sum);
}

/// Bit by bit, from the definitions of the two polynomials.
unsigned crc16Of(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= static_cast<unsigned>(byte) << 8;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 0x8000 ? (crc << 1 ^ 0x1021) & 0xFFFF : crc << 1 & 0xFFFF;
  }
  return crc;
}

unsigned long crc32Of(const Bytes& bytes) {
  std::uint32_t crc = 0xFFFFFFFFu;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = crc & 1 ? crc >> 1 ^ 0xEDB88320u : crc >> 1;
  }
  return crc ^ 0xFFFFFFFFu;
}

Bytes bytesOf(const std::vector<std::uint16_t>& words) {
  Bytes bytes;
  for (const std::uint16_t word : words) {
    bytes.push_back(static_cast<std::uint8_t>(word & 0xFF));
    bytes.push_back(static_cast<std::uint8_t>(word >> 8));
  }
  return bytes;
}

/// True where a message's CRC of this many bytes is that of its content; one of eight bytes is not checked.
bool isWhole(const Bytes& bytes, const Bytes& covered, std::size_t crc_size) {
  if (crc_size == 2) return half(bytes, covered.size()) == crc16Of(covered);
  if (crc_size == 4) return full(bytes, covered.size()) == crc32Of(covered);
  return true;
}

/// One block of an answer.
void append(std::uint16_t sub_block, const Bytes& reply, Bytes& blocks) {
  for (const std::size_t value : {std::size_t{sub_block}, reply.size() + 4}) {
    blocks.push_back(static_cast<std::uint8_t>(value & 0xFF));
    blocks.push_back(static_cast<std::uint8_t>(value >> 8));
  }
  blocks.insert(blocks.end(), reply.begin(), reply.end());
}

}  // namespace

bool EmulatedAwr2243::strikes(int& fault) const {
  if (faults.skip > 0 || fault == 0) return false;
  --fault;
  return true;
}

void EmulatedAwr2243::powerOff() {
  in_reset_ = true;
  outgoing_.clear();
  sending_.clear();
  frames_run = false;
  last_.clear();
  tellLanes();
}

void EmulatedAwr2243::setReset(bool low) {
  if (low) {
    powerOff();
    return;
  }
  if (!in_reset_) return;
  in_reset_ = false;
  state_ = State::kHunt;
  words_.clear();
  main_crc32_ = front_end_crc32_ = front_end_up_ = calibrated_ = false;
  last_.clear();
  last_sequence_ = -1;
  expected_chunks_ = -1;
  if (faults.no_boot) return;
  if (boot_mode_ != 4) {
    violations.push_back("released from reset in boot mode " + std::to_string(boot_mode_));
    return;
  }
  event(0x5000, Bytes(8), milliseconds(5));
  if (!has_firmware_) event(0x5005, Bytes(8), milliseconds(8));
}

bool EmulatedAwr2243::hostInterrupt() {
  if (faults.interrupt_stuck) return true;
  return !in_reset_ && sending_.empty() && !outgoing_.empty() && outgoing_.front().when <= Clock::now();
}

std::uint16_t EmulatedAwr2243::transfer(std::uint16_t mosi) {
  if (in_reset_) return 0xFFFF;
  if (!sending_.empty()) {
    const std::uint16_t word = sending_.front();
    sending_.pop_front();
    if (mosi != 0xFFFF) violations.push_back("host writes while the radar sends");
    return word;
  }
  received(mosi);
  return 0xFFFF;
}

void EmulatedAwr2243::received(std::uint16_t word) {
  switch (state_) {
    case State::kHunt:
      if (previous_ == 0x1234 && word == 0x4321) {
        state_ = State::kHeader;
        words_.clear();
      } else if (previous_ == 0x5678 && word == 0x8765) {
        state_ = State::kDummy;
        dummies_ = 0;
      }
      previous_ = word;
      return;
    case State::kHeader:
      words_.push_back(word);
      if (words_.size() < 6) return;
      if (strikes(faults.command_header)) words_[1] ^= 0x0100;
      if (onesComplementSum(words_, 6) != 0xFFFF) {
        ++headers_refused;  // and silence
        state_ = State::kHunt;
      } else if (words_[1] < 12 || words_[1] > 252 || words_[1] % 2) {
        violations.push_back("MSGLEN " + std::to_string(words_[1]));
        state_ = State::kHunt;
      } else {
        state_ = State::kBody;
      }
      previous_ = 0;
      if (state_ == State::kBody && words_[1] == 12) handle();
      return;
    case State::kBody:
      words_.push_back(word);
      if (2 * words_.size() == words_[1]) handle();
      return;
    case State::kDummy:
      if (word != 0xFFFF) violations.push_back("dummy words are 0xFFFF");
      if (++dummies_ < 6) return;
      state_ = State::kHunt;
      previous_ = 0;
      if (outgoing_.empty() || outgoing_.front().when > Clock::now()) {
        violations.push_back("asked to send without having raised HOST_INTR");
        return;
      }
      sending_.assign(outgoing_.front().words.begin(), outgoing_.front().words.end());
      outgoing_.pop_front();
      return;
  }
}

void EmulatedAwr2243::handle() {
  state_ = State::kHunt;
  answer();
  if (faults.skip > 0) --faults.skip;
}

void EmulatedAwr2243::answer() {
  if (strikes(faults.deaf)) return;
  const unsigned opcode = words_[0], flags = words_[2];
  if (strikes(faults.command_data)) words_[6] ^= 0x0010;
  Bytes bytes = bytesOf(words_);
  const bool has_crc = (flags >> 8 & 3) == 0;
  const unsigned crc_kind = flags >> 10 & 3;
  const std::size_t crc_size = !has_crc ? 0 : crc_kind == 0 ? 2 : crc_kind == 1 ? 4 : 8;
  const Bytes covered(bytes.begin(), bytes.end() - static_cast<std::ptrdiff_t>(crc_size));
  if ((covered.size() & 3) != 0) violations.push_back("message is not padded to four bytes");

  const int sequence = static_cast<int>(flags >> 12);
  const bool retry = (flags & 3) == 3;
  // From the processor that was asked, the message and its number and CRC as in the command.
  const unsigned back = (opcode & 0xF) == 1 ? 2 : 6;
  const auto answer_opcode = static_cast<std::uint16_t>(back | 1 << 4 | (opcode & 0xFFC0));
  const auto answer_flags = static_cast<std::uint16_t>(flags & 0xFF00);
  if (!isWhole(bytes, covered, crc_size)) {
    ++crcs_refused;
    send(static_cast<std::uint16_t>((answer_opcode & ~0x30u) | 2 << 4), answer_flags, {0, 0, 8, 0, 9, 0, 0, 0}, 1,
         microseconds(200));
    return;
  }
  if (retry && sequence == last_sequence_) {
    ++repeats;
    outgoing_.push_back({Clock::now() + microseconds(200), last_answer_});
    spoilAnswer();
    return;
  }
  if (last_sequence_ >= 0 && sequence != (last_sequence_ + 1) % 16) {
    violations.push_back("sequence number " + std::to_string(sequence) + " after " + std::to_string(last_sequence_));
  }
  const Outcome outcome = carryOutBlocks(covered, sequence, retry);
  last_sequence_ = sequence;
  if ((flags >> 2 & 3) != 0) return;  // nobody asked for an answer
  const bool first_chunk = outcome.offender == 0x4080 && incoming_image_.size() <= 232;
  send(answer_opcode, answer_flags, outcome.blocks, outcome.count,
       first_chunk ? microseconds(20000) : microseconds(200));
  last_answer_ = outgoing_.back().words;
  spoilAnswer();
  if (outcome.error == 0) announce(outcome.offender);
}

/// Carries out the blocks of a message in their order, up to the first that cannot be.
EmulatedAwr2243::Outcome EmulatedAwr2243::carryOutBlocks(const Bytes& covered, int sequence, bool retry) {
  const unsigned opcode = words_[0], block_count = words_[4];
  Outcome outcome;
  std::size_t at = 12;
  for (unsigned i = 0; i < block_count && outcome.error == 0; ++i) {
    if (at + 4 > covered.size() || half(covered, at + 2) < 4 || at + half(covered, at + 2) > covered.size()) {
      outcome.error = 3;
      break;
    }
    Command command;
    command.sub_block = static_cast<std::uint16_t>(half(covered, at));
    const std::size_t length = half(covered, at + 2);
    command.data.assign(covered.begin() + static_cast<std::ptrdiff_t>(at + 4),
                        covered.begin() + static_cast<std::ptrdiff_t>(at + length));
    command.sequence = sequence;
    command.retry = retry;
    command.remaining_chunks = words_[3];
    at += length;
    outcome.offender = command.sub_block;
    const bool for_main = command.sub_block >= 0x4000;
    if ((opcode >> 4 & 3) != 0 || (opcode & 0xF) != (for_main ? 5u : 1u)) {
      outcome.error = 1;
    } else if (command.sub_block / 32 != opcode >> 6) {
      outcome.error = 2;
    } else {
      Bytes reply;
      outcome.error = carryOut(command, reply);
      if (outcome.error == 0) commands.push_back(command);
      if (outcome.error == 0 && !reply.empty()) {
        ++outcome.count;
        append(command.sub_block, reply, outcome.blocks);
      }
    }
  }
  for (; at < covered.size(); ++at) {
    if (outcome.error == 0 && covered[at] != 0xFF) violations.push_back("padding is not 0xFF");
  }
  if (outcome.error != 0) {
    outcome.count = 1;
    outcome.blocks = {0,
                      0,
                      8,
                      0,
                      static_cast<std::uint8_t>(outcome.error),
                      0,
                      static_cast<std::uint8_t>(outcome.offender & 0xFF),
                      static_cast<std::uint8_t>(outcome.offender >> 8)};
  }
  return outcome;
}

/// Sends the events that follow a command: boot, calibration, start and end of frames.
void EmulatedAwr2243::announce(unsigned sub_block) {
  if (sub_block == 0x4000) event(0x5001, Bytes(8), milliseconds(5));
  if (sub_block == 0x00C0) {
    if (faults.front_end_fault) {
      event(0x1002, Bytes(28, 1), milliseconds(5));
    } else {
      Bytes report = {0xFE, 0x1F, 0, 0, 0xFE, 0x1F, 0, 0, 45, 0, 0, 0, 100, 0, 0, 0, 0, 0, 0, 0};
      if (faults.calibration_fails) report[1] = 0x1D;
      event(0x1004, report, milliseconds(10));
    }
  }
  if (sub_block == 0x0140) {
    if (frames_run && !faults.no_frame_event) event(0x100B, Bytes(4), milliseconds(2));
    if (!frames_run) event(0x100F, Bytes(4), milliseconds(2));
  }
}

void EmulatedAwr2243::spoilAnswer() {
  Outgoing& answer = outgoing_.back();
  if (strikes(faults.answer_header)) answer.words[3] ^= 0x0400;
  if (strikes(faults.answer_crc)) answer.words.back() ^= 0x8000;
  if (strikes(faults.answer_garbage)) answer.words.insert(answer.words.begin(), {0x0000, 0xDCBA, 0x1234});
  if (strikes(faults.answer_delayed)) answer.when += faults.delay;
  if (strikes(faults.answer_lost)) outgoing_.pop_back();
}

int EmulatedAwr2243::carryOut(const Command& command, Bytes& reply) {
  const auto known = knownSubBlocks().find(command.sub_block);
  if (known == knownSubBlocks().end()) return 4;
  if (known->second != kAnySize && command.data.size() != known->second) return 5;
  if (const int error = checkOrder(command)) return error;
  if (const int error = checkValues(command)) return error;
  if (command.sub_block == 0x4080) return download(command);
  if (command.sub_block == 0x0140) return trigger(command);
  if (command.sub_block == 0x4000) front_end_up_ = true;
  if (command.sub_block == 0x00C0) calibrated_ = true;
  if (command.sub_block == 0x404C) main_crc32_ = command.data[0] == 1;
  if (command.sub_block == 0x0086) front_end_crc32_ = command.data[8] == 1;
  if (command.sub_block == 0x40E0 || command.sub_block == 0x0220) {
    reply = {1, 1, 1, 2, 2, 4, 3, 21, 6, 30, 0, 0, 0, 0, 0, 0};
  }
  last_[command.sub_block] = command.data;
  if (command.sub_block == 0x404B) tellLanes();
  return 0;
}

int EmulatedAwr2243::checkOrder(const Command& command) const {
  const std::uint16_t id = command.sub_block;
  if (!has_firmware_ && id != 0x4080) return 7;
  if (id < 0x4000 && !front_end_up_) return 7;
  if (id == 0x00C0 && !(configured(0x0080) && configured(0x0082) && configured(0x0083))) return 7;
  if (id >= 0x0100 && id < 0x0200 && !calibrated_) return 7;
  if (id == 0x0101 && !configured(0x0100)) return 7;
  if (id == 0x0102 && !configured(0x0101)) return 7;
  if (id == 0x40C0 && !configured(0x0102)) return 7;
  return 0;
}

int EmulatedAwr2243::checkValues(const Command& command) const {
  const Bytes& d = command.data;
  bool good = true;
  switch (command.sub_block) {
    case 0x0080:
      good = half(d, 0) >= 1 && half(d, 0) <= 15 && half(d, 2) <= 7 && half(d, 4) == 0;
      break;
    case 0x0082:
      good = (full(d, 0) & 3) == 2 && (full(d, 0) >> 8 & 0xFF) == 0 && (full(d, 0) >> 16 & 3) == 1;
      break;
    case 0x0085:
      good = half(d, 0) == 9;
      break;
    case 0x02CC:
      good = full(d, 0) == 0;
      break;
    case 0x0100: {
      const unsigned slope = half(d, 28);
      good = full(d, 4) >= 0x5471C71BUL && full(d, 4) <= 0x5A000000UL && full(d, 8) <= 524287 && full(d, 12) <= 4095 &&
             full(d, 16) <= 500000 && full(d, 8) + full(d, 16) >= 1300 && (slope <= 5510 || slope >= 65536 - 5510) &&
             half(d, 32) >= 2 && half(d, 32) <= 1024 && half(d, 34) >= 2000 && half(d, 34) <= 22500 && d[36] <= 3 &&
             d[37] <= 3 && (half(d, 40) & 63) >= 32 && (half(d, 40) & 63) <= 52 && half(d, 40) % 2 == 0 &&
             (half(d, 40) >> 6) <= 2 && d[20] <= 20 && d[21] <= 20 && d[22] <= 20 && d[23] == 0;
      // ADC start in 10 ns and samples at so many per millisecond, both in nanoseconds.
      good = good && full(d, 16) * 10 >= full(d, 12) * 10 + half(d, 32) * 1000000UL / half(d, 34);
      break;
    }
    case 0x0101: {
      const unsigned transmitters = half(d, 18);
      const unsigned on = (transmitters & 1) + (transmitters >> 1 & 1) + (transmitters >> 2 & 1);
      good = half(d, 0) <= half(d, 2) && half(d, 2) <= 511 && transmitters <= 7 && on >= 1 && on <= 2 &&
             (transmitters & ~half(last_.at(0x0080), 2)) == 0;
      break;
    }
    case 0x0102:
      good = half(d, 2) <= half(d, 4) && half(d, 6) >= 1 && half(d, 6) <= 255 && full(d, 12) >= 60000 &&
             full(d, 12) <= 268400000 && half(d, 16) == 1 && half(d, 10) == 2 * half(last_.at(0x0100), 32);
      break;
    case 0x40C0: {
      const Bytes& frame = last_.at(0x0102);
      good = full(d, 0) == half(frame, 6) * (half(frame, 4) - half(frame, 2) + 1UL) && half(d, 4) == half(frame, 10);
      break;
    }
    case 0x4041:
      good = half(d, 0) == half(last_.at(0x0080), 0) && half(d, 2) == 2 && half(d, 4) == 1 && d[6] <= 1 && d[7] == 0;
      break;
    case 0x4042:
      good = d[0] == 1 && d[1] == 1;
      break;
    case 0x4043:
      good = half(d, 0) == 15;
      break;
    case 0x4044:
      good = d[0] == 1 && d[1] == 1;
      break;
    case 0x4045:
      good = half(d, 0) <= 1 && half(d, 2) == 1;
      break;
    case 0x404B:
      good = d[0] <= 1 && half(d, 2) >= 64 && half(d, 2) <= 1024;
      break;
    case 0x404C:
      good = d[0] == 1 && d[1] <= 1;
      break;
    default:
      break;
  }
  return good ? 0 : 8;
}

int EmulatedAwr2243::download(const Command& command) {
  if (expected_chunks_ < 0) {
    if (command.data.size() < 8 || full(command.data, 0) != 4) return 10;
    incoming_image_.clear();
    expected_chunks_ = command.remaining_chunks;
  } else if (command.remaining_chunks != --expected_chunks_) {
    violations.push_back("REMCHUNKS " + std::to_string(command.remaining_chunks) + " where " +
                         std::to_string(expected_chunks_) + " was due");
    return 8;
  }
  incoming_image_.insert(incoming_image_.end(), command.data.begin(), command.data.end());
  if (command.remaining_chunks > 0) return 0;
  expected_chunks_ = -1;
  Bytes image(incoming_image_.begin() + 8, incoming_image_.end());
  if (image.size() != full(incoming_image_, 4) || image.size() < 5) return 10;
  const Bytes body(image.begin(), image.end() - 4);
  if (full(image, body.size()) != crc32Of(body)) return 10;
  flash = image;
  has_firmware_ = true;
  return 0;
}

int EmulatedAwr2243::trigger(const Command& command) {
  const unsigned action = half(command.data, 0);
  for (const std::uint16_t needed : {0x0100, 0x0101, 0x0102, 0x40C0, 0x4041, 0x4042, 0x4043, 0x4044, 0x4045, 0x0085}) {
    if (!configured(needed)) return 7;
  }
  if (action > 1 || (action == 1) == frames_run) return 7;
  frames_run = action == 1;
  tellLanes();
  return 0;
}

LvdsActivity EmulatedAwr2243::activity() const {
  LvdsActivity lanes;
  const auto signedHalf = [](const Bytes& data, std::size_t at) { return static_cast<std::int16_t>(half(data, at)); };
  if (configured(0x4041)) lanes.q_first = last_.at(0x4041)[6] == 1;
  if (configured(0x4045)) lanes.lanes_reversed = half(last_.at(0x4045), 0) == 1;
  if (frames_run) {
    const Bytes &profile = last_.at(0x0100), &frame = last_.at(0x0102);
    lanes.kind = LvdsActivity::Kind::kFrames;
    lanes.samples = static_cast<int>(half(profile, 32));
    lanes.chirps = static_cast<int>(half(frame, 6) * (half(frame, 4) - half(frame, 2) + 1));
    lanes.period_ns = static_cast<std::int64_t>(full(frame, 12)) * 5;
    lanes.chirp_ns = static_cast<std::int64_t>(full(profile, 8) + full(profile, 16)) * 10;
    lanes.sampled_ns = static_cast<std::int64_t>(full(profile, 8) + full(profile, 12)) * 10 +
                       static_cast<std::int64_t>(half(profile, 32)) * 1000000 / half(profile, 34);
    lanes.start_frequency_hz = static_cast<double>(full(profile, 4)) * 3.6e9 / 67108864;
    lanes.slope_hz_per_s = signedHalf(profile, 28) * (3.6e6 * 900 / 67108864) * 1e9;
    lanes.sample_rate_hz = half(profile, 34) * 1e3;
    lanes.adc_start_s = static_cast<double>(full(profile, 12)) * 1e-8;
    lanes.test_source = configured(0x02C2) && configured(0x02C3) && half(last_.at(0x02C3), 0) == 1;
    if (lanes.test_source) {
      const Bytes& source = last_.at(0x02C2);
      for (std::size_t i = 0; i < 2; ++i) {
        for (std::size_t axis = 0; axis < 3; ++axis) {
          lanes.targets[i].position_m[axis] = signedHalf(source, 26 * i + 2 * axis) * 0.01;
          lanes.targets[i].velocity_m_per_s[axis] = signedHalf(source, 26 * i + 6 + 2 * axis) * 0.01;
        }
        lanes.targets[i].level_dbfs = -0.1 * half(source, 26 * i + 12);
      }
      for (std::size_t rx = 0; rx < 4; ++rx) {
        for (std::size_t axis = 0; axis < 2; ++axis) {
          lanes.rx_position_wavelengths[rx][axis] = static_cast<std::int8_t>(source[52 + 2 * rx + axis]) / 8.0;
        }
      }
    }
  } else if (configured(0x404B) && last_.at(0x404B)[0] == 1) {
    const Bytes& pattern = last_.at(0x404B);
    lanes.kind = LvdsActivity::Kind::kTestPattern;
    lanes.samples = static_cast<int>(half(pattern, 2));
    lanes.sampled_ns = lanes.period_ns = lanes.samples * std::max<std::int64_t>(pattern[1], 1) * 5;
    lanes.pattern_packets = static_cast<std::int64_t>(full(pattern, 4));
    for (std::size_t rx = 0; rx < 4; ++rx) {
      for (std::size_t part = 0; part < 2; ++part) {
        lanes.ramps[rx][part] = {static_cast<std::uint16_t>(half(pattern, 8 + 8 * rx + 4 * part)),
                                 static_cast<std::uint16_t>(half(pattern, 10 + 8 * rx + 4 * part))};
      }
    }
  }
  return lanes;
}

void EmulatedAwr2243::raise(std::uint16_t id, const Bytes& data) { event(id, data, milliseconds(0)); }

void EmulatedAwr2243::event(std::uint16_t id, const Bytes& data, milliseconds after) {
  const bool from_main = id >= 0x5000;
  const bool long_crc = from_main ? main_crc32_ : front_end_crc32_;
  Bytes block = {static_cast<std::uint8_t>(id & 0xFF), static_cast<std::uint8_t>(id >> 8),
                 static_cast<std::uint8_t>((data.size() + 4) & 0xFF),
                 static_cast<std::uint8_t>((data.size() + 4) >> 8)};
  block.insert(block.end(), data.begin(), data.end());
  send(static_cast<std::uint16_t>((from_main ? 6 : 2) | 3 << 4 | id / 32 << 6),
       static_cast<std::uint16_t>(long_crc ? 0x0400 : 0), block, 1, after);
}

void EmulatedAwr2243::send(std::uint16_t opcode, std::uint16_t flags, const Bytes& blocks, int block_count,
                           microseconds after) {
  Bytes data = blocks;
  while (data.size() % 4) data.push_back(0xFF);
  const bool has_crc = (flags >> 8 & 3) == 0;
  const bool long_crc = (flags >> 10 & 3) == 1;
  std::vector<std::uint16_t> words = {opcode,
                                      static_cast<std::uint16_t>(12 + data.size() +
                                                                 (!has_crc   ? 0
                                                                  : long_crc ? 4
                                                                             : 2)),
                                      flags, 0, static_cast<std::uint16_t>(block_count)};
  words.push_back(static_cast<std::uint16_t>(0xFFFF - onesComplementSum(words, 5)));
  for (std::size_t i = 0; i < data.size(); i += 2) words.push_back(static_cast<std::uint16_t>(half(data, i)));
  const Bytes covered = bytesOf(words);
  if (has_crc && long_crc) {
    const unsigned long crc = crc32Of(covered);
    words.push_back(static_cast<std::uint16_t>(crc & 0xFFFF));
    words.push_back(static_cast<std::uint16_t>(crc >> 16));
  } else if (has_crc) {
    words.push_back(static_cast<std::uint16_t>(crc16Of(covered)));
  }
  words.insert(words.begin(), {0xDCBA, 0xABCD});
  outgoing_.push_back({Clock::now() + after, words});
}

}  // namespace mmradartwin
