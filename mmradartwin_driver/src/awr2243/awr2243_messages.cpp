#include "awr2243/awr2243_messages.h"

#include <algorithm>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace awr2243 {
namespace {

constexpr std::size_t kChunkBytes = kMmwaveLinkMaxPayload - 4;  // 232
constexpr std::uint32_t kFileMetaImage = 4;
constexpr unsigned kRfGainTarget36db = 2;

std::uint32_t u32(const std::vector<std::uint8_t>& data, std::size_t at) {
  return data[at] | data[at + 1] << 8 | data[at + 2] << 16 | static_cast<std::uint32_t>(data[at + 3]) << 24;
}

void put32(std::vector<std::uint8_t>& data, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8) data.push_back(static_cast<std::uint8_t>(value >> shift));
}

std::string hexBytes(const std::vector<std::uint8_t>& data) {
  static const char digits[] = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : data) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

EventText describeCalibration(const SubBlock& event) {
  static const char* const names[] = {"",
                                      "APLL",
                                      "synthesizer VCO1",
                                      "synthesizer VCO2",
                                      "LO distribution",
                                      "ADC offset",
                                      "high-pass corner",
                                      "low-pass corner",
                                      "peak detector",
                                      "TX power",
                                      "RX gain",
                                      "TX phase",
                                      "RX I/Q mismatch"};
  Calibration calibration;
  if (!parseCalibration(event, calibration)) return {EventText::Level::kError, "RF calibration: report too short"};
  std::string failed;
  for (unsigned bit = 1; bit < sizeof names / sizeof *names; ++bit) {
    const bool updated = calibration.updated >> bit & 1;
    if (updated && !(calibration.done >> bit & 1)) failed += (failed.empty() ? "" : ", ") + std::string(names[bit]);
  }
  const std::string temperature = " (" + std::to_string(calibration.temperature_deg_c) + " deg C)";
  if (failed.empty()) return {EventText::Level::kInfo, "RF calibration done" + temperature};
  return {EventText::Level::kError, "RF calibration failed: " + failed + temperature};
}

}  // namespace

MmwaveLinkMessage command(const SubBlock& block) {
  MmwaveLinkMessage message;
  message.message_id = block.id / 32;
  message.direction = message.message_id < 0x100 ? MmwaveLinkDirection::kToFrontEnd : MmwaveLinkDirection::kToMain;
  message.sub_blocks = {block};
  return message;
}

Channels channels(const Awr2243Registers& registers) {
  Channels channels;
  channels.rx_mask = registers.rx_mask;
  channels.tx_mask = registers.tx_mask();
  return channels;
}

DataFormat dataFormat(const Awr2243Registers& registers) {
  DataFormat format;
  format.rx_mask = registers.rx_mask;
  format.q_first = registers.q_first ? 1 : 0;
  return format;
}

Profile profile(const Awr2243Registers& registers) {
  Profile profile;
  profile.start_frequency = registers.start_frequency;
  profile.idle = registers.idle;
  profile.adc_start = registers.adc_start;
  profile.ramp_end = registers.ramp_end;
  for (int tx = 0; tx < 3; ++tx) {
    if (registers.tx_mask() >> tx & 1) {
      profile.tx_backoff_db |= static_cast<std::uint32_t>(registers.tx_backoff_db) << 8 * tx;
    }
  }
  profile.slope = registers.slope;
  profile.samples = registers.samples;
  profile.sample_rate_ksps = registers.sample_rate_ksps;
  profile.highpass1 = registers.highpass1;
  profile.highpass2 = registers.highpass2;
  profile.rx_gain = static_cast<std::uint16_t>(registers.rx_gain_db | kRfGainTarget36db << 6);
  return profile;
}

std::vector<Chirp> chirps(const Awr2243Registers& registers) {
  std::vector<Chirp> chirps;
  for (std::size_t slot = 0; slot < registers.chirp_tx_mask.size(); ++slot) {
    Chirp chirp;
    chirp.first = chirp.last = static_cast<std::uint16_t>(slot);
    chirp.tx_mask = registers.chirp_tx_mask[slot];
    chirps.push_back(chirp);
  }
  return chirps;
}

Frame frame(const Awr2243Registers& registers) {
  Frame frame;
  frame.last_chirp = static_cast<std::uint16_t>(registers.chirp_tx_mask.size() - 1);
  frame.loops = registers.loops;
  frame.half_words = static_cast<std::uint16_t>(2 * registers.samples);
  frame.period = registers.frame_period;
  return frame;
}

FrameApply frameApply(const Awr2243Registers& registers) {
  FrameApply apply;
  apply.chirps = registers.loops * static_cast<std::uint32_t>(registers.chirp_tx_mask.size());
  apply.half_words = static_cast<std::uint16_t>(2 * registers.samples);
  return apply;
}

