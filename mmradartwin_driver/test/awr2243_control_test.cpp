#include "awr2243/awr2243_control.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <ostream>
#include <random>
#include <string>

#include "emulated_radar_bus.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;

Awr2243Control::Options quick() {
  Awr2243Control::Options options;
  options.answer_timeout = milliseconds(60);
  options.first_chunk_timeout = milliseconds(500);
  options.interrupt_fall_timeout = milliseconds(20);
  options.power_up_timeout = milliseconds(300);
  options.boot_error_wait = milliseconds(20);
  options.calibration_timeout = milliseconds(300);
  options.reset_pulse = milliseconds(1);
  return options;
}

/// Radar, chip and control, wired without USB.
struct Bench {
  explicit Bench(bool firmware = true)
      : radar(firmware), chip(radar), usb(chip), port(usb), control(port, sink(), quick()) {}

  Awr2243Control::EventSink sink() {
    return [this](const awr2243::EventText& text, const SubBlock& event) {
      texts.push_back(text.text);
      events.push_back(event.id);
    };
  }
  bool saw(std::uint16_t event) const { return std::count(events.begin(), events.end(), event) > 0; }
  std::vector<std::uint16_t> commandIds() const {
    std::vector<std::uint16_t> ids;
    for (const auto& command : radar.commands) ids.push_back(command.sub_block);
    return ids;
  }
  void expectClean() const {
    for (const auto& violation : radar.violations) ADD_FAILURE() << "radar: " << violation;
    for (const auto& violation : chip.violations) ADD_FAILURE() << "chip: " << violation;
  }

  std::vector<std::string> texts;
  std::vector<std::uint16_t> events;
  EmulatedAwr2243 radar;
  EmulatedFtdi chip;
  DirectUsb usb;
  FtdiRadarPort port;
  Awr2243Control control;
};

std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const RigError& error) {
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "";
}

TEST(Awr2243Control, BringsUpStartsAndStops) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  EXPECT_EQ(bench.commandIds(), (std::vector<std::uint16_t>{0x404C, 0x4000, 0x0086, 0x0080, 0x0082, 0x02CC, 0x4041,
                                                            0x0083, 0x008D, 0x00C0, 0x0100, 0x0101, 0x0101, 0x4042,
                                                            0x4044, 0x0085, 0x4043, 0x4045, 0x0102, 0x40C0}));
  for (const std::uint16_t event : {0x5000, 0x5001, 0x1004}) EXPECT_TRUE(bench.saw(event)) << std::hex << event;
  EXPECT_EQ(bench.control.temperature_deg_c(), 45);
  EXPECT_FALSE(bench.radar.frames_run);
  bench.control.start();
  EXPECT_TRUE(bench.radar.frames_run);
  EXPECT_TRUE(bench.saw(0x100B));
  bench.control.stop();
  EXPECT_FALSE(bench.radar.frames_run);
  EXPECT_TRUE(bench.saw(0x100F));
  bench.expectClean();
  EXPECT_EQ(bench.control.counters().retries, 0u);
  // 20 commands, start and stop, all in batches: far fewer transfers than words.
  EXPECT_EQ(bench.control.counters().commands, 22u);
  EXPECT_LT(4 * bench.chip.transfers, bench.chip.words);
}

TEST(Awr2243Control, WhatTheRadarHoldsIsWhatWasAsked) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  const auto profile = std::find_if(bench.radar.commands.begin(), bench.radar.commands.end(),
                                    [](const auto& command) { return command.sub_block == 0x0100; });
  ASSERT_NE(profile, bench.radar.commands.end());
  EXPECT_EQ(profile->data[4] | profile->data[5] << 8 | profile->data[6] << 16 | profile->data[7] << 24, 1435384036);
  EXPECT_EQ(profile->data[28] | profile->data[29] << 8, 1553);
}

TEST(Awr2243Control, CanBeBroughtUpAgainFromAnyState) {
  Bench bench;
  for (int i = 0; i < 2; ++i) {
    bench.control.bringUp(deploymentRegisters());
    bench.control.start();  // and never stopped
  }
  EXPECT_TRUE(bench.radar.frames_run);
  bench.expectClean();
}

TEST(Awr2243Control, ReadsTheVersion) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  EXPECT_EQ(bench.control.version().text(), "2.2.4.3 (2021-06-30), hardware 1.1.1");
  bench.expectClean();
}

