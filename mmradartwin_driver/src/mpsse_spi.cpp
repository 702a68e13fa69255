#include "mmradartwin_driver/mpsse_spi.h"

#include <algorithm>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Vendor requests of FTDI's chips; the index is the port's number from 1.
constexpr std::uint8_t kRequestReset = 0x00;
constexpr std::uint8_t kRequestLatencyTimer = 0x09;
constexpr std::uint8_t kRequestBitMode = 0x0B;
constexpr std::uint16_t kResetPort = 0, kPurgeReceive = 1, kPurgeTransmit = 2;
constexpr std::uint16_t kLatency_ms = 1;
constexpr std::size_t kStatusBytes = 2;  // at the start of every packet

// Commands of the serial engine.
constexpr std::uint8_t kSetLowPins = 0x80, kGetLowPins = 0x81, kSendImmediate = 0x87;
constexpr std::uint8_t kClockOut = 0x11;  // bytes, most significant bit first, on the falling edge
constexpr std::uint8_t kClockIn = 0x20;   // bytes, most significant bit first, on the rising edge
constexpr std::uint8_t kUnknownCommand = 0xAA, kUnknownReply = 0xFA;

// Port A: b0 CLK, b1 MOSI, b2 MISO, b3 CS (active low), b6 PMIC_NRST (kept high), b7 NERROR_OUT.
constexpr std::uint8_t kSpiOutputs = 0x4B;
constexpr std::uint8_t kSpiIdle = 0xC8;
constexpr std::uint8_t kSpiSelect = 0xC0;
constexpr std::uint8_t kSpiSelectMosiHigh = 0xC2;
constexpr std::uint8_t kHostInterruptBit = 1 << 5;  // port B
constexpr std::uint8_t kResetOutputs = 0xC0;        // port C: b6 NRST, b7 WARMRST, both active low
constexpr std::uint8_t kWarmResetHigh = 0x80;
constexpr std::uint8_t kResetHigh = 0x40;
constexpr std::uint8_t kBootOutputs = 0x1C;     // port D: b2, b3, b4
constexpr std::uint8_t kBootFunctional = 0x10;  // 0, 0, 1
constexpr std::uint8_t kBootFlash = 0x14;       // 1, 0, 1
constexpr std::size_t kWordsPerRead = 256;      // half of the chip's buffer

void append(std::vector<std::uint8_t>& out, std::initializer_list<std::uint8_t> bytes) {
  out.insert(out.end(), bytes.begin(), bytes.end());
}

}  // namespace

void FtdiChannel::open(Mode mode, std::uint8_t outputs) {
  const auto index = static_cast<std::uint16_t>(channel_ + 1);
  usb_.vendorRequest(kRequestReset, kResetPort, index);
  usb_.vendorRequest(kRequestReset, kPurgeReceive, index);
  usb_.vendorRequest(kRequestReset, kPurgeTransmit, index);
  usb_.vendorRequest(kRequestLatencyTimer, kLatency_ms, index);
  usb_.vendorRequest(kRequestBitMode, 0, index);
  usb_.vendorRequest(kRequestBitMode, static_cast<std::uint16_t>(static_cast<unsigned>(mode) << 8 | outputs), index);
  received_.clear();
}

void FtdiChannel::write(const std::vector<std::uint8_t>& bytes) { usb_.write(channel_, bytes); }

bool FtdiChannel::receive(milliseconds timeout) {
  const std::vector<std::uint8_t> bytes = usb_.read(channel_, timeout);
  const std::size_t packet = usb_.packet_bytes();
  for (std::size_t at = 0; at < bytes.size(); at += packet) {
    const std::size_t end = std::min(at + packet, bytes.size());
    for (std::size_t i = at + kStatusBytes; i < end; ++i) received_.push_back(bytes[i]);
  }
  return !bytes.empty();
}