std::vector<std::uint8_t> withCrc(std::vector<std::uint8_t> image) {
  if (image.size() > 4 && crc32(image.data(), image.size() - 4) == u32(image, image.size() - 4)) return image;
  put32(image, crc32(image.data(), image.size()));
  return image;
}

std::vector<MmwaveLinkMessage> fileDownload(const std::vector<std::uint8_t>& image, const std::string& name) {
  if (image.empty()) throw InputError(name + ": the firmware image is empty");
  const std::vector<std::uint8_t> file = withCrc(image);
  std::vector<std::uint8_t> stream;
  put32(stream, kFileMetaImage);
  put32(stream, static_cast<std::uint32_t>(file.size()));
  stream.insert(stream.end(), file.begin(), file.end());
  const std::size_t chunks = (stream.size() + kChunkBytes - 1) / kChunkBytes;
  if (chunks > 65536) {
    throw InputError(name + ": " + std::to_string(image.size()) + " bytes are no firmware image; at most " +
                     std::to_string(65536 * kChunkBytes) + " can be sent");
  }
  std::vector<MmwaveLinkMessage> messages;
  for (std::size_t chunk = 0; chunk < chunks; ++chunk) {
    const auto first = stream.begin() + static_cast<std::ptrdiff_t>(chunk * kChunkBytes);
    const auto size = std::min(kChunkBytes, stream.size() - chunk * kChunkBytes);
    messages.push_back(command({kFileDownload, {first, first + static_cast<std::ptrdiff_t>(size)}}));
    messages.back().remaining_chunks = static_cast<std::uint16_t>(chunks - 1 - chunk);
  }
  return messages;
}

EventText describeEvent(const SubBlock& event) {
  using Level = EventText::Level;
  switch (event.id) {
    case kMainPowerUpDone:
      return {Level::kInfo, "the radar's main processor is up"};
    case kRfPowerUpDone:
      return {Level::kInfo, "the radar's front end is up"};
    case kMainCpuFault:
      return {Level::kError, "fault of the main processor's CPU, report " + hexBytes(event.data)};
    case kMainEsmFault:
      return {Level::kError, "error signalled by the main processor's monitoring, report " + hexBytes(event.data)};
    case kBootError:
      return {Level::kWarning, "the radar found no firmware to boot, report " + hexBytes(event.data)};
    case kFrontEndCpuFault:
      return {Level::kError, "fault of the front end's CPU, report " + hexBytes(event.data)};
    case kFrontEndEsmFault:
      return {Level::kError, "error signalled by the front end's monitoring, report " + hexBytes(event.data)};
    case kInitCalibration:
      return describeCalibration(event);
    case kFrameReady:
      return {Level::kInfo, "frames run"};
    case kFrameEnd:
      return {Level::kInfo, "frames ended"};
    case kAnalogFault:
      return {Level::kError, "fault of the analog supply or clock, report " + hexBytes(event.data)};
    default:
      break;
  }
  std::ostringstream text;
  text << "event 0x" << std::hex << event.id << ", report " << hexBytes(event.data);
  return {Level::kInfo, text.str()};
}

std::string describeError(std::uint16_t code) {
  switch (code) {
    case 1:
      return "invalid opcode";
    case 2:
      return "unknown message";
    case 3:
      return "wrong number of sub-blocks";
    case 4:
      return "unknown sub-block";
    case 5:
      return "wrong length of a sub-block";
    case 6:
      return "the value cannot be read";
    case 7:
      return "the value cannot be set";
    case 8:
      return "invalid data in a sub-block";
    case 9:
      return "CRC error";
    case 10:
      return "this is no firmware image of the kind announced";
    case 11:
      return "writing a register failed";
    default:
      return "error " + std::to_string(code);
  }
}

bool parseCalibration(const SubBlock& event, Calibration& calibration) {
  if (event.id != kInitCalibration || event.data.size() < 20) return false;
  calibration.done = u32(event.data, 0);
  calibration.updated = u32(event.data, 4);
  calibration.temperature_deg_c = static_cast<std::int16_t>(event.data[8] | event.data[9] << 8);
  calibration.time_ms = u32(event.data, 12);
  return true;
}

std::string Version::text() const {
  std::ostringstream out;
  out << int{major} << "." << int{minor} << "." << int{build} << "." << int{debug} << " (20" << (year < 10 ? "0" : "")
      << int{year} << "-" << (month < 10 ? "0" : "") << int{month} << "-" << (day < 10 ? "0" : "") << int{day}
      << "), hardware " << int{hardware_variant} << "." << int{hardware_major} << "." << int{hardware_minor};
  return out.str();
}

bool parseVersion(const SubBlock& answer, Version& version) {
  if ((answer.id != kMainVersion && answer.id != kFrontEndVersion) || answer.data.size() < 10) return false;
  const std::uint8_t* at = answer.data.data();
  version = {at[0], at[1], at[2], at[3], at[4], at[5], at[6], at[7], at[8], at[9]};
  return true;
}

}  // namespace awr2243
}  // namespace mmradartwin
