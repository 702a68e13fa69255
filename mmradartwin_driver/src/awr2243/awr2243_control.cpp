#include "awr2243/awr2243_control.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>

#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;

constexpr std::uint16_t kErrorBlock = 0x0000;
constexpr std::uint16_t kCrcError = 9;
constexpr std::size_t kHuntWords = 64;  ///< distance behind its position up to which SYNC is searched for

bool isFault(std::uint16_t event) {
  return event == awr2243::kFrontEndCpuFault || event == awr2243::kAnalogFault || event == awr2243::kMainCpuFault;
}

/// Error code of an answer that has one: of a refusal, or of a response whose only sub-block has id 0.
std::optional<std::uint16_t> errorCode(const MmwaveLinkMessage& answer) {
  for (const SubBlock& block : answer.sub_blocks) {
    if (block.id == kErrorBlock && block.data.size() >= 2) {
      return static_cast<std::uint16_t>(block.data[0] | block.data[1] << 8);
    }
  }
  // A refusal without a reason concerns the CRC; every other error has a code.
  if (answer.type == MmwaveLinkType::kRefusal) return kCrcError;
  return std::nullopt;
}

std::string milliseconds_text(milliseconds time) { return std::to_string(time.count()) + " ms"; }

}  // namespace

Awr2243Control::Awr2243Control(RadarPort& port, EventSink events)
    : Awr2243Control(port, std::move(events), Options()) {}

Awr2243Control::Awr2243Control(RadarPort& port, EventSink events, const Options& options)
    : port_(port), events_(std::move(events)), options_(options) {}

