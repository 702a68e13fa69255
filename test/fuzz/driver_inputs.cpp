#include <algorithm>
#include <cstring>

#include "awr2243/awr2243_control.h"
#include "awr2243/awr2243_messages.h"
#include "hostile_input.h"
#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/mmwavelink_frame.h"
#include "mmradartwin_driver/mpsse_spi.h"
#include "mmradartwin_driver/pcap_capture.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin {
namespace {

const std::uint8_t* bytesOf(const std::string& text) { return reinterpret_cast<const std::uint8_t*>(text.data()); }

RadarConfig smallRadar() {  // 512 bytes per frame
  RadarConfig radar = paperRadar();
  radar.samples_per_chirp = 16;
  return radar;
}

void readDatagram(const std::string& bytes) {
  const auto packet = decodeDataPacket(bytesOf(bytes), bytes.size(), 0);
  if (packet && packet->payload + packet->size != bytesOf(bytes) + bytes.size()) {
    throw std::logic_error("the payload is not the rest of the datagram");
  }
  if (const auto reply = decodeReply(bytesOf(bytes), bytes.size())) {
    commandName(reply->code);
    describeStatus(reply->status);
    decodeFpgaVersion(reply->status);
  }
}

/// Datagrams one after the other: [milliseconds since the last one][size, 2 bytes][the datagram]; size 0xffff arms
/// anew, 0xfffe flushes.
void readStream(const std::string& bytes) {
  std::uint64_t handed_out = 0, given = 0;
  std::int64_t last = -1;
  std::uint64_t epoch = 1;
  const FrameAssembler* counted = nullptr;
  FrameAssembler assembler(smallRadar(), [&](AdcCube&& cube) {
    if (counted->counters().epochs != epoch) last = -1;
    epoch = counted->counters().epochs;
    if (static_cast<std::int64_t>(cube.sequence) <= last) throw std::logic_error("frames out of order");
    last = cube.sequence;
    handed_out += 512 - cube.lost_bytes;
  });
  counted = &assembler;
  std::int64_t now_ns = 1'000'000'000;
  for (std::size_t at = 0; at + 3 <= bytes.size();) {
    now_ns += static_cast<std::uint8_t>(bytes[at]) * 1'000'000LL;
    const std::size_t size = static_cast<std::uint8_t>(bytes[at + 1]) | static_cast<std::uint8_t>(bytes[at + 2]) << 8;
    at += 3;
    if (size == 0xffff) {
      assembler.restart();
    } else if (size == 0xfffe) {
      assembler.flush();
    } else {
      const std::size_t there = std::min(size, bytes.size() - at);
      if (const auto packet = decodeDataPacket(bytesOf(bytes) + at, there, now_ns)) {
        given += packet->size;
        assembler.add(*packet);
      }
      at += there;
    }
  }
  assembler.flush();
  if (handed_out > given || assembler.counters().bytes > given) throw std::logic_error("more bytes than were given");
}

void readPackets(const std::string& bytes) {
  const std::string file = inputFolder() + "/packets.pcap";
  writeInput(file, bytes);
  refusing([&] { pcapToCapture(file, smallRadar(), inputFolder() + "/packets.bin"); });
}

/// The bytes as they are, and once more with checksum and CRC put right, which a changed message would fail otherwise.
void readMessage(const std::string& bytes) {
  const auto describe = [](const std::vector<std::uint8_t>& message) {
    const DecodedMessage decoded = decodeMessage(message.data(), message.size());
    if (!decoded.message) return;
    for (const SubBlock& block : decoded.message->sub_blocks) {
      awr2243::describeEvent(block);
      awr2243::Calibration calibration;
      awr2243::parseCalibration(block, calibration);
      awr2243::Version version;
      if (awr2243::parseVersion(block, version)) version.text();
    }
    if (decoded.message->crc != MmwaveLinkCrc::k64) encodeMessage(*decoded.message);
  };
  std::vector<std::uint8_t> message(bytesOf(bytes), bytesOf(bytes) + std::min<std::size_t>(bytes.size(), 252));
  describe(message);
  if (message.size() < kMmwaveLinkHeaderBytes) return;
  message[2] = static_cast<std::uint8_t>(message.size());
  message[3] = 0;
  std::uint16_t words[5];
  std::memcpy(words, message.data(), sizeof words);
  const std::uint16_t checksum = internetChecksum(words, 5);
  std::memcpy(&message[10], &checksum, 2);
  if (const auto header = decodeHeader(message.data())) {
    const std::size_t end = message.size() - header->crc_bytes();
    if (header->crc() == MmwaveLinkCrc::k32) {
      const std::uint32_t crc = crc32(message.data(), end);
      std::memcpy(&message[end], &crc, 4);
    } else if (header->crc() == MmwaveLinkCrc::k16) {
      const std::uint16_t crc = crc16(message.data(), end);
      std::memcpy(&message[end], &crc, 2);
    }
  }
  describe(message);
}

/// A chip that answers with the given bytes, in transfers of the given sizes, and is unplugged after them.
class RecordedUsb : public UsbTransport {
 public:
  explicit RecordedUsb(const std::string& bytes) : bytes_(bytes) {}
  void vendorRequest(std::uint8_t, std::uint16_t, std::uint16_t) override {}
  void write(int, const std::vector<std::uint8_t>&) override {}
  std::vector<std::uint8_t> read(int, std::chrono::milliseconds) override {
    if (at_ >= bytes_.size()) throw RigError("unplugged");
    const std::size_t size = std::min<std::size_t>(static_cast<std::uint8_t>(bytes_[at_]), bytes_.size() - at_ - 1);
    const std::uint8_t* from = bytesOf(bytes_) + at_ + 1;
    at_ += 1 + size;
    return {from, from + size};
  }
  std::size_t packet_bytes() const override { return 64; }

