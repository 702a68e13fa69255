#include <utility>

#include "awr2243/awr2243_control.h"
#include "awr2243/radar_watch.h"
#include "awr2243/rig_self_test.h"
#include "mmradartwin_driver/radar_device.h"
#include "mmradartwin_driver/rig_error.h"

namespace mmradartwin {
namespace {

constexpr char kFile[] = "radar.yaml";
constexpr int kSelfTestFrames = 20;

void selfTest(const RadarConfig& whole_radar, const std::string& firmware, const SelfTestRig& rig) {
  using Level = CheckResult::Level;
  const RadarConfig radar = selfTestRadar(whole_radar);
  const double expected_s = 2 * kSelfTestFrames * radar.frame_period_s;
  std::string step = "radar";
  try {
    const Awr2243Registers registers = quantiseAwr2243(radar, kFile);
    const RadarConfig quantised = withQuantisedValues(radar, registers);
    const std::vector<std::uint8_t> image =
        firmware.empty() ? std::vector<std::uint8_t>() : loadFirmwareImage(firmware);
    UsbDevice usb;
    FtdiRadarPort port(usb);
    std::string warnings;
    Awr2243Control control(port, [&](const awr2243::EventText& event, const SubBlock&) {
      if (event.level != awr2243::EventText::Level::kInfo) warnings += "; " + event.text;
    });
    control.bringUp(registers, image, firmware);
    rig.tell({warnings.empty() ? Level::kFine : Level::kNote, "radar",
              "the AWR2243 is configured, firmware " + control.version().text() + ", " +
                  std::to_string(control.temperature_deg_c().value_or(0)) + " deg C at calibration" + warnings,
              ""});
    step = "lane pattern";
    awr2243::TestPattern pattern = selfTestPattern();
    rig.tell(judgeTestPattern(
        quantised, rig.record(16 * selfTestPacketBytes(), expected_s, [&] { control.setTestPattern(pattern); })));
    pattern.enable = 0;
    control.setTestPattern(pattern);
    step = "test source";
    control.enableTestSource(selfTestSource(quantised));
    const auto bytes = rig.record(kSelfTestFrames * quantised.bytes_per_frame(), expected_s, [&] { control.start(); });
    control.stop();
    control.disableTestSource();
    rig.tell(judgeTestSource(quantised, bytes));
  } catch (const RigError& error) {
    rig.tell({Level::kProblem, step, error.what(), "run this again; power the boards off and on if it stays so"});
  }
}

}  // namespace

RadarDevice awr2243Device() {
  RadarDevice device;
  device.name = "awr2243";
  device.title = "AWR2243";
  device.quantised = [](const RadarConfig& radar, const std::string& file) {
    return withQuantisedValues(radar, quantiseAwr2243(radar, file));
  };
  device.control = [](const RadarConfig& radar, const std::string& firmware, RadarControl::EventSink events) {
    return std::make_unique<RadarWatch>(quantiseAwr2243(radar, kFile), firmware, std::move(events));
  };
  device.self_test = selfTest;
  return device;
}

}  // namespace mmradartwin
