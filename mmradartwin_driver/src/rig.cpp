#include "mmradartwin_driver/rig.h"

#include <algorithm>
#include <utility>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr milliseconds kRetryAfter{2000};
constexpr seconds kRepeatProblemAfter{10};
constexpr seconds kGrace{3};
constexpr milliseconds kAskWhileSilent{2000};
/// Silence after which a recording has ended: the card sends the rest of a recording about 2 s after its last sample.
constexpr milliseconds kStreamEnded{3500};
constexpr int kReceiveTimeout_ms = 50;
/// Longest time that packets are taken for the last ones of a completed recording.
constexpr milliseconds kLastPackets{200};
/// Statuses that are looked at before samples are received again.
constexpr int kStatusesAtOnce = 16;
constexpr seconds kRepeatStatusAfter{1};
/// Longest time from the radar's start to its first samples, beyond two frames.
constexpr seconds kFirstSamples{5};

PacketReceiver::Counters sum(const PacketReceiver::Counters& a, const PacketReceiver::Counters& b) {
  return {a.packets + b.packets, a.bytes + b.bytes, a.kernel_drops + b.kernel_drops, a.foreign + b.foreign,
          a.malformed + b.malformed};
}

std::size_t waitingFrames(const RadarConfig& radar, const RigOptions& options) {
  return std::clamp<std::size_t>(options.hand_over_bytes / radar.bytes_per_frame(), 16, 4096);
}

}  // namespace

Rig::Rig(const RadarConfig& radar, const RigOptions& options, CubeSink cubes, EventSink events)
    : radar_(radar),
      options_(options),
      events_(std::move(events)),
      deliveries_(waitingFrames(radar, options), std::move(cubes)),
      assembler_(
          radar, [this](AdcCube&& cube) { deliveries_.give(std::move(cube)); }, options.assembler) {
  packetDelayTicks(options_.packet_delay_us);
  parseIpv4(options_.host_ip);
  parseIpv4(options_.card_ip);
  if (!options_.record_pcap.empty()) recording_ = std::make_unique<PcapWriter>(options_.record_pcap);
  if (options_.radar) {
    radar_control_ = options_.radar->control(radar_, options_.radar_firmware,
                                             [this](RadarEvent::Level level, const std::string& text) {
                                               events_(level == RadarEvent::Level::kInfo      ? Level::kInfo
                                                       : level == RadarEvent::Level::kWarning ? Level::kWarning
                                                                                              : Level::kError,
                                                       text);
                                             });
  }
  silent_since_ = Clock::now();
  thread_ = std::thread([this] { run(); });
}

Rig::~Rig() {
  stop_ = true;
  thread_.join();
}

RigState Rig::state() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  RigState state = state_;
  if (radar_control_) state.radar = radar_control_->health();
  state.silent_s = std::chrono::duration<double>(Clock::now() - silent_since_).count();
  return state;
}

void Rig::run() {
  while (!stop_) {
    try {
      open();
      prepareRadar();
      configure();
      arm();
      stream();
    } catch (const RigError& error) {
      report(error.what());
      assembler_.flush();
      configured_ = false;
      waitToRetry();
    }
  }
  assembler_.flush();
  publishState();
  try {
    if (radar_control_) radar_control_->stop();
  } catch (const RigError&) {
    // The radar is gone: nothing to stop.
  }
  if (!control_ || !configured_) return;
  try {
    control_->stopRecord();
  } catch (const RigError&) {
    // The card is gone: nothing to stop.
  }
}

