#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "awr2243/awr2243_quantised.h"
#include "mmradartwin_driver/mmwavelink_frame.h"
#include "mmradartwin_driver/radar_control.h"

namespace mmradartwin {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "payloads are copied as they lie in memory");

/// Payloads of the radar's sub-blocks, byte by byte as sent (little endian, without id and length). Unnamed fields are
/// reserved and zero.
namespace awr2243 {

struct Channels {
  static constexpr std::uint16_t kId = 0x0080;
  std::uint16_t rx_mask = 0, tx_mask = 0, cascade = 0, cascade_pins = 0;
};
struct AdcOutput {
  static constexpr std::uint16_t kId = 0x0082;
  std::uint32_t format = 2 | 1 << 16;  ///< b1:0 16 bit, b15:8 no reduction of full scale, b17:16 complex 1x
  std::uint16_t reserved[2] = {};
};
struct LowPower {
  static constexpr std::uint16_t kId = 0x0083;
  std::uint16_t reserved = 0, low_power_adc = 0;
};
struct HighSpeedClock {
  static constexpr std::uint16_t kId = 0x0085;
  std::uint16_t code = 9;  ///< 600 Mbit/s, double data rate
  std::uint16_t reserved = 0;
};
struct RfDevice {
  static constexpr std::uint16_t kId = 0x0086;
  std::uint32_t event_direction = 1 | 1 << 2;  ///< faults and monitoring reports to the host
  std::uint8_t event_control = 0, analog_control = 0, reserved1 = 0, watchdog = 0;
  std::uint8_t event_crc = 1;  ///< 32 bit
  std::uint8_t reserved2 = 0;
  std::uint16_t reserved3 = 0;
};
struct SynthesizerBandwidth {
  static constexpr std::uint16_t kId = 0x008D;
  std::uint8_t synthesizer_icp = 3, synthesizer_rz = 8, apll_icp = 38, apll_rz_lowpass = 9, apll_rz_vco = 0;
  std::uint8_t reserved0 = 0;
  std::uint16_t reserved[5] = {};
};
struct Profile {
  static constexpr std::uint16_t kId = 0x0100;
  std::uint16_t profile = 0;
  std::uint8_t vco = 0, calibration_update = 0;
  std::uint32_t start_frequency = 0, idle = 0, adc_start = 0, ramp_end = 0;
  std::uint32_t tx_backoff_db = 0;  ///< one byte per transmitter
  std::uint32_t tx_phase = 0;
  std::int16_t slope = 0, tx_start = 0;
  std::uint16_t samples = 0, sample_rate_ksps = 0;
  std::uint8_t highpass1 = 0, highpass2 = 0;
  std::uint16_t tx_calibration = 0;
  std::uint16_t rx_gain = 0;  ///< b5:0 dB, b7:6 target of the RF gain, 2 = 36 dB
  std::uint16_t reserved = 0;
};
struct Chirp {
  static constexpr std::uint16_t kId = 0x0101;
  std::uint16_t first = 0, last = 0, profile = 0, reserved = 0;
  std::uint32_t frequency = 0;  ///< this and the next three are added to the profile's
  std::uint16_t slope = 0, idle = 0, adc_start = 0, tx_mask = 0;
};
struct Frame {
  static constexpr std::uint16_t kId = 0x0102;
  std::uint16_t reserved0 = 0, first_chirp = 0, last_chirp = 0, loops = 0;
  std::uint16_t frames = 0;      ///< 0: until stopped
  std::uint16_t half_words = 0;  ///< per chirp and receiver: 2 per complex sample
  std::uint32_t period = 0;      ///< 5 ns
  std::uint16_t trigger = 1;     ///< by software
  std::uint16_t reserved1 = 0;
  std::uint32_t trigger_delay = 0;  ///< 5 ns
};
struct FrameTrigger {
  static constexpr std::uint16_t kId = 0x0140;
  std::uint16_t start = 0, reserved = 0;
};
struct TestTarget {
  std::int16_t position_cm[3] = {}, velocity_cm_per_s[3] = {};
  std::uint16_t level = 0;                      ///< -0.1 dBFS
  std::int16_t min_cm[3] = {}, max_cm[3] = {};  ///< a target that crosses them starts again
};
struct TestSource {
  static constexpr std::uint16_t kId = 0x02C2;
  TestTarget targets[2];
  std::int8_t rx_position[4][2] = {};  ///< x and z in eighths of a wavelength
  std::uint32_t reserved0 = 0;
  std::uint16_t reserved1 = 0;
  std::uint8_t dither_off = 0, reserved2 = 0;
};
struct TestSourceEnable {
  static constexpr std::uint16_t kId = 0x02C3;
  std::uint16_t enable = 0, reserved = 0;
};
/// Bypass of the regulators. Only zeros are safe on the evaluation board: bypassing a regulator can destroy it.
struct RegulatorBypass {
  static constexpr std::uint16_t kId = 0x02CC;
  std::uint16_t bypass = 0;
  std::uint8_t supply_drop = 0, io_supply = 0;
};
struct DataFormat {
  static constexpr std::uint16_t kId = 0x4041;
  std::uint16_t rx_mask = 0, bits = 2, format = 1;  ///< 16 bit, complex
  std::uint8_t q_first = 0, not_interleaved = 0;
  std::uint32_t reserved = 0;
};
struct DataPath {
  static constexpr std::uint16_t kId = 0x4042;
  std::uint8_t interface = 1;  ///< LVDS
  std::uint8_t packet0 = 1;    ///< ADC samples only
  std::uint8_t packet1 = 0, quality_bits = 0, quality0 = 0, quality1 = 0, quality2 = 0, reserved = 0;
};
struct LaneEnable {
  static constexpr std::uint16_t kId = 0x4043;
  std::uint16_t lanes = 0xF, reserved = 0;
};
struct LaneClock {
  static constexpr std::uint16_t kId = 0x4044;
  std::uint8_t double_rate = 1, rate = 1;  ///< 600 Mbit/s
  std::uint16_t reserved = 0;
};
struct LvdsLanes {
  static constexpr std::uint16_t kId = 0x4045;
  std::uint16_t reversed = 0, parameters = 1;  ///< most significant bit first
};
struct TestPattern {
  static constexpr std::uint16_t kId = 0x404B;
  std::uint8_t enable = 0;
  std::uint8_t clocks = 0;  ///< of 200 MHz between samples
  std::uint16_t samples = 0;
  std::uint32_t packets = 0;  ///< 0: until disabled
  struct Ramp {
    std::uint16_t start = 0, increment = 0;
  };
  struct Receiver {
    Ramp i, q;
  };
  Receiver rx[4];
  std::uint32_t reserved = 0;
};
struct EventCrc {
  static constexpr std::uint16_t kId = 0x404C;
  std::uint8_t crc = 1, logger = 0;  ///< 32 bit
  std::uint16_t reserved0 = 0;
  std::uint32_t reserved1[2] = {};
};
struct FrameApply {
  static constexpr std::uint16_t kId = 0x40C0;
  std::uint32_t chirps = 0;
  std::uint16_t half_words = 0, reserved = 0;
};

static_assert(sizeof(Channels) == 8 && sizeof(AdcOutput) == 8 && sizeof(LowPower) == 4 && sizeof(HighSpeedClock) == 4);
static_assert(sizeof(RfDevice) == 12 && sizeof(SynthesizerBandwidth) == 16 && sizeof(Profile) == 44);
static_assert(sizeof(Chirp) == 20 && sizeof(Frame) == 24 && sizeof(FrameTrigger) == 4 && sizeof(FrameApply) == 8);
static_assert(sizeof(TestTarget) == 26 && sizeof(TestSource) == 68 && sizeof(TestSourceEnable) == 4);
static_assert(sizeof(RegulatorBypass) == 4 && sizeof(DataFormat) == 12 && sizeof(DataPath) == 8);
static_assert(sizeof(LaneEnable) == 4 && sizeof(LaneClock) == 4 && sizeof(LvdsLanes) == 4);
static_assert(sizeof(TestPattern) == 44 && sizeof(EventCrc) == 12);

/// Sub-blocks without a payload.
constexpr std::uint16_t kRfInit = 0x00C0;
constexpr std::uint16_t kFrontEndVersion = 0x0220;
constexpr std::uint16_t kRfPowerUp = 0x4000;
constexpr std::uint16_t kMainVersion = 0x40E0;
constexpr std::uint16_t kFileDownload = 0x4080;

/// Sub-blocks of asynchronous events.
constexpr std::uint16_t kFrontEndCpuFault = 0x1002;
constexpr std::uint16_t kFrontEndEsmFault = 0x1003;
constexpr std::uint16_t kInitCalibration = 0x1004;
constexpr std::uint16_t kFrameReady = 0x100B;
constexpr std::uint16_t kFrameEnd = 0x100F;
constexpr std::uint16_t kAnalogFault = 0x1010;
constexpr std::uint16_t kMainPowerUpDone = 0x5000;
constexpr std::uint16_t kRfPowerUpDone = 0x5001;
constexpr std::uint16_t kMainCpuFault = 0x5002;
constexpr std::uint16_t kMainEsmFault = 0x5003;
constexpr std::uint16_t kBootError = 0x5005;

template <class Payload>
SubBlock subBlock(const Payload& payload) {
  static_assert(std::is_trivially_copyable_v<Payload> && std::has_unique_object_representations_v<Payload>);
  SubBlock block{Payload::kId, std::vector<std::uint8_t>(sizeof payload)};
  std::memcpy(block.data.data(), &payload, sizeof payload);
  return block;
}

/// Command that carries one sub-block. Its message id is the sub-block's id / 32. Its direction is that of the
/// processor which owns the id (front end below 0x100, main processor from 0x200).
MmwaveLinkMessage command(const SubBlock& block);

Channels channels(const Awr2243Registers& registers);
DataFormat dataFormat(const Awr2243Registers& registers);
Profile profile(const Awr2243Registers& registers);
/// Chirps, one per slot, in the order in which they are sent.
std::vector<Chirp> chirps(const Awr2243Registers& registers);
Frame frame(const Awr2243Registers& registers);
FrameApply frameApply(const Awr2243Registers& registers);

/// Commands that write a firmware image to the radar's flash, in order. The image ends with its CRC-32, which is added
/// where `image` lacks it. Throws InputError for an empty image, or one of more chunks than REMCHUNKS can count.
std::vector<MmwaveLinkMessage> fileDownload(const std::vector<std::uint8_t>& image, const std::string& name);

/// The image with its CRC-32 at the end.
std::vector<std::uint8_t> withCrc(std::vector<std::uint8_t> image);

/// Event in one line for people, such as "RF calibration failed: TX power, RX gain (61 deg C)".
struct EventText {
  using Level = RadarEvent::Level;
  Level level = Level::kInfo;
  std::string text;
};
EventText describeEvent(const SubBlock& event);
/// Meaning of the error code of a refusal, such as "invalid data in a sub-block".
std::string describeError(std::uint16_t code);

struct Calibration {
  std::uint32_t done = 0, updated = 0;  ///< bits per calibration
  int temperature_deg_c = 0;
  std::uint32_t time_ms = 0;
};
/// Reads kInitCalibration's payload (20 bytes: u32 status, u32 update, u16 temperature, u16, u32 time, u32). False
/// where it is too short.
bool parseCalibration(const SubBlock& event, Calibration& calibration);

struct Version {
  std::uint8_t hardware_variant = 0, hardware_major = 0, hardware_minor = 0;
  std::uint8_t major = 0, minor = 0, build = 0, debug = 0, year = 0, month = 0, day = 0;
  std::string text() const;  ///< "2.2.4.1 (2021-06-30), hardware 5.1.1"
};
/// Reads the answer of kMainVersion or kFrontEndVersion (at least 10 bytes). False where it is too short.
bool parseVersion(const SubBlock& answer, Version& version);

}  // namespace awr2243
}  // namespace mmradartwin
