// The radar's watcher beside the thread that controls it, on the emulated chip; also run under the thread sanitizer.
#include "awr2243/radar_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "emulated_radar_bus.h"
#include "emulated_rig.h"

namespace mmradartwin {
namespace {

/// A radar on a cable that can be pulled. The emulated chip is one thread's at a time.
struct Cable {
  EmulatedAwr2243 radar;
  EmulatedFtdi chip{radar};
  std::mutex mutex;
  bool plugged = true;

  void plug(bool in) {
    const std::lock_guard<std::mutex> lock(mutex);
    plugged = in;
  }
  void raise(std::uint16_t event, const std::vector<std::uint8_t>& data) {
    const std::lock_guard<std::mutex> lock(mutex);
    radar.raise(event, data);
  }
  bool framesRun() {
    const std::lock_guard<std::mutex> lock(mutex);
    return radar.frames_run;
  }
};

class CableUsb : public UsbTransport {
 public:
  explicit CableUsb(Cable& cable) : cable_(cable), usb_(cable.chip) { const auto lock = connected(); }
  void vendorRequest(std::uint8_t request, std::uint16_t value, std::uint16_t index) override {
    const auto lock = connected();
    usb_.vendorRequest(request, value, index);
  }
  void write(int interface, const std::vector<std::uint8_t>& bytes) override {
    const auto lock = connected();
    usb_.write(interface, bytes);
  }
  std::vector<std::uint8_t> read(int interface, std::chrono::milliseconds timeout) override {
    const auto lock = connected();
    return usb_.read(interface, timeout);
  }
  std::size_t packet_bytes() const override { return usb_.packet_bytes(); }

 private:
  std::unique_lock<std::mutex> connected() {
    std::unique_lock<std::mutex> lock(cable_.mutex);
    if (!cable_.plugged) throw RigError("the cable is out");
    return lock;
  }
  Cable& cable_;
  DirectUsb usb_;
};

class RadarWatchTest : public testing::Test {
 protected:
  bool said(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return std::any_of(texts_.begin(), texts_.end(),
                       [&](const std::string& t) { return t.find(text) != std::string::npos; });
  }

  Cable cable_;
  std::mutex mutex_;
  std::vector<std::string> texts_;
  RadarWatch watch_{deploymentRegisters(), "",
                    [this](RadarEvent::Level, const std::string& text) {
                      const std::lock_guard<std::mutex> lock(mutex_);
                      texts_.push_back(text);
                    },
                    Awr2243Control::Options(), [this] { return std::make_unique<CableUsb>(cable_); }};
};

TEST_F(RadarWatchTest, FetchesEventsWhileFramesRun) {
  EXPECT_TRUE(watch_.configure());
  EXPECT_FALSE(watch_.configure());  // it is up
  watch_.start();
  const RadarHealth before = watch_.health();
  EXPECT_TRUE(before.configured && before.running);
  EXPECT_EQ(before.temperature_deg_c, 45);
  EXPECT_EQ(before.starts, 1u);
  EXPECT_FALSE(before.version.empty());
  cable_.raise(0x1003, {1, 2, 3, 4});
  EXPECT_TRUE(waitUntil([&] { return watch_.health().events > before.events; }));
  const RadarHealth after = watch_.health();
  EXPECT_EQ(after.warnings + after.errors, 1u);
  EXPECT_TRUE(said("radar: " + after.latest.front().text));
  watch_.stop();
  EXPECT_FALSE(cable_.framesRun());
}

TEST_F(RadarWatchTest, NoticesAPulledCableAndItsReturn) {
  watch_.configure();
  watch_.start();
  cable_.plug(false);
  EXPECT_TRUE(waitUntil([&] { return watch_.health().problem == "the cable is out"; }));
  EXPECT_FALSE(watch_.health().running);
  EXPECT_FALSE(watch_.health().returned);
  EXPECT_THROW(watch_.configure(), RigError);
  cable_.plug(true);
  EXPECT_TRUE(waitUntil([&] { return watch_.health().returned; }));
  EXPECT_TRUE(watch_.configure());
  watch_.start();
  const RadarHealth state = watch_.health();
  EXPECT_EQ(state.problem, "");
  EXPECT_EQ(state.bring_ups, 2u);
  EXPECT_TRUE(cable_.framesRun());
}

TEST_F(RadarWatchTest, IsControlledAndAskedAtOnce) {
  std::atomic<bool> stop{false};
  std::thread asking([&] {
    while (!stop) {
      const RadarHealth state = watch_.health();
      EXPECT_LE(state.latest.size(), 10u);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  watch_.configure();
  for (std::uint8_t i = 0; i < 10; ++i) {
    watch_.start();
    cable_.raise(0x1003, {i, 0, 0, 0});
    watch_.stop();
  }
  EXPECT_TRUE(waitUntil([&] { return watch_.health().warnings + watch_.health().errors == 10; }));
  stop = true;
  asking.join();
}

}  // namespace
}  // namespace mmradartwin