void Rig::open() {
  setPhase(RigState::Phase::kConnecting);
  if (!receiver_) {
    receiver_ =
        std::make_unique<PacketReceiver>(options_.host_ip, options_.data_port, options_.card_ip, options_.receiver);
    if (recording_) receiver_->setTap([this](const Datagram& datagram) { recording_->add(datagram); });
    const std::size_t granted = receiver_->buffer_bytes();
    if (granted < options_.receiver.buffer_bytes) {
      events_(Level::kWarning, "the kernel grants " + std::to_string(granted >> 10) + " kB of " +
                                   std::to_string(options_.receiver.buffer_bytes >> 10) +
                                   " kB for the data socket: sysctl -w net.core.rmem_max=" +
                                   std::to_string(options_.receiver.buffer_bytes) + " keeps packets from being lost");
    }
  }
  if (options_.configure_card && !control_) {
    control_ = std::make_unique<Dca1000Control>(options_.host_ip, options_.card_ip, options_.config_port);
    if (recording_) control_->setTap([this](const Datagram& datagram) { recording_->add(datagram); });
  }
}

void Rig::prepareRadar() {
  if (!radar_control_ || !radar_control_->configure()) return;
  configured_ = false;  // the card synchronises with the LVDS clock when it is configured
  events_(Level::kInfo, options_.radar->title + " configured, firmware " + radar_control_->health().version);
}

void Rig::configure() {
  if (!options_.configure_card || configured_) return;
  control_->connect();
  const FpgaVersion version = control_->readVersion();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.version = version;
  }
  const std::string card = "DCA1000 at " + options_.card_ip, advice = versionAdvice(version);
  if (version.playback) throw RigError(card + ": " + describeVersion(version) + ": " + advice);
  if (!advice.empty()) events_(Level::kWarning, card + ": " + describeVersion(version) + ": " + advice);
  control_->resetFpga();
  control_->configureFpga(radar_.layout == CaptureLayout::kTwoLane ? 2 : 4);
  control_->configurePackets(options_.packet_delay_us);
  configured_ = true;
  events_(Level::kInfo, card + " configured, " + describeVersion(version));
}

void Rig::arm() {
  if (options_.configure_card) {
    if (radar_control_) radar_control_->stop();
    // Datagrams of an earlier recording in the socket would be taken for the start of this one.
    receiver_->drain();
    control_->forgetStatuses();
    assembler_.restart();
    control_->startRecord();
    if (radar_control_) radar_control_->start();
  }
  last_data_ = Clock::now();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    silent_since_ = last_data_;
    state_.last_status.reset();
    state_.problem.clear();
    ++state_.armings;
  }
  setPhase(RigState::Phase::kArmed);
  events_(Level::kInfo, radar_control_            ? "armed, and the radar's frames started"
                        : options_.configure_card ? "armed: waiting for the radar's frames"
                                                  : "listening for a card that another program configures");
}

bool Rig::receiveBatch(int timeout_ms) {
  const int packets = receiver_->receive(timeout_ms, [this](const DataPacket& packet) { assembler_.add(packet); });
  if (packets > 0) last_data_ = Clock::now();
  return packets > 0;
}

void Rig::checkFirstSamples(Clock::duration silent) {
  if (silent < kFirstSamples + std::chrono::duration<double>(2 * radar_.frame_period_s)) return;
  radar_control_->forget();
  throw RigError(
      "the radar runs, and no samples come from the card: seat the LVDS ribbon between the boards; radar and "
      "card are set up anew");
}

void Rig::stream() {
  bool any_data = false, ended = false;
  Clock::time_point asked = Clock::now();
  while (!stop_) {
    if (receiveBatch(kReceiveTimeout_ms)) {
      if (!any_data || ended) {
        setPhase(RigState::Phase::kStreaming);
        events_(Level::kInfo, "samples arrive");
      }
      any_data = true;
      ended = false;
    }
    publishState();
    watchRecording();
    const auto silent = Clock::now() - last_data_;
    if (any_data && !ended && silent > kStreamEnded) {
      ended = true;
      assembler_.flush();
      setPhase(RigState::Phase::kArmed);
      events_(Level::kWarning, "samples have stopped");
      if (options_.configure_card) {
        configured_ = false;  // after a short loss of power it has no configuration
        return control_->stopRecord();
      }
    }
    if (!options_.configure_card) continue;
    if (radar_control_ && !any_data) checkFirstSamples(silent);
    if (radar_control_ && radar_control_->health().returned) {
      events_(Level::kWarning, "the radar's USB port is there again: radar and card are set up anew");
      return control_->stopRecord();
    }
    for (int i = 0; i < kStatusesAtOnce; ++i) {
      const auto status = control_->takeStatus(milliseconds(0));
      if (!status) break;
      if (handleStatus(*status)) return;
    }
    if (silent > kAskWhileSilent && Clock::now() - asked > kAskWhileSilent) {
      asked = Clock::now();
      control_->connect();  // throws where the card is gone; it is configured again when it is back
    }
  }
}