TEST(Awr2243Control, DownloadsTheFirmware) {
  Bench bench(false);
  std::vector<std::uint8_t> image(3001);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(i * 31 >> 3);
  bench.control.bringUp(deploymentRegisters(), image, "meta.bin");
  ASSERT_EQ(bench.radar.flash.size(), image.size() + 4);
  EXPECT_TRUE(std::equal(image.begin(), image.end(), bench.radar.flash.begin()));
  bench.expectClean();
}

TEST(Awr2243Control, SaysThatThereIsNoFirmware) {
  Bench bench(false);
  try {
    bench.control.bringUp(deploymentRegisters());
    FAIL();
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("no firmware"), std::string::npos) << error.what();
  }
  EXPECT_THROW(loadFirmwareImage("/nonexistent/meta.bin"), InputError);
  const auto image = std::filesystem::temp_directory_path() / ("disk_image_" + std::to_string(::getpid()));
  std::ofstream(image).close();
  std::filesystem::resize_file(image, std::uintmax_t{1} << 40);
  EXPECT_THROW(loadFirmwareImage(image.string()), InputError) << "1 TB, which is not read first";
  std::filesystem::remove(image);
}

struct Fault {
  const char* name;
  std::function<void(EmulatedAwr2243::Faults&)> set;
  std::function<void(const Bench&)> check;
};
void PrintTo(const Fault& fault, std::ostream* out) { *out << fault.name; }
class RecoveredFault : public testing::TestWithParam<Fault> {};

TEST_P(RecoveredFault, LeavesTheConfigurationWhole) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.commands.clear();
  GetParam().set(bench.radar.faults);
  bench.control.start();
  bench.control.version();
  EXPECT_TRUE(bench.radar.frames_run);
  // Once each: a repeated command is not carried out twice.
  EXPECT_EQ(bench.commandIds(), (std::vector<std::uint16_t>{0x0140, 0x40E0}));
  GetParam().check(bench);
  bench.control.stop();
  bench.expectClean();
}

INSTANTIATE_TEST_SUITE_P(
    All, RecoveredFault,
    testing::Values(Fault{"command_header_checksum", [](auto& f) { f.command_header = 1; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.radar.headers_refused, 1);
                            EXPECT_EQ(b.control.counters().retries, 1u);
                            EXPECT_TRUE(b.radar.commands[0].retry);
                          }},
                    Fault{"command_crc", [](auto& f) { f.command_data = 2; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.radar.crcs_refused, 2);
                            EXPECT_EQ(b.control.counters().refusals_for_crc, 2u);
                            EXPECT_FALSE(b.radar.commands[0].retry);  // a refused command is sent as a new one
                          }},
                    Fault{"deaf", [](auto& f) { f.deaf = 2; },
                          [](const Bench& b) { EXPECT_EQ(b.control.counters().retries, 2u); }},
                    Fault{"answer_lost", [](auto& f) { f.answer_lost = 1; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.radar.repeats, 1);
                            EXPECT_FALSE(b.radar.commands[0].retry);
                          }},
                    Fault{"answer_header", [](auto& f) { f.answer_header = 1; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.control.counters().garbled, 1u);
                            EXPECT_EQ(b.radar.repeats, 1);
                          }},
                    Fault{"answer_crc", [](auto& f) { f.answer_crc = 1; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.control.counters().garbled, 1u);
                            EXPECT_EQ(b.radar.repeats, 1);
                          }},
                    Fault{"garbage_before_sync", [](auto& f) { f.answer_garbage = 2; },
                          [](const Bench& b) {
                            EXPECT_EQ(b.control.counters().garbled, 0u);
                            EXPECT_EQ(b.control.counters().retries, 0u);
                          }},
                    Fault{"answer_delayed",
                          [](auto& f) {
                            f.answer_delayed = 1;
                            f.delay = milliseconds(90);
                          },
                          [](const Bench& b) { EXPECT_GE(b.control.counters().stale, 1u); }}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(Awr2243Control, EveryStepOutlivesALostOrGarbledMessage) {
  for (int kind = 0; kind < 5; ++kind) {
    for (int step = kind % 2; step < 20; step += 2) {
      Bench bench;
      auto& faults = bench.radar.faults;
      int* const counters[] = {&faults.answer_header, &faults.answer_crc, &faults.answer_lost, &faults.command_header,
                               &faults.deaf};
      faults.skip = step;
      *counters[kind] = 1;
      bench.control.bringUp(deploymentRegisters());
      EXPECT_EQ(bench.radar.commands.size(), 20u) << kind << ", step " << step;
      EXPECT_EQ(*counters[kind], 0) << kind << ", step " << step;
      EXPECT_EQ(bench.control.counters().retries, 1u) << kind << ", step " << step;
      bench.control.start();
      bench.expectClean();
    }
  }
}

