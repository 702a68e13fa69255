// The doctor against the emulator on loopback: all fine, and each fault by name with something to do.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "emulated_rig.h"
#include "mmradartwin_driver/rig_doctor.h"
#include "mmradartwin_driver/udp_socket.h"

namespace mmradartwin {
namespace {

using Level = CheckResult::Level;

class Doctor : public ::testing::Test {
 protected:
  void SetUp() override {
    writeSession(folder_, 0.02, {400});
    options_.host_ip = loopbackIp(1);
    options_.card_ip = loopbackIp(2);
    options_.radar = loadRadarConfig(folder_.file("radar.yaml"));
    options_.buffer_bytes = 200 << 10;  // what any kernel grants
    options_.sysfs = folder_.file("sys");
    options_.devfs = folder_.file("dev");
    options_.etc = folder_.file("etc");
    plugUsb();
  }
  void plugUsb() {
    const std::string device = "sys/bus/usb/devices/1-2/";
    writeText(folder_.file(device + "idVendor"), "0451\n");
    writeText(folder_.file(device + "idProduct"), "fd03\n");
    writeText(folder_.file(device + "busnum"), "1\n");
    writeText(folder_.file(device + "devnum"), "7\n");
    writeText(folder_.file("dev/bus/usb/001/007"), "");
  }
  std::vector<std::string> emulator(std::vector<std::string> more = {}) const {
    std::vector<std::string> arguments = {folder_.file(""), "--start-delay-s", "0.1", "--deaf-s", "0.1"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  bool examine() {
    results_.clear();
    return checkRig(options_, [this](const CheckResult& result) { results_.push_back(result); });
  }
  /// Where there is exactly one problem, its text and what to do.
  std::string theProblem() const {
    std::string text;
    int problems = 0;
    for (const CheckResult& result : results_) {
      if (result.level != Level::kProblem) continue;
      text += result.subject + ": " + result.found + " -> " + result.next;
      EXPECT_FALSE(result.next.empty()) << text;
      ++problems;
    }
    EXPECT_EQ(1, problems) << text;
    return text;
  }
  bool fine(const std::string& subject) const {
    return std::any_of(results_.begin(), results_.end(), [&](const CheckResult& result) {
      return result.subject == subject && result.level == Level::kFine;
    });
  }
  static bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

  TestFolder folder_;
  RigDoctorOptions options_;
  std::vector<CheckResult> results_;
};

TEST_F(Doctor, AllFine) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  EXPECT_TRUE(examine());
  for (const char* subject : {"address", "link", "usb", "ports", "buffer", "card", "version", "throughput", "samples",
                              "losses", "rate", "lanes"}) {
    EXPECT_TRUE(fine(subject)) << subject;
  }
}

TEST_F(Doctor, AddressMissing) {
  options_.host_ip = "203.0.113.7";
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "ip addr add 203.0.113.7/24")) << theProblem();
}

TEST_F(Doctor, PortInUse) {
  const UdpSocket other(options_.host_ip, kDca1000DataPort, "the test");
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "ss -ulpn")) << theProblem();
}

TEST_F(Doctor, NoCard) {
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "card: no answer from the DCA1000")) << theProblem();
}

TEST_F(Doctor, FirewallIsNamedWhereTheCardIsSilent) {
  writeText(folder_.file("etc/ufw/ufw.conf"), "ENABLED=yes\n");
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "ufw is on: let UDP from " + options_.card_ip)) << theProblem();
}

TEST_F(Doctor, SmallBuffer) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  options_.buffer_bytes = std::size_t{1} << 30;  // the kernel books twice that: more than an int holds
  options_.radar.reset();
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "net.core.rmem_max=1073741824")) << theProblem();
}

TEST_F(Doctor, UsbMissing) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  options_.radar.reset();
  std::filesystem::remove_all(folder_.file("sys"));
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "J1 (RADAR_FTDI)")) << theProblem();
  options_.usb = false;
  EXPECT_TRUE(examine());
}

TEST_F(Doctor, UsbNotPermitted) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  options_.radar.reset();
  // A user without rights and a device that is not there look the same to access(); root may open anything.
  std::filesystem::remove(folder_.file("dev/bus/usb/001/007"));
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "/etc/udev/rules.d")) << theProblem();
}