bool Rig::handleStatus(std::uint16_t status) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    state_.last_status = status;
  }
  if (status & kFatalStatus) {
    assembler_.flush();
    events_(Level::kError, "the card threw samples away (" + describeStatus(status) +
                               "): frames of the last moments may be shifted; arming it anew. Should it happen again, "
                               "lower packet_delay_us or send fewer samples per second");
    control_->stopRecord();
    return true;
  }
  if (status & kRecordCompleted) {
    // Frames that this rig started run until it stops them.
    events_(radar_control_ ? Level::kWarning : Level::kInfo,
            "the card has completed its recording: the radar's frames have ended");
    // The last packets may follow the status. Those of a radar that goes on without end are for the next recording.
    for (const auto until = Clock::now() + kLastPackets; Clock::now() < until && !stop_ && receiveBatch(20);) {
      publishState();
    }
    assembler_.flush();
    control_->stopRecord();
    publishState();
    return true;
  }
  const bool repeated = status == told_status_ && Clock::now() - told_status_at_ < kRepeatStatusAfter;
  if (status == 0 || repeated) return false;
  told_status_ = status;
  told_status_at_ = Clock::now();
  events_(Level::kWarning, "status of the card: " + describeStatus(status));
  return false;
}

void Rig::report(const std::string& problem) {
  bool repeated;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    repeated = state_.problem == problem;
    state_.problem = problem;
    state_.phase = RigState::Phase::kConnecting;
  }
  if (repeated && Clock::now() - last_report_ < kRepeatProblemAfter) return;
  last_report_ = Clock::now();
  // Driver and card are often started together.
  const bool starting = Clock::now() - started_ < kGrace;
  events_(starting ? Level::kWarning : Level::kError, problem + (starting ? " (trying again)" : ""));
}

void Rig::setPhase(RigState::Phase phase) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.phase = phase;
}

void Rig::publishState() {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_.frames = assembler_.counters();
  if (receiver_) {
    state_.packets = sum(earlier_, receiver_->counters());
    state_.buffer_bytes = receiver_->buffer_bytes();
  }
  state_.frames_not_taken = deliveries_.dropped();
  if (recording_) {
    state_.packets_recorded = recording_->written();
    state_.packets_not_recorded = recording_->left_out();
  }
  silent_since_ = last_data_;
}

/// Reports that the recording of packets failed; frames continue.
void Rig::watchRecording() {
  if (!recording_ || recording_failed_ || recording_->left_out() == 0) return;
  recording_failed_ = true;
  const std::string problem = recording_->problem();
  events_(Level::kError, problem.empty() ? "the disk is too slow for the packet recording " + recording_->file() +
                                               ": packets are missing from it; record to a faster one"
                                         : problem);
}

/// Closes the sockets before a wait, so that the next attempt uses the addresses and ports of that time.
void Rig::waitToRetry() {
  if (receiver_) earlier_ = sum(earlier_, receiver_->counters());
  receiver_.reset();
  control_.reset();
  for (auto until = Clock::now() + kRetryAfter; Clock::now() < until && !stop_;) {
    std::this_thread::sleep_for(milliseconds(50));
  }
}

}  // namespace mmradartwin