 private:
  const std::string& bytes_;
  std::size_t at_ = 0;
};

void readUsb(const std::string& bytes) {
  RecordedUsb usb(bytes);
  try {
    FtdiRadarPort port(usb);
    Awr2243Control::Options options;
    // What the interrupt line does is in the bytes; only time-outs of nothing keep the clock out of it.
    options.answer_timeout = options.first_chunk_timeout = options.interrupt_fall_timeout = options.power_up_timeout =
        options.boot_error_wait = options.calibration_timeout = options.reset_pulse = std::chrono::milliseconds(0);
    Awr2243Control control(port, nullptr, options);
    while (true) {
      control.poll();
      control.version();
    }
  } catch (const RigError&) {
  }
}

std::string little(std::uint64_t value, std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>(value >> 8 * i);
  return bytes;
}

std::string datagram(std::uint32_t sequence, std::uint64_t count, std::size_t size) {
  return little(sequence, 4) + little(count, 6) + std::string(size, static_cast<char>(sequence));
}

std::string record(const std::string& datagram, int gap_ms = 0) {
  return static_cast<char>(gap_ms) + little(datagram.size(), 2) + datagram;
}

std::string big16(std::size_t value) { return {static_cast<char>(value >> 8), static_cast<char>(value)}; }

std::string ethernet(const std::string& payload, std::uint16_t port) {
  std::string frame(12, '\x12');
  frame +=
      big16(0x0800) + std::string("\x45\0", 2) + big16(28 + payload.size()) + std::string("\0\0\x40\0\xff\x11\0\0", 8);
  frame += std::string("\xc0\xa8\x21\xb4\xc0\xa8\x21\x1e", 8) + big16(1024) + big16(port) + big16(8 + payload.size());
  return frame + std::string(2, '\0') + payload;
}

std::string pcapHeader() {
  return little(0xa1b23c4d, 4) + little(2, 2) + little(4, 2) + little(0, 8) + little(65535, 4) + little(1, 4);
}

std::string pcapRecord(const std::string& frame, std::uint32_t seconds) {
  return little(seconds, 4) + little(5, 4) + little(frame.size(), 4) + little(frame.size(), 4) + frame;
}

std::string pcap() {
  std::string bytes = pcapHeader() + pcapRecord(ethernet(std::string("\x5a\xa5\x05\0\0\0\xaa\xee", 8), 4096), 1);
  for (std::uint32_t i = 0; i < 6; ++i) bytes += pcapRecord(ethernet(datagram(i + 1, i * 300, 300), 4098), 2 + i);
  return bytes;
}

std::string pcapng() {
  std::string bytes = little(0x0a0d0d0a, 4) + little(28, 4) + little(0x1a2b3c4d, 4) + little(1, 4) +
                      std::string(8, '\xff') + little(28, 4);
  bytes += little(1, 4) + little(20, 4) + little(1, 4) + little(65535, 4) + little(20, 4);
  for (std::uint32_t i = 0; i < 3; ++i) {
    std::string frame = ethernet(datagram(i + 1, i * 512, 512), 4098);
    const std::size_t size = frame.size();
    frame.resize((size + 3) / 4 * 4);
    bytes += little(6, 4) + little(32 + frame.size(), 4) + little(0, 4) + little(0, 4) + little(i, 4) +
             little(size, 4) + little(size, 4) + frame + little(32 + frame.size(), 4);
  }
  return bytes;
}

std::string message(std::uint16_t id, std::size_t size, MmwaveLinkCrc crc) {
  MmwaveLinkMessage event;
  event.direction = MmwaveLinkDirection::kFromMain;
  event.type = MmwaveLinkType::kEvent;
  event.message_id = id / 32;
  event.crc = crc;
  event.sub_blocks = {{id, std::vector<std::uint8_t>(size, 1)}};
  const std::vector<std::uint8_t> bytes = encodeMessage(event);
  return std::string(bytes.begin() + kMmwaveLinkSyncBytes, bytes.end());
}

/// Transfers that bring the chip up, say that the radar has something to say, and say it.
std::string usb(const std::string& message) {
  const auto transfer = [](const std::string& data) {
    return std::string(1, static_cast<char>(2 + data.size())) + std::string("\x32\x60", 2) + data;
  };
  std::string bytes = transfer("\xfa\xaa") + transfer("\xfa\xaa") + transfer("\x20") + transfer("\x20") +
                      transfer(std::string(1, '\0'));
  std::string swapped = "\xdc\xba\xab\xcd" + message;
  for (std::size_t i = 4; i + 1 < swapped.size(); i += 2) std::swap(swapped[i], swapped[i + 1]);
  for (std::size_t i = 0; i < swapped.size(); i += 16) bytes += transfer(swapped.substr(i, 16));
  return bytes + transfer(std::string(1, '\0'));
}

}  // namespace

