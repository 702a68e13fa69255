#include "mmradartwin_driver/mmwavelink_frame.h"

#include <zlib.h>

#include <boost/crc.hpp>
#include <stdexcept>

namespace mmradartwin {
namespace {

constexpr std::uint16_t kRetryBits = 3;
constexpr std::uint16_t kNoAcknowledgementBits = 3 << 2;
constexpr std::uint16_t kNoCrcBits = 3 << 8;
constexpr std::size_t kAlignment = 4;

std::uint16_t word(const std::uint8_t* bytes) { return static_cast<std::uint16_t>(bytes[0] | bytes[1] << 8); }

void put(std::vector<std::uint8_t>& out, std::uint16_t value) {
  out.push_back(static_cast<std::uint8_t>(value));
  out.push_back(static_cast<std::uint8_t>(value >> 8));
}

std::size_t crcBytes(MmwaveLinkCrc crc) {
  switch (crc) {
    case MmwaveLinkCrc::k16:
      return 2;
    case MmwaveLinkCrc::k32:
      return 4;
    case MmwaveLinkCrc::k64:
      return 8;
    case MmwaveLinkCrc::kNone:
      break;
  }
  return 0;
}

std::string hexadecimal(unsigned value) {
  static const char digits[] = "0123456789abcdef";
  std::string text = "0x";
  for (int shift = 12; shift >= 0; shift -= 4) text += digits[value >> shift & 0xF];
  return text;
}

}  // namespace

std::uint16_t internetChecksum(const std::uint16_t* words, std::size_t count) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += words[i];
  while (sum >> 16) sum = (sum & 0xFFFF) + (sum >> 16);
  return static_cast<std::uint16_t>(~sum);
}

std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size) {
  return static_cast<std::uint32_t>(::crc32(0, bytes, static_cast<uInt>(size)));
}

std::uint16_t crc16(const std::uint8_t* bytes, std::size_t size) {
  boost::crc_optimal<16, 0x1021, 0xFFFF, 0, false, false> crc;
  crc.process_bytes(bytes, size);
  return crc.checksum();
}

MmwaveLinkCrc MmwaveLinkHeader::crc() const {
  if (flags >> 8 & 3) return MmwaveLinkCrc::kNone;
  switch (flags >> 10 & 3) {
    case 0:
      return MmwaveLinkCrc::k16;
    case 1:
      return MmwaveLinkCrc::k32;
    default:
      return MmwaveLinkCrc::k64;
  }
}

std::size_t MmwaveLinkHeader::crc_bytes() const { return crcBytes(crc()); }

std::vector<std::uint8_t> encodeMessage(const MmwaveLinkMessage& message) {
  if (message.message_id > 0x3FF)
    throw std::invalid_argument("message id " + hexadecimal(message.message_id) + " > 0x3ff");
  if (message.sequence > 15) throw std::invalid_argument("sequence number " + std::to_string(message.sequence));
  if (message.crc == MmwaveLinkCrc::k64) throw std::invalid_argument("messages with a CRC-64 are not sent");

  std::vector<std::uint8_t> payload;
  for (const SubBlock& block : message.sub_blocks) {
    put(payload, block.id);
    put(payload, static_cast<std::uint16_t>(block.data.size() + 4));
    payload.insert(payload.end(), block.data.begin(), block.data.end());
  }
  while ((kMmwaveLinkHeaderBytes + payload.size()) % kAlignment != 0) payload.push_back(0xFF);
  const std::size_t length = kMmwaveLinkHeaderBytes + payload.size() + crcBytes(message.crc);
  if (length > kMmwaveLinkMaxLength) {
    throw std::length_error("message " + hexadecimal(message.message_id) + " of " + std::to_string(length) +
                            " bytes; the radar takes " + std::to_string(kMmwaveLinkMaxLength) + " at most");
  }

  std::uint16_t flags = static_cast<std::uint16_t>(message.sequence << 12);
  if (message.retry) flags |= kRetryBits;
  if (!message.wants_acknowledgement) flags |= kNoAcknowledgementBits;
  if (message.crc == MmwaveLinkCrc::kNone) flags |= kNoCrcBits;
  if (message.crc == MmwaveLinkCrc::k32) flags |= 1 << 10;
  const std::uint16_t header[5] = {
      static_cast<std::uint16_t>(static_cast<unsigned>(message.direction) | static_cast<unsigned>(message.type) << 4 |
                                 message.message_id << 6),
      static_cast<std::uint16_t>(length), flags, message.remaining_chunks,
      static_cast<std::uint16_t>(message.sub_blocks.size())};

  std::vector<std::uint8_t> bytes(kSyncToRadar, kSyncToRadar + kMmwaveLinkSyncBytes);
  for (const std::uint16_t value : header) put(bytes, value);
  put(bytes, internetChecksum(header, 5));
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  const std::uint8_t* covered = bytes.data() + kMmwaveLinkSyncBytes;
  const std::size_t covered_size = bytes.size() - kMmwaveLinkSyncBytes;
  if (message.crc == MmwaveLinkCrc::k16) put(bytes, crc16(covered, covered_size));
  if (message.crc == MmwaveLinkCrc::k32) {
    const std::uint32_t crc = crc32(covered, covered_size);
    put(bytes, static_cast<std::uint16_t>(crc));
    put(bytes, static_cast<std::uint16_t>(crc >> 16));
  }
  return bytes;
}

