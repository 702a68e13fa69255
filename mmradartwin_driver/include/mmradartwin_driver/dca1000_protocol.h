#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// Protocol of the DCA1000EVM capture card: TI's "DCA1000EVM CLI Software Developer Guide" 1.01, section 2.4, and the
/// user guide SPRUIJ4A. Everything is little endian. Commands and replies travel on the command port, samples on the
/// data port; the card sends both from UDP source port 1024.
enum class Dca1000Command : std::uint16_t {
  kResetFpga = 0x01,
  kResetRadar = 0x02,
  kConfigFpga = 0x03,
  kRecordStart = 0x05,
  kRecordStop = 0x06,
  kSystemConnect = 0x09,
  kSystemStatus = 0x0a,  ///< unsolicited: the card reports status bits
  kConfigPacketData = 0x0b,
  kReadFpgaVersion = 0x0e,
};
/// Name as TI writes it, "0x1f" for codes that are not listed here.
std::string commandName(std::uint16_t code);

constexpr std::uint16_t kDca1000ConfigPort = 4096;
constexpr std::uint16_t kDca1000DataPort = 4098;

/// A5 5A
/// code
/// data size
/// data
/// EE AA; each field except the data has 16 bits.
std::vector<std::uint8_t> encodeCommand(Dca1000Command command, const std::vector<std::uint8_t>& data = {});

/// Body of CONFIG_FPGA: raw logging, LVDS capture over Ethernet, 16 bit samples.
/// lanes: 4 (AWR2243, xWR12xx/14xx) or 2 (xWR16xx/18xx/68xx).
std::vector<std::uint8_t> fpgaConfigBody(int lanes, int timer_s = 30);

/// Body of CONFIG_PACKET_DATA: size of a packet in bytes (the guide allows 48 to 1472), and the gap between packets in
/// ticks of the card of 8 ns.
std::vector<std::uint8_t> packetConfigBody(std::uint16_t packet_bytes, std::uint16_t delay_ticks);
/// Packet delay in the card's ticks, rounded. Throws InputError outside the range of 16 bits (0 to 524.28 us).
std::uint16_t packetDelayTicks(double delay_us);

/// Datagram of the card's command side: A55A
/// code
/// status
/// EEAA, always 8 bytes.
struct Dca1000Reply {
  std::uint16_t code = 0;
  std::uint16_t status = 0;  ///< 0 done, 1 failed; version or status bits for the two commands that return those
};
/// Decodes a reply. Nothing where the bytes are no reply; longer datagrams (Ethernet padding) are refused too.
std::optional<Dca1000Reply> decodeReply(const std::uint8_t* bytes, std::size_t size);

struct FpgaVersion {
  int major = 0, minor = 0;
  bool playback = false;
};
FpgaVersion decodeFpgaVersion(std::uint16_t status);
/// Version in words, such as "FPGA 2.8".
std::string describeVersion(const FpgaVersion& version);
/// What to do about a card with this FPGA; empty for versions 2.7 to 2.9, for which this driver was written.
std::string versionAdvice(const FpgaVersion& version);

/// Bits of kSystemStatus (Developer Guide, table 4).
enum Dca1000Status : std::uint16_t {
  kNoLvdsData = 1u << 0,
  kNoHeader = 1u << 1,
  kEepromFailure = 1u << 2,
  kSdDetected = 1u << 3,
  kSdRemoved = 1u << 4,
  kSdFull = 1u << 5,
  kModeConfigFailure = 1u << 6,
  kDdrFull = 1u << 7,
  kRecordCompleted = 1u << 8,
  kLvdsBufferFull = 1u << 9,
  kPlaybackOutOfSequence = 1u << 10,
  kPlaybackCompleted = 1u << 11,
};
/// Status bits after which the card has dropped samples without a gap in its counts: every later byte is at a wrong
/// position of the frames until the recording is armed again.
constexpr std::uint16_t kFatalStatus = kDdrFull | kLvdsBufferFull;
/// Names of the status bits, such as "DDR_FULL, REC_COMPLETED"; "none" for 0.
std::string describeStatus(std::uint16_t bits);

/// Header of a data datagram: sequence number (from 1) and number of sample bytes sent before it (from 0).
constexpr std::size_t kDataHeaderBytes = 10;
struct DataPacket {
  std::uint32_t sequence = 0;
  std::uint64_t byte_count = 0;           ///< 48 bit: offset of payload[0] in the recording
  const std::uint8_t* payload = nullptr;  ///< not owned
  std::size_t size = 0;                   ///< bytes of payload, without padding
  std::int64_t stamp_ns = 0;              ///< receive time
};
/// Views the datagram's bytes. Nothing where it is too short for a header and one sample byte.
std::optional<DataPacket> decodeDataPacket(const std::uint8_t* bytes, std::size_t size, std::int64_t stamp_ns);

}  // namespace mmradartwin