bool Awr2243Control::waitInterrupt(bool level, Clock::time_point deadline) {
  for (;;) {
    if (port_.hostInterrupt() == level) return true;
    if (Clock::now() >= deadline) return false;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
}

std::optional<MmwaveLinkMessage> Awr2243Control::receive(Clock::time_point deadline) {
  garbled_ = false;
  if (!waitInterrupt(true, deadline)) return std::nullopt;
  std::vector<std::uint8_t> clear(kClearToSend, kClearToSend + kMmwaveLinkSyncBytes);
  clear.resize(kMmwaveLinkSyncBytes + kMmwaveLinkHeaderBytes, 0xFF);
  port_.writeWords(clear);
  if (!waitInterrupt(false, Clock::now() + options_.interrupt_fall_timeout)) {
    port_.writeWords(clear);
    if (!waitInterrupt(false, Clock::now() + options_.interrupt_fall_timeout)) {
      throw RigError("the radar holds HOST_INTR up although it may send; switch the board off and on");
    }
  }
  std::vector<std::uint8_t> bytes = port_.readWords((kMmwaveLinkSyncBytes + kMmwaveLinkHeaderBytes) / 2);
  std::size_t sync = 0;  // the words before SYNC, in bytes
  const auto found = [&] { return std::equal(kSyncFromRadar, std::end(kSyncFromRadar), bytes.begin() + sync); };
  while (!found()) {
    if (sync / 2 == kHuntWords) {
      garbled_ = true;
      ++counters_.garbled;
      return std::nullopt;
    }
    sync += 2;
    const std::vector<std::uint8_t> more = port_.readWords(1);
    bytes.insert(bytes.end(), more.begin(), more.end());
  }
  bytes.erase(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(sync + kMmwaveLinkSyncBytes));
  if (const auto header = decodeHeader(bytes.data())) {
    const auto rest = port_.readWords((header->length - kMmwaveLinkHeaderBytes) / 2);
    bytes.insert(bytes.end(), rest.begin(), rest.end());
    DecodedMessage decoded = decodeMessage(bytes.data(), bytes.size());
    if (decoded.message) return std::move(decoded.message);
  } else {
    // The message's length is unknown: the rest of it is read, so that the next message begins at its start.
    port_.readWords((kMmwaveLinkMaxLength - kMmwaveLinkHeaderBytes) / 2);
  }
  garbled_ = true;
  ++counters_.garbled;
  return std::nullopt;
}

void Awr2243Control::dispatch(const MmwaveLinkMessage& message) {
  for (const SubBlock& event : message.sub_blocks) {
    ++counters_.events;
    seen_[event.id] = event;
    awr2243::Calibration calibration;
    if (awr2243::parseCalibration(event, calibration)) temperature_deg_c_ = calibration.temperature_deg_c;
    const awr2243::EventText text = awr2243::describeEvent(event);
    if (running_front_end_ && isFault(event.id)) fault_ = text.text;
    if (events_) events_(text, event);
  }
}

MmwaveLinkMessage Awr2243Control::command(const std::string& step, MmwaveLinkMessage message,
                                          std::optional<milliseconds> timeout) {
  const milliseconds limit = timeout.value_or(options_.answer_timeout);
  message.sequence = sequence_;
  sequence_ = (sequence_ + 1) & 0xF;
  ++counters_.commands;
  std::string problem;
  for (int attempt = 0; attempt < options_.attempts; ++attempt) {
    if (attempt > 0) ++counters_.retries;
    port_.writeWords(encodeMessage(message));
    const auto deadline = Clock::now() + limit;
    problem.clear();
    while (problem.empty()) {
      const auto answer = receive(deadline);
      if (!answer) {
        problem = garbled_ ? "its answers are garbled; check the flat cable between the boards"
                           : "no answer within " + milliseconds_text(limit) +
                                 "; check the board's power and boot-mode jumpers, and switch it off and on";
        message.retry = true;  // the radar may have received the command
      } else if (answer->type == MmwaveLinkType::kEvent) {
        dispatch(*answer);
      } else if (answer->sequence != message.sequence) {
        ++counters_.stale;
      } else if (const auto error = errorCode(*answer)) {
        if (*error != kCrcError) {
          throw RigError("radar, step '" + step + "': refused: " + awr2243::describeError(*error) +
                         "; check radar.yaml against the device's data sheet");
        }
        ++counters_.refusals_for_crc;
        problem = "it received every attempt with a CRC error; check the flat cable between the boards";
        message.retry = false;  // the radar rejected the command: this is a new one
      } else {
        return *answer;
      }
    }
  }
  throw RigError("radar, step '" + step + "': after " + std::to_string(options_.attempts) + " attempts " + problem);
}

template <class Payload>
void Awr2243Control::set(const std::string& step, const Payload& payload) {
  command(step, awr2243::command(awr2243::subBlock(payload)));
}

void Awr2243Control::waitEvent(const std::string& step, std::uint16_t event, milliseconds timeout) {
  const auto deadline = Clock::now() + timeout;
  while (!seen_.count(event)) {
    const auto message = receive(deadline);
    if (message && message->type == MmwaveLinkType::kEvent) dispatch(*message);
    if (message && message->type != MmwaveLinkType::kEvent) ++counters_.stale;
    if (!fault_.empty()) {
      throw RigError("radar, step '" + step + "': " + fault_ + "; switch the board off and on");
    }
    if (!message && !garbled_) {
      throw RigError("radar, step '" + step + "': no such event within " + milliseconds_text(timeout) +
                     "; check the board's power and boot-mode jumpers (SOP 4), and switch it off and on");
    }
  }
}

void Awr2243Control::reset() {
  seen_.clear();
  fault_.clear();
  sequence_ = 0;
  running_front_end_ = false;
  temperature_deg_c_.reset();
  port_.setBootMode(RadarPort::BootMode::kFunctional);
  port_.setReset(true);
  std::this_thread::sleep_for(options_.reset_pulse);
  port_.setReset(false);
  waitEvent("power-up", awr2243::kMainPowerUpDone, options_.power_up_timeout);
  const auto deadline = Clock::now() + options_.boot_error_wait;
  while (!seen_.count(awr2243::kBootError)) {
    const auto message = receive(deadline);
    if (message) dispatch(*message);
    if (!message && !garbled_) break;
  }
}

void Awr2243Control::download(const std::vector<std::uint8_t>& image, const std::string& name) {
  bool first = true;
  for (const MmwaveLinkMessage& chunk : awr2243::fileDownload(image, name)) {
    command("firmware download", chunk, first ? std::make_optional(options_.first_chunk_timeout) : std::nullopt);
    first = false;
  }
}

void Awr2243Control::bringUp(const Awr2243Registers& registers, const std::vector<std::uint8_t>& image,
                             const std::string& image_name) {
  registers_.reset();
  reset();
  if (!image.empty()) {
    download(image, image_name);
  } else if (seen_.count(awr2243::kBootError)) {
    throw InputError(
        "the radar has no firmware in its flash: give the file of TI's meta image (xwr22xx_metaImage.bin of the "
        "mmWave DFP package)");
  }
  set("event CRC", awr2243::EventCrc());
  seen_.erase(awr2243::kRfPowerUpDone);
  command("front end power-up", awr2243::command({awr2243::kRfPowerUp, {}}));
  waitEvent("front end power-up", awr2243::kRfPowerUpDone, options_.power_up_timeout);
  running_front_end_ = true;

  set("front end events", awr2243::RfDevice());
  set("channels", awr2243::channels(registers));
  set("ADC output", awr2243::AdcOutput());
  set("regulator", awr2243::RegulatorBypass());
  set("data format", awr2243::dataFormat(registers));
  set("ADC mode", awr2243::LowPower());
  set("synthesizer bandwidth", awr2243::SynthesizerBandwidth());

  seen_.erase(awr2243::kInitCalibration);
  command("RF calibration", awr2243::command({awr2243::kRfInit, {}}));
  waitEvent("RF calibration", awr2243::kInitCalibration, options_.calibration_timeout);
  const awr2243::EventText calibration = awr2243::describeEvent(seen_[awr2243::kInitCalibration]);
  if (calibration.level == awr2243::EventText::Level::kError) {
    throw RigError("radar, step 'RF calibration': " + calibration.text +
                   "; check the board's supply, and switch it "
                   "off and on");
  }

  set("profile", awr2243::profile(registers));
  for (const awr2243::Chirp& chirp : awr2243::chirps(registers)) set("chirp", chirp);
  set("data path", awr2243::DataPath());
  set("lane clock", awr2243::LaneClock());
  set("high-speed clock", awr2243::HighSpeedClock());
  set("lanes", awr2243::LaneEnable());
  set("LVDS lanes", awr2243::LvdsLanes());
  set("frame", awr2243::frame(registers));
  set("frame in the main processor", awr2243::frameApply(registers));
  registers_ = registers;
}

void Awr2243Control::start() {
  seen_.erase(awr2243::kFrameReady);
  seen_.erase(awr2243::kFrameEnd);
  awr2243::FrameTrigger trigger;
  trigger.start = 1;
  set("start", trigger);
  waitEvent("start", awr2243::kFrameReady, options_.power_up_timeout);
}

void Awr2243Control::stop() {
  seen_.erase(awr2243::kFrameEnd);
  set("stop", awr2243::FrameTrigger());
  const auto period = registers_ ? milliseconds(static_cast<int>(registers_->frame_period / 200000)) : milliseconds(0);
  waitEvent("stop", awr2243::kFrameEnd, options_.power_up_timeout + period);
}

void Awr2243Control::poll() {
  while (port_.hostInterrupt()) {
    const auto message = receive(Clock::now());
    if (message && message->type == MmwaveLinkType::kEvent) dispatch(*message);
    if (message && message->type != MmwaveLinkType::kEvent) ++counters_.stale;
  }
}

awr2243::Version Awr2243Control::version() {
  awr2243::Version version;
  const MmwaveLinkMessage answer = command("version", awr2243::command({awr2243::kMainVersion, {}}));
  if (answer.sub_blocks.empty() || !awr2243::parseVersion(answer.sub_blocks.front(), version)) {
    throw RigError("radar, step 'version': the answer is no version; is this an AWR2243 with TI's firmware?");
  }
  return version;
}

void Awr2243Control::setTestPattern(const awr2243::TestPattern& pattern) { set("test pattern", pattern); }

void Awr2243Control::enableTestSource(const awr2243::TestSource& source) {
  set("test source", source);
  awr2243::TestSourceEnable enable;
  enable.enable = 1;
  set("test source on", enable);
}

void Awr2243Control::disableTestSource() {
  set("test source off", awr2243::TestSourceEnable());
  if (registers_) set("profile", awr2243::profile(*registers_));
}

std::vector<std::uint8_t> loadFirmwareImage(const std::string& file) {
  requireRegularFile(file);
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError(file + ": the firmware image cannot be read; give the path of TI's meta image");
  constexpr std::uintmax_t kLargestImage_bytes = 16 << 20;  // more cannot be sent
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && size > kLargestImage_bytes) {
    throw InputError(file + ": " + std::to_string(size) + " bytes are no firmware image; give TI's meta image");
  }
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

}  // namespace mmradartwin
