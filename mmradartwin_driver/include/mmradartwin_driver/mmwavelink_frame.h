#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// The radar's message framing on its SPI port, from TI's interface control document (r2.23, chapters 2 and 3). All
/// fields are little endian:
///
///     SYNC (4) | OPCODE MSGLEN FLAGS REMCHUNKS NSBC CHKSUM (12) | sub-blocks, padding 0xFF | CRC (2, 4 or 8)
///
/// MSGLEN counts from OPCODE to the end of the CRC and lies in 12..252.
constexpr std::size_t kMmwaveLinkSyncBytes = 4;
constexpr std::size_t kMmwaveLinkHeaderBytes = 12;
constexpr std::size_t kMmwaveLinkMaxLength = 252;
/// Largest payload of a message with a CRC-32, ids and lengths of the sub-blocks included.
constexpr std::size_t kMmwaveLinkMaxPayload = kMmwaveLinkMaxLength - kMmwaveLinkHeaderBytes - 4;

constexpr std::uint8_t kSyncToRadar[kMmwaveLinkSyncBytes] = {0x34, 0x12, 0x21, 0x43};
constexpr std::uint8_t kSyncFromRadar[kMmwaveLinkSyncBytes] = {0xBA, 0xDC, 0xCD, 0xAB};
/// The host's answer to the radar's interrupt, followed by 12 bytes of 0xFF: the radar may send.
constexpr std::uint8_t kClearToSend[kMmwaveLinkSyncBytes] = {0x78, 0x56, 0x65, 0x87};

enum class MmwaveLinkDirection : std::uint8_t { kToFrontEnd = 1, kFromFrontEnd = 2, kToMain = 5, kFromMain = 6 };
enum class MmwaveLinkType : std::uint8_t { kCommand = 0, kResponse = 1, kRefusal = 2, kEvent = 3 };
enum class MmwaveLinkCrc : std::uint8_t { kNone, k16, k32, k64 };

struct SubBlock {
  std::uint16_t id = 0;            ///< message id * 32 + index
  std::vector<std::uint8_t> data;  ///< without id and length
};

struct MmwaveLinkMessage {
  MmwaveLinkDirection direction = MmwaveLinkDirection::kToFrontEnd;
  MmwaveLinkType type = MmwaveLinkType::kCommand;
  std::uint16_t message_id = 0;  ///< 10 bits
  bool retry = false;
  bool wants_acknowledgement = true;
  MmwaveLinkCrc crc = MmwaveLinkCrc::k32;
  std::uint8_t sequence = 0;  ///< 4 bits
  std::uint16_t remaining_chunks = 0;
  std::vector<SubBlock> sub_blocks;
};

struct MmwaveLinkHeader {
  std::uint16_t opcode = 0, length = 0, flags = 0, remaining_chunks = 0, sub_blocks = 0, checksum = 0;

  MmwaveLinkType type() const { return static_cast<MmwaveLinkType>(opcode >> 4 & 3); }
  std::uint16_t message_id() const { return opcode >> 6; }
  std::uint8_t sequence() const { return static_cast<std::uint8_t>(flags >> 12); }
  MmwaveLinkCrc crc() const;
  std::size_t crc_bytes() const;
};

/// RFC 1071: the complement of the one's complement sum of `count` words.
std::uint16_t internetChecksum(const std::uint16_t* words, std::size_t count);
/// CRC-32 of Ethernet and zlib.
std::uint32_t crc32(const std::uint8_t* bytes, std::size_t size);
/// CRC-16 with polynomial 0x1021 and initial value 0xFFFF, not reflected: that of the radar's first events after
/// power-up.
std::uint16_t crc16(const std::uint8_t* bytes, std::size_t size);

/// The message's bytes from SYNC to CRC. Throws std::length_error where it does not fit MSGLEN, std::invalid_argument
/// for a field beyond its bits or for a CRC-64, which this host never sends.
std::vector<std::uint8_t> encodeMessage(const MmwaveLinkMessage& message);

/// Reads the 12 bytes after SYNC. Nothing where checksum or length are wrong, as the length cannot be trusted then.
std::optional<MmwaveLinkHeader> decodeHeader(const std::uint8_t* bytes);

struct DecodedMessage {
  std::optional<MmwaveLinkMessage> message;
  std::string problem;  ///< reason where there is no message
};
/// Reads a message from its header to its CRC (`size` = MSGLEN bytes, without SYNC).
DecodedMessage decodeMessage(const std::uint8_t* bytes, std::size_t size);

}  // namespace mmradartwin