TEST_F(Doctor, TooManySamples) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  options_.radar->loops_per_frame = 2000;  // 2 MB every 20 ms
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "this would fit")) << theProblem();
}

TEST_F(Doctor, NoSamples) {
  EmulatorProcess card(options_.host_ip, options_.card_ip,
                       {folder_.file(""), "--start-delay-s", "30", "--deaf-s", "0.1"});
  options_.first_packet_s = 0.5;
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "start the radar's frames")) << theProblem();
}

TEST_F(Doctor, CardReportsNoLvds) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator({"--status-at", "5:0x1"}));
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "NO_LVDS_DATA")) << theProblem();
}

TEST_F(Doctor, Losses) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator({"--loss", "0.2"}));
  EXPECT_FALSE(examine());
  const auto lost = std::find_if(results_.begin(), results_.end(),
                                 [](const CheckResult& result) { return result.subject == "losses"; });
  ASSERT_NE(results_.end(), lost);
  EXPECT_EQ(Level::kProblem, lost->level);
}

TEST_F(Doctor, ReceiverThatIsAlwaysZero) {
  std::vector<std::uint8_t> bytes = readBytes(folder_.file("captures/a.bin"));
  for (std::size_t i = 0; i < bytes.size(); i += 16) {
    for (const std::size_t at : {4, 5, 12, 13}) bytes[i + at] = 0;  // I and Q of rx2
  }
  writeText(folder_.file("captures/a.bin"), std::string(bytes.begin(), bytes.end()));
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "lanes: always zero: I of rx2, Q of rx2 ->")) << theProblem();
}

TEST_F(Doctor, AllZero) {
  writeText(folder_.file("captures/a.bin"), std::string(400 * 2048, '\0'));
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "LVDS ribbon")) << theProblem();
}

TEST_F(Doctor, DoubledRate) {
  EmulatorProcess card(options_.host_ip, options_.card_ip, emulator());
  options_.radar->samples_per_chirp /= 2;
  EXPECT_FALSE(examine());
  EXPECT_TRUE(holds(theProblem(), "the rate is doubled")) << theProblem();
}

TEST(DoctorParts, ReceiversNotInUseMayBeZero) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  radar.rx_position_m.resize(2);
  const std::string random = randomBytes(radar.bytes_per_frame(), 3);
  std::vector<std::uint8_t> frame(random.begin(), random.end());
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (i % 8 >= 4) frame[i] = 0;
  }
  EXPECT_EQ(Level::kFine, checkLanes(radar, frame).level);
}

TEST(DoctorParts, FirewallRules) {
  EXPECT_EQ("", firewallHint("", "-P INPUT ACCEPT\n-P FORWARD ACCEPT\n", "ENABLED=no"));
  EXPECT_NE("",
            firewallHint("table inet f { chain input { type filter hook input priority 0; policy drop; } }", "", ""));
  EXPECT_NE("", firewallHint("", "-P INPUT DROP\n", ""));
}

TEST(DoctorProgram, ExitStatusSaysWhetherThereIsSomethingToDo) {
  TestFolder folder;
  writeSession(folder, 0.02, {400});
  const std::string command = std::string(MMRADARTWIN_DOCTOR) + " --no-usb --buffer-mb 0.2 --host-ip " + loopbackIp(1) +
                              " --card-ip " + loopbackIp(2) + " --radar " + folder.file("radar.yaml") + " >" +
                              folder.file("out");
  EXPECT_EQ(2, WEXITSTATUS(std::system(command.c_str())));
  EmulatorProcess card(loopbackIp(1), loopbackIp(2), {folder.file(""), "--start-delay-s", "0.1", "--deaf-s", "0.1"});
  EXPECT_EQ(0, WEXITSTATUS(std::system(command.c_str())));
  const std::vector<std::uint8_t> output = readBytes(folder.file("out"));
  EXPECT_NE(std::string::npos, std::string(output.begin(), output.end()).find("all fine"));
}

}  // namespace
}  // namespace mmradartwin