std::vector<std::uint8_t> FtdiChannel::read(std::size_t size, milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (received_.size() < size) {
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) {
      throw RigError(std::string("port ") + name() + " of the USB chip sent " + std::to_string(received_.size()) +
                     " of " + std::to_string(size) + " bytes within " + std::to_string(timeout.count()) +
                     " ms; plug the cable in J1 (RADAR_FTDI) in again");
    }
    receive(left);
  }
  const auto end = received_.begin() + static_cast<std::ptrdiff_t>(size);
  std::vector<std::uint8_t> bytes(received_.begin(), end);
  received_.erase(received_.begin(), end);
  return bytes;
}

void FtdiChannel::synchronise() {
  write({kUnknownCommand, kSendImmediate});
  const auto deadline = Clock::now() + std::chrono::seconds(1);
  for (;;) {
    const std::uint8_t reply[] = {kUnknownReply, kUnknownCommand};
    const auto found = std::search(received_.begin(), received_.end(), std::begin(reply), std::end(reply));
    if (found != received_.end()) {
      received_.erase(received_.begin(), found + 2);
      return;
    }
    const auto left = std::chrono::ceil<milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) break;
    receive(left);
  }
  throw RigError(std::string("port ") + name() +
                 " of the USB chip does not take serial commands (no answer FA AA); check that the cable is in J1 "
                 "(RADAR_FTDI), not in J4, and plug it in again");
}

FtdiRadarPort::FtdiRadarPort(UsbTransport& usb) : spi_(usb, 0), interrupt_(usb, 1), reset_(usb, 2), boot_(usb, 3) {
  spi_.open(FtdiChannel::Mode::kMpsse, 0);
  spi_.synchronise();
  // 60 MHz clock, no adaptive and no three-phase clocking, divisor 2: 60/((1 + 2) 2) = 10 MHz.
  spi_.write({0x8A, 0x97, 0x8D, 0x86, 0x02, 0x00, kSetLowPins, kSpiIdle, kSpiOutputs});
  interrupt_.open(FtdiChannel::Mode::kMpsse, 0);
  interrupt_.synchronise();
  interrupt_.write({kSetLowPins, 0x00, 0x00});
  reset_.open(FtdiChannel::Mode::kBitBang, kResetOutputs);
  boot_.open(FtdiChannel::Mode::kBitBang, kBootOutputs);
}

void FtdiRadarPort::setBootMode(BootMode mode) {
  boot_.write({mode == BootMode::kFlash ? kBootFlash : kBootFunctional});
}

void FtdiRadarPort::setReset(bool active) {
  reset_.write({static_cast<std::uint8_t>(active ? kWarmResetHigh : kWarmResetHigh | kResetHigh)});
}

void FtdiRadarPort::writeWords(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::uint8_t> batch;
  for (std::size_t at = 0; at + 1 < bytes.size(); at += 2) {
    append(batch, {kSetLowPins, kSpiSelect, kSpiOutputs, kClockOut, 0x01, 0x00, bytes[at + 1], bytes[at], kSetLowPins,
                   kSpiIdle, kSpiOutputs});
  }
  batch.push_back(kSendImmediate);
  spi_.write(batch);
}

std::vector<std::uint8_t> FtdiRadarPort::readWords(std::size_t words) {
  std::vector<std::uint8_t> bytes;
  while (words > 0) {
    const std::size_t now = std::min(words, kWordsPerRead);
    words -= now;
    std::vector<std::uint8_t> batch;
    for (std::size_t i = 0; i < now; ++i) {
      append(batch,
             {kSetLowPins, kSpiSelectMosiHigh, kSpiOutputs, kClockIn, 0x01, 0x00, kSetLowPins, kSpiIdle, kSpiOutputs});
    }
    batch.push_back(kSendImmediate);
    spi_.write(batch);
    const std::vector<std::uint8_t> wire = spi_.read(2 * now);
    for (std::size_t at = 0; at < wire.size(); at += 2) append(bytes, {wire[at + 1], wire[at]});
  }
  return bytes;
}

bool FtdiRadarPort::hostInterrupt() {
  interrupt_.write({kGetLowPins, kSendImmediate});
  return interrupt_.read(1)[0] & kHostInterruptBit;
}

}  // namespace mmradartwin
