#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// Reads `size` bytes of a file from `offset` on; false beyond its end.
using ReadBytes = std::function<bool(std::size_t offset, std::size_t size, std::uint8_t* out)>;

/// Samples that stand together in a file.
struct PayloadPiece {
  std::size_t begin, end;  ///< in the stream of samples
  std::size_t at;          ///< of its first byte in the file
};

/// Heads that someone left between the samples.
struct PacketHeads {
  std::string what;                  ///< in words
  std::vector<PayloadPiece> pieces;  ///< in order; between them is what was lost
  std::size_t size = 0;              ///< of the stream of samples
  std::size_t lost_bytes = 0;
  std::size_t heads = 0;
};

/// Finds heads by the fields that count: of the card's datagrams (u32 number, u48 bytes before), of the card's
/// command-line tool (u32 number, u32 size, u48 bytes before), and TI's headers of the LVDS stream, which begin with
/// one id. Throws InputError where heads are there whose payload cannot be placed.
std::optional<PacketHeads> findPacketHeads(const ReadBytes& read, std::size_t file_size, std::size_t bytes_per_chirp);

}  // namespace mmradartwin
