// The driver's real USB code by libusb against the emulated radar on umockdev's bus.
#include <gtest/gtest.h>
#include <libusb.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <string>

#include "../emulator/emulated_usb_bus.h"
#include "awr2243/awr2243_control.h"
#include "emulated_radar_bus.h"

namespace mmradartwin {
namespace {

std::string messageOf(const std::function<void()>& action) {
  try {
    action();
  } catch (const RigError& error) {
    return error.what();
  }
  return "";
}

class Awr2243Usb : public testing::Test {
 protected:
  void SetUp() override {
    if (!EmulatedUsbBus::available()) {
      GTEST_SKIP() << "libumockdev-preload.so.0 could not be preloaded: install the package umockdev, and run without "
                      "sanitizers that want to be preloaded first";
    }
    bus_ = std::make_unique<EmulatedUsbBus>(chip_);
  }
  void expectClean() const {
    for (const auto& violation : radar_.violations) ADD_FAILURE() << "radar: " << violation;
    for (const auto& violation : chip_.violations) ADD_FAILURE() << "chip: " << violation;
  }

  EmulatedAwr2243 radar_;
  EmulatedFtdi chip_{radar_};
  std::unique_ptr<EmulatedUsbBus> bus_;
};

TEST_F(Awr2243Usb, NotPluggedInSaysWhichSocket) {
  const std::string message = messageOf([] { UsbDevice usb; });
  EXPECT_NE(message.find("J1"), std::string::npos) << message;
  EXPECT_NE(message.find("not into J4"), std::string::npos) << message;
}

TEST_F(Awr2243Usb, HeldByAnotherProgram) {
  bus_->plug();
  bus_->setBusy(true);
  EXPECT_NE(messageOf([] { UsbDevice usb; }).find("another program"), std::string::npos);
  bus_->setBusy(false);
  UsbDevice usb;
  EXPECT_EQ(usb.packet_bytes(), 512u);
}

TEST_F(Awr2243Usb, BringsUpStartsAndStops) {
  bus_->plug();
  UsbDevice usb;
  FtdiRadarPort port(usb);
  Awr2243Control control(port);
  control.bringUp(deploymentRegisters());
  EXPECT_EQ(radar_.commands.size(), 20u);
  EXPECT_EQ(control.temperature_deg_c(), 45);
  control.start();
  EXPECT_TRUE(radar_.frames_run);
  control.stop();
  EXPECT_FALSE(radar_.frames_run);
  EXPECT_EQ(control.counters().retries, 0u);
  expectClean();
}

TEST_F(Awr2243Usb, RecoversFromFaultsOnTheWire) {
  bus_->plug();
  UsbDevice usb;
  FtdiRadarPort port(usb);
  Awr2243Control::Options options;
  options.answer_timeout = std::chrono::milliseconds(2000);
  Awr2243Control control(port, nullptr, options);
  radar_.faults.skip = 5;
  radar_.faults.answer_crc = 1;
  radar_.faults.command_header = 1;
  control.bringUp(deploymentRegisters());
  radar_.faults.command_data = 1;
  control.start();
  EXPECT_TRUE(radar_.frames_run);
  EXPECT_EQ(control.counters().refusals_for_crc, 1u);
  EXPECT_EQ(control.counters().garbled, 1u);
  EXPECT_EQ(radar_.headers_refused, 1);
  expectClean();
}

TEST_F(Awr2243Usb, UnpluggedInTheMiddleAndPluggedInAgain) {
  bus_->plug();
  {
    UsbDevice usb;
    FtdiRadarPort port(usb);
    Awr2243Control control(port);
    bus_->unplugAfter(150);
    const std::string message = messageOf([&] { control.bringUp(deploymentRegisters()); });
    EXPECT_NE(message.find("the device is gone"), std::string::npos) << message;
  }
  bus_->unplug();
  EXPECT_NE(messageOf([] { UsbDevice usb; }).find("is not there"), std::string::npos);
  bus_->plug();
  UsbDevice usb;
  FtdiRadarPort port(usb);
  Awr2243Control control(port);
  control.bringUp(deploymentRegisters());
  control.start();
  EXPECT_TRUE(radar_.frames_run);
}

TEST(UsbErrors, SayWhatToDo) {
  EXPECT_NE(describeUsbError(LIBUSB_ERROR_ACCESS, "open").find("70-mmradartwin.rules"), std::string::npos);
  EXPECT_NE(describeUsbError(LIBUSB_ERROR_BUSY, "open").find("another program"), std::string::npos);
  EXPECT_NE(describeUsbError(LIBUSB_ERROR_NO_DEVICE, "open").find("J1"), std::string::npos);
  EXPECT_NE(describeUsbError(LIBUSB_ERROR_IO, "open").find("Input/Output"), std::string::npos);
}

TEST(UdevRule, IsOfTheDeviceThatTheDriverOpens) {
  const std::filesystem::directory_iterator folder(std::string(MMRADARTWIN_DRIVER_SOURCE) + "/udev");
  // udev looks at the tag uaccess in 73-seat-late.rules: what sets it must come before.
  EXPECT_LT(std::stoi(folder->path().filename().string()), 73) << folder->path();
  std::ifstream file(folder->path());
  const std::string rule{std::istreambuf_iterator<char>(file), {}};
  char device[80];
  std::snprintf(device, sizeof device, "ATTR{idVendor}==\"%04x\", ATTR{idProduct}==\"%04x\"", kRadarUsbVendor,
                kRadarUsbProduct);
  EXPECT_NE(rule.find(device), std::string::npos) << rule;
  EXPECT_NE(rule.find("TAG+=\"uaccess\""), std::string::npos) << rule;
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  // umockdev works by a preloaded library, so the program starts itself again with it; once, should that not help.
  if (!mmradartwin::EmulatedUsbBus::available() && !std::getenv("MMRADARTWIN_UMOCKDEV")) {
    setenv("MMRADARTWIN_UMOCKDEV", "tried", 1);
    const char* before = std::getenv("LD_PRELOAD");
    const std::string preload = std::string("libumockdev-preload.so.0") + (before ? std::string(":") + before : "");
    setenv("LD_PRELOAD", preload.c_str(), 1);
    execv("/proc/self/exe", argv);
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