std::vector<HostileInput> hostileInputs() {
  std::string stream, restarts;
  for (std::uint32_t i = 0; i < 12; ++i) stream += record(datagram(i + 1, i * 100, 100), 1);
  for (std::uint32_t i = 0; i < 6; ++i) restarts += record(datagram(i % 3 + 1, i % 3 * 400, 400), i % 3 ? 1 : 60);
  // Far ahead, and one of the four that confirm it comes with the count of the one before.
  std::string far_ahead;
  const std::uint64_t far = std::uint64_t{1} << 40;
  for (const auto& [sequence, count] : {std::pair{1u, far}, {2u, far + 257}, {3u, far + 257}, {4u, far + 2000}}) {
    far_ahead += record(datagram(sequence, count, 100 * sequence), 1);
  }
  const std::string calibration = message(awr2243::kInitCalibration, 20, MmwaveLinkCrc::k32);
  return {
      {"datagram", readDatagram, {datagram(1, 0, 64), std::string("\x5a\xa5\x0a\0\0\1\xaa\xee", 8)}},
      {"stream", readStream, {stream, restarts, far_ahead, stream + std::string("\0\xff\xff", 3) + restarts}},
      {"pcap", readPackets, {pcap(), pcapng()}},
      {"message", readMessage, {calibration, message(awr2243::kMainVersion, 12, MmwaveLinkCrc::k16)}},
      {"mpsse", readUsb, {usb(calibration), usb(message(awr2243::kMainPowerUpDone, 8, MmwaveLinkCrc::k16))}},
  };
}

}  // namespace mmradartwin