std::optional<MmwaveLinkHeader> decodeHeader(const std::uint8_t* bytes) {
  std::uint16_t words[6];
  for (std::size_t i = 0; i < 6; ++i) words[i] = word(bytes + 2 * i);
  if (internetChecksum(words, 5) != words[5]) return std::nullopt;
  MmwaveLinkHeader header{words[0], words[1], words[2], words[3], words[4], words[5]};
  if (header.length < kMmwaveLinkHeaderBytes + header.crc_bytes() || header.length > kMmwaveLinkMaxLength ||
      (header.length - header.crc_bytes()) % kAlignment != 0) {
    return std::nullopt;
  }
  return header;
}

DecodedMessage decodeMessage(const std::uint8_t* bytes, std::size_t size) {
  if (size < kMmwaveLinkHeaderBytes) return {std::nullopt, "shorter than a header"};
  const auto header = decodeHeader(bytes);
  if (!header) return {std::nullopt, "bad header checksum or length"};
  if (header->length != size) return {std::nullopt, "length differs from MSGLEN"};
  const std::size_t end = size - header->crc_bytes();
  switch (header->crc()) {
    case MmwaveLinkCrc::k16:
      if (word(bytes + end) != crc16(bytes, end)) return {std::nullopt, "bad CRC-16"};
      break;
    case MmwaveLinkCrc::k32:
      if ((word(bytes + end) | static_cast<std::uint32_t>(word(bytes + end + 2)) << 16) != crc32(bytes, end)) {
        return {std::nullopt, "bad CRC-32"};
      }
      break;
    case MmwaveLinkCrc::k64:
      return {std::nullopt, "a CRC-64, which this host never asked for"};
    case MmwaveLinkCrc::kNone:
      break;
  }

  MmwaveLinkMessage message;
  message.direction = static_cast<MmwaveLinkDirection>(header->opcode & 0xF);
  message.type = header->type();
  message.message_id = header->message_id();
  message.retry = (header->flags & kRetryBits) == kRetryBits;
  message.wants_acknowledgement = (header->flags & kNoAcknowledgementBits) == 0;
  message.crc = header->crc();
  message.sequence = header->sequence();
  message.remaining_chunks = header->remaining_chunks;
  std::size_t at = kMmwaveLinkHeaderBytes;
  for (int i = 0; i < (header->sub_blocks & 0x7FF); ++i) {
    if (at + 4 > end) return {std::nullopt, "fewer sub-blocks than NSBC says"};
    const std::size_t length = word(bytes + at + 2);
    if (length < 4 || at + length > end)
      return {std::nullopt, "sub-block " + hexadecimal(word(bytes + at)) + " overruns"};
    message.sub_blocks.push_back({word(bytes + at), {bytes + at + 4, bytes + at + length}});
    at += length;
  }
  return {message, ""};
}

}  // namespace mmradartwin
