#include "capture_check/packet_heads.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kDatagramHead = 10;      ///< u32 number, u48 bytes before
constexpr std::size_t kRecordHead = 14;        ///< u32 number, u32 payload's size, u48 bytes before
constexpr std::size_t kLargestPayload = 1500;  ///< of a datagram
constexpr std::size_t kLargestLvdsHead = 512;
/// More packets than that are not missing between two that follow each other in a recording.
constexpr std::uint64_t kMostMissing = 1000000;

std::uint64_t unsignedAt(const std::uint8_t* bytes, std::size_t size) {
  std::uint64_t value = 0;
  for (std::size_t i = size; i-- > 0;) value = value << 8 | bytes[i];
  return value;
}

struct Head {
  std::uint64_t number = 0, before = 0;
  std::size_t size = 0;  ///< of the payload; 0 where the head does not say
};

std::optional<Head> headAt(const ReadBytes& read, std::size_t at, std::size_t length) {
  std::array<std::uint8_t, kRecordHead> bytes = {};
  if (!read(at, length, bytes.data())) return std::nullopt;
  Head head;
  head.number = unsignedAt(bytes.data(), 4);
  if (length == kRecordHead) head.size = static_cast<std::size_t>(unsignedAt(bytes.data() + 4, 4));
  head.before = unsignedAt(bytes.data() + length - 6, 6);
  return head;
}

/// True where `next` follows a packet of `payload` bytes, or one some packets before.
bool follows(const Head& head, const Head& next, std::size_t payload) {
  if (next.number <= head.number || next.number - head.number > kMostMissing) return false;
  return next.before == head.before + (next.number - head.number) * payload;
}

/// Bytes of payload of each packet but the last: the first size at which the fields of the next head count on.
std::size_t payloadSize(const ReadBytes& read, std::size_t file_size, std::size_t length) {
  const std::optional<Head> first = headAt(read, 0, length);
  if (!first) return 0;
  const auto fits = [&](std::size_t payload) {
    // A file of one packet alone has only its own fields to be known by: the first number, and nothing before it.
    const std::size_t whole = file_size - length;
    if (payload == whole) return length == kRecordHead && first->number <= 1 && first->before == 0;
    Head head = *first;
    for (std::size_t at = length + payload, heads = 1; heads < 4; at += length + payload, ++heads) {
      const std::optional<Head> next = headAt(read, at, length);
      if (!next) return heads > 1 || at == file_size;
      if (!follows(head, *next, payload)) return false;
      head = *next;
    }
    return true;
  };
  if (length == kRecordHead) {
    return first->size >= 16 && first->size <= kLargestPayload && length + first->size <= file_size && fits(first->size)
               ? first->size
               : 0;
  }
  for (std::size_t payload = 16; payload <= kLargestPayload && length + payload < file_size; ++payload) {
    if (fits(payload)) return payload;
  }
  return 0;
}

std::optional<PacketHeads> countingHeads(const ReadBytes& read, std::size_t file_size, std::size_t length) {
  const std::size_t payload = payloadSize(read, file_size, length);
  if (payload == 0) return std::nullopt;
  PacketHeads found;
  const std::uint64_t first = headAt(read, 0, length)->before;
  for (std::size_t at = 0; at + length < file_size;) {
    const std::optional<Head> head = headAt(read, at, length);
    const std::size_t rest = file_size - at - length;
    const std::size_t size = std::min(rest, head->size > 0 ? head->size : payload);
    const bool placed = head->before >= first + found.size && size <= kLargestPayload &&
                        head->before - first - found.size <= kMostMissing * payload;
    if (!placed) {
      throw InputError("has packet heads whose count breaks off at byte " + std::to_string(at) +
                       "; take the capture from its pcap (pcap_to_capture), or record it anew");
    }
    const auto begin = static_cast<std::size_t>(head->before - first);
    found.lost_bytes += begin - found.size;
    found.pieces.push_back({begin, begin + size, at + length});
    found.size = begin + size;
    ++found.heads;
    at += length + size;
  }
  found.what = std::to_string(found.heads) + " packet heads of " + std::to_string(length) + " bytes (number" +
               (length == kRecordHead ? ", size" : "") + ", bytes before), each before " + std::to_string(payload) +
               " bytes of samples";
  return found;
}

/// Ids that TI's HSI headers begin with, as the two lanes and as four lanes bring their 16-bit words into the file.
std::vector<std::array<std::uint8_t, 8>> lvdsIds() {
  std::vector<std::array<std::uint8_t, 8>> ids;
  for (const std::uint64_t id : {0x0CDA0ADC0CDA0ADCull, 0x0ADC0CDA0ADC0CDAull, 0x09CC0CC909CC0CC9ull}) {
    for (const auto& order : {std::array<int, 4>{0, 1, 2, 3}, {0, 2, 1, 3}}) {
      std::array<std::uint8_t, 8> bytes = {};
      for (std::size_t word = 0; word < 4; ++word) {
        const auto value = static_cast<std::uint16_t>(id >> (16 * order[word]));
        bytes[2 * word] = static_cast<std::uint8_t>(value);
        bytes[2 * word + 1] = static_cast<std::uint8_t>(value >> 8);
      }
      ids.push_back(bytes);
    }
  }
  return ids;
}

std::optional<PacketHeads> lvdsHeads(const ReadBytes& read, std::size_t file_size, std::size_t bytes_per_chirp) {
  std::array<std::uint8_t, 8> begin = {};
  if (!read(0, begin.size(), begin.data())) return std::nullopt;
  const auto ids = lvdsIds();
  if (std::find(ids.begin(), ids.end(), begin) == ids.end()) return std::nullopt;
  const auto isId = [&](std::size_t at) {
    std::array<std::uint8_t, 8> bytes = {};
    return read(at, bytes.size(), bytes.data()) && bytes == begin;
  };
  std::size_t head = 0;
  for (std::size_t length = 16; length <= kLargestLvdsHead && head == 0; length += 2) {
    if (length + bytes_per_chirp == file_size || isId(length + bytes_per_chirp)) head = length;
  }
  if (head == 0) {
    throw InputError("begins with a header of TI's LVDS stream (id 0x0CDA0ADC...), and none follows after a chirp of " +
                     std::to_string(bytes_per_chirp) +
                     " bytes; correct samples_per_chirp and the receivers in radar.yaml, or stream without header");
  }
  PacketHeads found;
  for (std::size_t at = 0; at + head < file_size; at += head + bytes_per_chirp) {
    if (!isId(at)) {
      throw InputError("has LVDS headers whose row breaks off at byte " + std::to_string(at) +
                       "; record it without header, or cut it there");
    }
    const std::size_t size = std::min(bytes_per_chirp, file_size - at - head);
    found.pieces.push_back({found.size, found.size + size, at + head});
    found.size += size;
    ++found.heads;
  }
  found.what = std::to_string(found.heads) + " LVDS headers (TI's HSI) of " + std::to_string(head) +
               " bytes, one before each chirp";
  return found;
}

}  // namespace

std::optional<PacketHeads> findPacketHeads(const ReadBytes& read, std::size_t file_size, std::size_t bytes_per_chirp) {
  if (std::optional<PacketHeads> heads = lvdsHeads(read, file_size, bytes_per_chirp)) return heads;
  if (std::optional<PacketHeads> heads = countingHeads(read, file_size, kRecordHead)) return heads;
  return countingHeads(read, file_size, kDatagramHead);
}

}  // namespace mmradartwin