TEST(Awr2243Control, SilenceIsReportedWithTheStep) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.faults.deaf = 100;
  const std::string message = messageOf([&] { bench.control.start(); });
  EXPECT_NE(message.find("'start'"), std::string::npos) << message;
  EXPECT_NE(message.find("after 3 attempts no answer within 60 ms"), std::string::npos) << message;
}

TEST(Awr2243Control, LastingCrcErrorsAreReported) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.faults.command_data = 100;
  EXPECT_NE(messageOf([&] { bench.control.start(); }).find("CRC error"), std::string::npos);
  bench.radar.faults.command_data = 0;
  bench.radar.faults.answer_crc = 100;
  EXPECT_NE(messageOf([&] { bench.control.start(); }).find("garbled"), std::string::npos);
}

TEST(Awr2243Control, RefusalSaysWhy) {
  Bench bench;
  Awr2243Registers registers = deploymentRegisters();
  registers.samples = 2000;
  const std::string message = messageOf([&] { bench.control.bringUp(registers); });
  EXPECT_NE(message.find("'profile': refused: invalid data"), std::string::npos) << message;
}

TEST(Awr2243Control, DeadRadarIsReportedAtPowerUp) {
  Bench bench;
  bench.radar.faults.no_boot = true;
  const std::string message = messageOf([&] { bench.control.bringUp(deploymentRegisters()); });
  EXPECT_NE(message.find("'power-up'"), std::string::npos) << message;
  bench.radar.faults.no_boot = false;
  bench.control.bringUp(deploymentRegisters());  // and it goes on from there
}

TEST(Awr2243Control, FailedCalibrationIsReported) {
  Bench bench;
  bench.radar.faults.calibration_fails = true;
  const std::string message = messageOf([&] { bench.control.bringUp(deploymentRegisters()); });
  EXPECT_NE(message.find("'RF calibration': RF calibration failed: TX power (45 deg C)"), std::string::npos) << message;
}

TEST(Awr2243Control, FaultOfTheFrontEndEndsTheWaiting) {
  Bench bench;
  bench.radar.faults.front_end_fault = true;
  const std::string message = messageOf([&] { bench.control.bringUp(deploymentRegisters()); });
  EXPECT_NE(message.find("fault of the front end's CPU"), std::string::npos) << message;
}

TEST(Awr2243Control, MissingFrameEventIsReported) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.faults.no_frame_event = true;
  EXPECT_NE(messageOf([&] { bench.control.start(); }).find("'start': no such event within 300 ms"), std::string::npos);
}

TEST(Awr2243Control, InterruptThatStaysUpIsReported) {
  Bench bench;
  bench.radar.faults.interrupt_stuck = true;
  EXPECT_NE(messageOf([&] { bench.control.bringUp(deploymentRegisters()); }).find("HOST_INTR"), std::string::npos);
}

TEST(Awr2243Control, EventsBetweenAreDeliveredAndDisturbNothing) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.raise(0x1003, {1, 2, 3, 4});
  bench.radar.raise(0x5003, {5, 6, 7, 8});
  bench.control.start();
  EXPECT_TRUE(bench.saw(0x1003));
  EXPECT_TRUE(bench.saw(0x5003));
  bench.radar.raise(0x1010, {9, 0, 0, 0});
  bench.control.poll();
  EXPECT_EQ(bench.texts.back(), "fault of the analog supply or clock, report 09000000");
  bench.expectClean();
}

TEST(Awr2243Control, TestPatternAndTestSource) {
  Bench bench;
  bench.control.bringUp(deploymentRegisters());
  bench.radar.commands.clear();
  awr2243::TestPattern pattern;
  pattern.enable = 1;
  pattern.samples = 64;
  bench.control.setTestPattern(pattern);
  bench.control.enableTestSource(awr2243::TestSource());
  bench.control.disableTestSource();
  EXPECT_EQ(bench.commandIds(), (std::vector<std::uint16_t>{0x404B, 0x02C2, 0x02C3, 0x02C3, 0x0100}));
  EXPECT_EQ(bench.radar.commands[2].data[0], 1);
  EXPECT_EQ(bench.radar.commands[3].data[0], 0);
  bench.expectClean();
}

