#include "awr2243/awr2243_link.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

#include "emulated_radar_bus.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;

class Awr2243LinkTest : public testing::Test {
 protected:
  std::unique_ptr<Awr2243Link> link(EmulatedFtdi& chip, const std::string& image = "") {
    Awr2243Control::Options options;
    options.answer_timeout = milliseconds(60);
    options.power_up_timeout = milliseconds(300);
    options.boot_error_wait = milliseconds(20);
    options.reset_pulse = milliseconds(1);
    return std::make_unique<Awr2243Link>(deploymentRegisters(), image, nullptr, options,
                                         [this, &chip]() -> std::unique_ptr<UsbTransport> {
                                           ++opened_;
                                           if (absent_) throw RigError("not plugged in");
                                           auto usb = std::make_unique<DirectUsb>(chip);
                                           usb_ = usb.get();
                                           return usb;
                                         });
  }

  EmulatedAwr2243 radar_;
  EmulatedFtdi chip_{radar_};
  DirectUsb* usb_ = nullptr;
  bool absent_ = false;
  int opened_ = 0;
};

TEST_F(Awr2243LinkTest, PreparesOnceStartsAgainAndStopsAtTheEnd) {
  auto radar = link(chip_);
  radar->prepare();
  radar->prepare();
  EXPECT_EQ(opened_, 1);
  EXPECT_EQ(radar->version(), "2.2.4.3 (2021-06-30), hardware 1.1.1");
  EXPECT_EQ(radar->temperature_deg_c(), 45);
  EXPECT_FALSE(radar_.frames_run);
  radar->start();
  radar->start();  // from the first chirp again: the card was armed anew
  EXPECT_TRUE(radar_.frames_run);
  EXPECT_EQ(radar_.commands.size(), 20u + 1 + 3);
  radar.reset();
  EXPECT_FALSE(radar_.frames_run);
  EXPECT_TRUE(radar_.violations.empty());
}

TEST_F(Awr2243LinkTest, ComesBackAfterACableWasPulled) {
  absent_ = true;
  auto radar = link(chip_);
  EXPECT_THROW(radar->start(), RigError);
  absent_ = false;
  radar->start();
  usb_->transfers_until_unplugged = 1;
  EXPECT_THROW(radar->poll(), RigError);
  EXPECT_FALSE(radar->running());
  absent_ = true;
  EXPECT_THROW(radar->start(), RigError);
  absent_ = false;
  radar->start();
  EXPECT_TRUE(radar->running());
  EXPECT_TRUE(radar_.frames_run);
}

TEST_F(Awr2243LinkTest, BringsARadarWithAFaultUpAgain) {
  auto radar = link(chip_);
  radar->start();
  radar->poll();
  radar_.raise(0x1002, {1, 2, 3, 4});
  EXPECT_THROW(radar->poll(), RigError);
  radar->start();
  radar->poll();
  EXPECT_EQ(opened_, 2);
}

TEST_F(Awr2243LinkTest, FirmwareFromAFile) {
  EmulatedAwr2243 blank(false);
  EmulatedFtdi chip(blank);
  EXPECT_THROW(link(chip, "/nonexistent/meta.bin"), InputError);
  EXPECT_THROW(link(chip)->prepare(), RigError);  // no firmware is no reason to end a node
  const std::string file = testing::TempDir() + "meta_image.bin";
  std::ofstream(file, std::ios::binary) << std::string(700, 'x');
  link(chip, file)->start();
  EXPECT_EQ(blank.flash.size(), 704u);
  std::remove(file.c_str());
}

}  // namespace
}  // namespace mmradartwin
