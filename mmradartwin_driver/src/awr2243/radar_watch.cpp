#include "awr2243/radar_watch.h"

#include <chrono>
#include <utility>

#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kLookEvery{200};
constexpr int kOpenEvery = 5;  ///< passes of the watch
constexpr std::size_t kLatestEvents = 10;

}  // namespace

RadarWatch::RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events)
    : RadarWatch(registers, image_file, std::move(events), Awr2243Control::Options(),
                 [] { return std::make_unique<UsbDevice>(); }) {}

RadarWatch::RadarWatch(const Awr2243Registers& registers, const std::string& image_file, EventSink events,
                       const Awr2243Control::Options& options, Awr2243Link::OpenUsb open_usb)
    : events_(std::move(events)),
      open_usb_(std::move(open_usb)),
      link_(
          registers, image_file, [this](const awr2243::EventText& event, const SubBlock&) { took(event); }, options,
          open_usb_) {
  thread_ = std::thread([this] { run(); });
}

RadarWatch::~RadarWatch() {
  stop_ = true;
  thread_.join();
}

void RadarWatch::took(const awr2243::EventText& event) {
  {
    const std::lock_guard<std::mutex> lock(state_mutex_);
    ++state_.events;
    state_.warnings += event.level == RadarEvent::Level::kWarning ? 1 : 0;
    state_.errors += event.level == RadarEvent::Level::kError ? 1 : 0;
    state_.latest.push_front({event.level, event.text, std::chrono::system_clock::now()});
    if (state_.latest.size() > kLatestEvents) state_.latest.pop_back();
  }
  if (events_) events_(event.level, "radar: " + event.text);
}

void RadarWatch::fail(const std::string& problem) {
  lost_ = true;
  const std::lock_guard<std::mutex> lock(state_mutex_);
  state_.problem = problem;
  state_.configured = state_.running = false;
}

template <class Action>
void RadarWatch::controlled(Action action) {
  const std::lock_guard<std::mutex> lock(link_mutex_);
  try {
    action();
  } catch (const RigError& error) {
    fail(error.what());
    throw;
  }
  const std::lock_guard<std::mutex> state_lock(state_mutex_);
  state_.running = link_.running();
  state_.temperature_deg_c = link_.temperature_deg_c();
}

bool RadarWatch::configure() {
  bool brought_up = false;
  controlled([&] {
    brought_up = link_.version().empty();
    link_.prepare();
    const std::lock_guard<std::mutex> lock(state_mutex_);
    state_.problem.clear();
    state_.configured = true;
    state_.version = link_.version();
    state_.bring_ups += brought_up ? 1 : 0;
    lost_ = returned_ = false;
  });
  return brought_up;
}

void RadarWatch::start() {
  controlled([this] {
    link_.start();
    const std::lock_guard<std::mutex> lock(state_mutex_);
    ++state_.starts;
  });
}

void RadarWatch::stop() {
  controlled([this] { link_.stop(); });
}

void RadarWatch::forget() {
  const std::lock_guard<std::mutex> lock(link_mutex_);
  link_.close();
  const std::lock_guard<std::mutex> state_lock(state_mutex_);
  state_.configured = state_.running = false;
}

RadarHealth RadarWatch::health() const {
  const std::lock_guard<std::mutex> lock(state_mutex_);
  RadarHealth health = state_;
  health.returned = returned_;
  return health;
}

void RadarWatch::run() {
  for (int looks = 0; !stop_; ++looks) {
    std::this_thread::sleep_for(kLookEvery);
    // A thread that configures the radar holds the link: there is nothing to watch then.
    const std::unique_lock<std::mutex> lock(link_mutex_, std::try_to_lock);
    if (!lock || (lost_ && looks % kOpenEvery != 0)) continue;
    try {
      watchOnce();
    } catch (const RigError& error) {
      if (lost_) {
        const std::lock_guard<std::mutex> state_lock(state_mutex_);
        state_.problem = error.what();
        continue;
      }
      fail(error.what());
      if (events_) events_(RadarEvent::Level::kError, error.what());
    }
  }
}

void RadarWatch::watchOnce() {
  if (!lost_) return link_.poll();
  if (returned_) return;
  open_usb_();
  returned_ = true;
}

}  // namespace mmradartwin