TEST(Awr2243Control, UnpluggedAnywhereIsAnErrorAndReplugGoesOn) {
  for (int transfers = 30; transfers < 1200; transfers += 97) {
    Bench bench;
    bench.usb.transfers_until_unplugged = transfers;
    const std::string message = messageOf([&] {
      for (int i = 0; i < 20; ++i) bench.control.bringUp(deploymentRegisters());
    });
    EXPECT_EQ(message, "unplugged") << transfers;
    bench.usb.transfers_until_unplugged = -1;
    FtdiRadarPort port(bench.usb);
    Awr2243Control control(port, nullptr, quick());
    control.bringUp(deploymentRegisters());
    control.start();
    EXPECT_TRUE(bench.radar.frames_run);
  }
}

/// Whatever comes over the wires: noise, and noise that begins like a message.
class NoisyPort : public RadarPort {
 public:
  explicit NoisyPort(unsigned seed) : random_(seed) {}
  void setBootMode(BootMode) override {}
  void setReset(bool) override {}
  void writeWords(const std::vector<std::uint8_t>& bytes) override {
    // Its own command comes back as an answer now and then, which is whole and still wrong.
    if (random_() % 2) echo_ = bytes;
  }
  std::vector<std::uint8_t> readWords(std::size_t words) override {
    std::vector<std::uint8_t> bytes(2 * words);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random_());
    if (bytes.size() == 16 && random_() % 4) {
      std::copy(std::begin(kSyncFromRadar), std::end(kSyncFromRadar), bytes.begin());
      if (echo_.size() >= 16) {
        std::copy(echo_.begin() + 4, echo_.begin() + 16, bytes.begin() + 4);
        if (random_() % 2) bytes[8] = static_cast<std::uint8_t>(random_());
      }
    }
    return bytes;
  }
  bool hostInterrupt() override { return random_() % 2 != 0; }

 private:
  std::mt19937 random_;
  std::vector<std::uint8_t> echo_;
};

TEST(Awr2243Control, NoiseIsAnErrorAndNothingWorse) {
  Awr2243Control::Options options;
  for (auto* time : {&options.answer_timeout, &options.power_up_timeout, &options.boot_error_wait,
                     &options.calibration_timeout, &options.interrupt_fall_timeout, &options.reset_pulse}) {
    *time = milliseconds(1);
  }
  for (unsigned seed = 0; seed < 200; ++seed) {
    NoisyPort port(seed);
    Awr2243Control control(port, nullptr, options);
    EXPECT_THROW(control.bringUp(deploymentRegisters()), RigError);
    EXPECT_THROW(control.start(), RigError);
    EXPECT_THROW(control.version(), RigError);
  }
}

TEST(FtdiRadarPort, DeadSerialEngineIsReported) {
  EmulatedAwr2243 radar;
  EmulatedFtdi chip(radar);
  chip.serial_engine_dead = true;
  DirectUsb usb(chip);
  EXPECT_NE(messageOf([&] { FtdiRadarPort port(usb); }).find("J4"), std::string::npos);
}

/// Answers longer than a packet, to see the status bytes of every packet go.
class LongAnswer : public UsbTransport {
 public:
  void vendorRequest(std::uint8_t, std::uint16_t, std::uint16_t) override {}
  void write(int, const std::vector<std::uint8_t>&) override {}
  std::vector<std::uint8_t> read(int, std::chrono::milliseconds) override {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 1000; ++i) {
      if (bytes.size() % packet_bytes() == 0) bytes.insert(bytes.end(), {0x32, 0x60});
      bytes.push_back(static_cast<std::uint8_t>(i));
    }
    return bytes;
  }
  std::size_t packet_bytes() const override { return 64; }
};

TEST(FtdiChannel, StatusBytesOfEveryPacketAreTakenOut) {
  LongAnswer usb;
  FtdiChannel channel(usb, 0);
  const auto bytes = channel.read(1000);
  for (std::size_t i = 0; i < bytes.size(); ++i) ASSERT_EQ(bytes[i], static_cast<std::uint8_t>(i)) << i;
}

}  // namespace
}  // namespace mmradartwin
