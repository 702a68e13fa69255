#include "mmradartwin_driver/dca1000_protocol.h"

#include <cmath>
#include <cstdio>
#include <utility>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::uint16_t kHead = 0xa55a, kFoot = 0xeeaa;
constexpr std::size_t kReplyBytes = 8;

void append16(std::vector<std::uint8_t>& out, std::uint16_t value) {
  out.push_back(value & 0xff);
  out.push_back(value >> 8);
}

std::uint16_t read16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] | p[1] << 8); }

std::string hex(unsigned value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%02x", value);
  return text;
}

}  // namespace

std::string commandName(std::uint16_t code) {
  switch (static_cast<Dca1000Command>(code)) {
    case Dca1000Command::kResetFpga:
      return "RESET_FPGA";
    case Dca1000Command::kResetRadar:
      return "RESET_AR_DEV";
    case Dca1000Command::kConfigFpga:
      return "CONFIG_FPGA_GEN";
    case Dca1000Command::kRecordStart:
      return "RECORD_START";
    case Dca1000Command::kRecordStop:
      return "RECORD_STOP";
    case Dca1000Command::kSystemConnect:
      return "SYSTEM_CONNECT";
    case Dca1000Command::kSystemStatus:
      return "SYSTEM_ERROR";
    case Dca1000Command::kConfigPacketData:
      return "CONFIG_PACKET_DATA";
    case Dca1000Command::kReadFpgaVersion:
      return "READ_FPGA_VERSION";
  }
  return hex(code);
}

std::vector<std::uint8_t> encodeCommand(Dca1000Command command, const std::vector<std::uint8_t>& data) {
  std::vector<std::uint8_t> out;
  out.reserve(8 + data.size());
  append16(out, kHead);
  append16(out, static_cast<std::uint16_t>(command));
  append16(out, static_cast<std::uint16_t>(data.size()));
  out.insert(out.end(), data.begin(), data.end());
  append16(out, kFoot);
  return out;
}

std::vector<std::uint8_t> fpgaConfigBody(int lanes, int timer_s) {
  constexpr std::uint8_t kRawLogging = 1, kCapture = 1, kEthernet = 2, k16Bit = 3;
  if (lanes != 2 && lanes != 4) throw InputError("DCA1000: " + std::to_string(lanes) + " LVDS lanes: must be 2 or 4");
  if (timer_s < 0 || timer_s > 255) {
    throw InputError("DCA1000: timer of " + std::to_string(timer_s) + " s: must be 0 to 255");
  }
  return {kRawLogging, static_cast<std::uint8_t>(lanes == 4 ? 1 : 2),
          kCapture,    kEthernet,
          k16Bit,      static_cast<std::uint8_t>(timer_s)};
}

std::vector<std::uint8_t> packetConfigBody(std::uint16_t packet_bytes, std::uint16_t delay_ticks) {
  std::vector<std::uint8_t> out;
  append16(out, packet_bytes);
  append16(out, delay_ticks);
  append16(out, 0);
  return out;
}

std::uint16_t packetDelayTicks(double delay_us) {
  constexpr double kTicksPer_us = 125.0;  // 8 ns
  const double ticks = std::round(delay_us * kTicksPer_us);
  if (!(ticks >= 0 && ticks <= 65535)) {
    throw InputError("DCA1000: packet_delay_us " + std::to_string(delay_us) + ": must be 0 to 524.28");
  }
  return static_cast<std::uint16_t>(ticks);
}

std::optional<Dca1000Reply> decodeReply(const std::uint8_t* bytes, std::size_t size) {
  if (size != kReplyBytes || read16(bytes) != kHead || read16(bytes + 6) != kFoot) return std::nullopt;
  return Dca1000Reply{read16(bytes + 2), read16(bytes + 4)};
}

FpgaVersion decodeFpgaVersion(std::uint16_t status) {
  return {status & 0x7f, status >> 7 & 0x7f, (status >> 14 & 1) != 0};
}

std::string describeVersion(const FpgaVersion& version) {
  return "FPGA " + std::to_string(version.major) + "." + std::to_string(version.minor) +
         (version.playback ? ", the playback image" : "");
}

std::string versionAdvice(const FpgaVersion& version) {
  if (version.playback) return "load TI's record image into the FPGA: this one only plays back";
  if (version.major == 2 && version.minor >= 7 && version.minor <= 9) return "";
  return "the driver is made after FPGA 2.7 to 2.9: load one of these if samples look wrong";
}

std::string describeStatus(std::uint16_t bits) {
  static const std::pair<std::uint16_t, const char*> kNames[] = {
      {kNoLvdsData, "NO_LVDS_DATA"},
      {kNoHeader, "NO_HEADER"},
      {kEepromFailure, "EEPROM_FAILURE"},
      {kSdDetected, "SD_DETECTED"},
      {kSdRemoved, "SD_REMOVED"},
      {kSdFull, "SD_FULL"},
      {kModeConfigFailure, "MODE_CONFIG_FAILURE"},
      {kDdrFull, "DDR_FULL"},
      {kRecordCompleted, "REC_COMPLETED"},
      {kLvdsBufferFull, "LVDS_BUFFER_FULL"},
      {kPlaybackOutOfSequence, "PLAYBACK_OUT_OF_SEQUENCE"},
      {kPlaybackCompleted, "PLAYBACK_COMPLETED"},
  };
  std::string text;
  std::uint16_t named = 0;
  for (const auto& [bit, name] : kNames) {
    named |= bit;
    if (bits & bit) text += (text.empty() ? "" : ", ") + std::string(name);
  }
  if (bits & ~named) text += (text.empty() ? "" : ", ") + hex(bits & static_cast<std::uint16_t>(~named));
  return text.empty() ? "none" : text;
}

std::optional<DataPacket> decodeDataPacket(const std::uint8_t* bytes, std::size_t size, std::int64_t stamp_ns) {
  if (size <= kDataHeaderBytes) return std::nullopt;
  DataPacket packet;
  for (int i = 3; i >= 0; --i) packet.sequence = packet.sequence << 8 | bytes[i];
  for (int i = 9; i >= 4; --i) packet.byte_count = packet.byte_count << 8 | bytes[i];
  packet.payload = bytes + kDataHeaderBytes;
  packet.size = size - kDataHeaderBytes;
  packet.stamp_ns = stamp_ns;
  return packet;
}

}  // namespace mmradartwin
