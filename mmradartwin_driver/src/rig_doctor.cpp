#include "mmradartwin_driver/rig_doctor.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>

#include "mmradartwin_driver/dca1000_control.h"
#include "mmradartwin_driver/link_budget.h"
#include "mmradartwin_driver/listening_sockets.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_driver/radar_devices.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;
using Level = CheckResult::Level;

std::string readText(const fs::path& file) {
  std::ifstream in(file);
  std::string text;
  std::getline(in, text, '\0');  // some kernel files open but cannot be read: they count as empty
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string outputOf(const char* command) {
  std::string text;
  const std::unique_ptr<FILE, int (*)(FILE*)> pipe(popen(command, "r"), pclose);
  char part[4096];
  while (pipe && std::fgets(part, sizeof part, pipe.get())) text += part;
  return text;
}

std::string number(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

struct Interface {
  std::string name;
  unsigned flags = 0;
};

/// Interface that has the address; for loopback, the one whose network contains it.
std::optional<Interface> interfaceOf(const in_addr& address) {
  ifaddrs* list = nullptr;
  if (getifaddrs(&list) != 0) return std::nullopt;
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> keeper(list, freeifaddrs);
  for (const ifaddrs* i = list; i; i = i->ifa_next) {
    if (!i->ifa_addr || i->ifa_addr->sa_family != AF_INET || !i->ifa_netmask) continue;
    const in_addr_t own = reinterpret_cast<const sockaddr_in*>(i->ifa_addr)->sin_addr.s_addr;
    const in_addr_t mask = reinterpret_cast<const sockaddr_in*>(i->ifa_netmask)->sin_addr.s_addr;
    const bool same = own == address.s_addr;
    const bool loopback = (i->ifa_flags & IFF_LOOPBACK) && (own & mask) == (address.s_addr & mask);
    if (same || loopback) return Interface{i->ifa_name, i->ifa_flags};
  }
  return std::nullopt;
}

class Examination {
 public:
  Examination(const RigDoctorOptions& options, const std::function<void(const CheckResult&)>& report)
      : options_(options), report_(report) {}

  bool run() {
    const bool linked = link();
    firewall();
    graph();
    usb();
    const bool ports = linked && openPorts();
    if (!ports || !card()) return !problem_;
    if (options_.self_test) {
      selfTest();
    } else {
      samples();
    }
    return !problem_;
  }

 private:
  void tell(Level level, const std::string& subject, const std::string& found, const std::string& next = "") {
    tell({level, subject, found, next});
  }
  void tell(const CheckResult& result) {
    problem_ = problem_ || result.level == Level::kProblem;
    report_(result);
  }

  bool link() {
    const auto interface = interfaceOf(parseIpv4(options_.host_ip));
    if (!interface) {
      tell(Level::kProblem, "address", "no network port of this host has the address " + options_.host_ip,
           "give it to the port that the card is plugged into: sudo ip addr add " + options_.host_ip +
               "/24 dev PORT; sudo ip link set PORT up (and tell NetworkManager to leave that port alone)");
      return false;
    }
    tell(Level::kFine, "address", options_.host_ip + " is on " + interface->name);
    const fs::path net = fs::path(options_.sysfs) / "class/net" / interface->name;
    if (!(interface->flags & IFF_UP)) {
      tell(Level::kProblem, "link", interface->name + " is down", "sudo ip link set " + interface->name + " up");
      return false;
    }
    if (!(interface->flags & IFF_RUNNING) || readText(net / "carrier") == "0") {
      tell(Level::kProblem, "link", interface->name + " has no carrier",
           "plug the cable in on both sides and switch the card on: its LEDs at the Ethernet socket must light");
      return false;
    }
    const std::string speed = readText(net / "speed");
    if (!speed.empty() && speed != "-1" && std::atoi(speed.c_str()) < 1000) {
      tell(Level::kProblem, "link", interface->name + " runs at " + speed + " Mbit/s",
           "use a Gigabit port and a whole Cat 5e cable: the card needs 1000 Mbit/s");
    } else {
      tell(Level::kFine, "link", interface->name + " is up" + (speed.empty() ? "" : " at " + speed + " Mbit/s"));
    }
    return true;
  }

  /// What others reach of the ROS graph on this computer.
  void graph() {
    const std::vector<std::string> open = openRosSockets(options_.procfs);
    if (open.empty()) {
      return tell(
          Level::kFine, "ROS",
          std::string("nobody but this computer reaches a ROS process") + (geteuid() == 0 ? "" : " of this user"));
    }
    std::string list;
    for (const std::string& socket : open) list += (list.empty() ? "" : ", ") + socket;
    tell(Level::kNote, "ROS", "others reach " + list,
         "whoever is on that network may read, steer and end these: docs/rig/safe_graph.md tells how to keep them out");
  }

  void firewall() {
    firewall_ = firewallHint(outputOf("nft list ruleset 2>/dev/null"), outputOf("iptables -S 2>/dev/null"),
                             readText(fs::path(options_.etc) / "ufw/ufw.conf"));
    if (firewall_.empty()) {
      tell(Level::kFine, "firewall", geteuid() == 0 ? "no rules that drop packets" : "no rules that this user can see");
    } else {
      tell(Level::kNote, "firewall", firewall_,
           "if samples or answers do not arrive, let UDP from " + options_.card_ip +
               " in: sudo iptables -I INPUT -p "
               "udp -s " +
               options_.card_ip + " -j ACCEPT (or sudo ufw allow from " + options_.card_ip + ")");
    }
  }

  /// Checks interface A of the card's port J1, through which the radar is configured.
  void usb() {
    if (!options_.usb) return;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator(fs::path(options_.sysfs) / "bus/usb/devices", none)) {
      if (readText(entry.path() / "idVendor") != "0451" || readText(entry.path() / "idProduct") != "fd03") continue;
      char place[64];
      std::snprintf(place, sizeof place, "bus/usb/%03d/%03d", std::atoi(readText(entry.path() / "busnum").c_str()),
                    std::atoi(readText(entry.path() / "devnum").c_str()));
      const std::string file = (fs::path(options_.devfs) / place).string();
      if (access(file.c_str(), R_OK | W_OK) != 0) {
        tell(Level::kProblem, "usb", "the radar's USB port is there, but this user may not open " + file,
             "install the udev rule: sudo cp $(rospack find mmradartwin_driver)/udev/70-mmradartwin.rules "
             "/etc/udev/rules.d/; sudo udevadm control --reload; then unplug it and plug it in again");
      } else {
        tell(Level::kFine, "usb", "the radar's USB port 0451:fd03 is " + file);
      }
      return;
    }
    tell(
        Level::kProblem, "usb", "no USB device 0451:fd03 on this host",
        "plug the USB cable into J1 (RADAR_FTDI) of the DCA1000, not into J4, and switch the board on; --no-usb leaves "
        "this out where another computer configures the radar");
  }

  bool openPorts() {
    try {
      PacketReceiver::Options options;
      options.buffer_bytes = options_.buffer_bytes;
      receiver_ = std::make_unique<PacketReceiver>(options_.host_ip, options_.data_port, options_.card_ip, options);
      control_ = std::make_unique<Dca1000Control>(options_.host_ip, options_.card_ip, options_.config_port);
    } catch (const RigError& error) {
      const std::string text = error.what();
      const std::size_t colon = text.find(": ");
      tell(Level::kProblem, "ports", text.substr(0, colon), colon == std::string::npos ? "" : text.substr(colon + 2));
      return false;
    }
    tell(Level::kFine, "ports",
         "UDP " + std::to_string(options_.config_port) + " and " + std::to_string(options_.data_port) + " are free");
    const std::string limit = readText(fs::path(options_.procfs) / "sys/net/core/rmem_max");
    const std::size_t granted = receiver_->buffer_bytes();
    const std::string text = "the data socket gets " + std::to_string(granted >> 10) + " kB of " +
                             std::to_string(options_.buffer_bytes >> 10) + " kB (net.core.rmem_max is " + limit + ")";
    if (granted < options_.buffer_bytes) {
      tell(Level::kProblem, "buffer", text,
           "sudo sysctl -w net.core.rmem_max=" + std::to_string(options_.buffer_bytes) +
               " (and the same line, without -w, in /etc/sysctl.d/70-mmradartwin.conf to keep it)");
    } else {
      tell(Level::kFine, "buffer", text);
    }
    return true;
  }

  bool card() {
    try {
      control_->connect();
      tell(Level::kFine, "card", "the DCA1000 answers at " + options_.card_ip);
      const FpgaVersion version = control_->readVersion();
      const std::string advice = versionAdvice(version);
      tell(version.playback ? Level::kProblem
           : advice.empty() ? Level::kFine
                            : Level::kNote,
           "version", describeVersion(version), advice);
      if (version.playback) return false;
    } catch (const RigError& error) {
      const std::string neighbour = neighbourState();
      tell(Level::kProblem, "card", error.what() + (neighbour.empty() ? "" : " (" + neighbour + ")"),
           firewall_.empty() ? "switch the card off and on, wait for FPGA_DONE to light, and see that SW2.5 is on "
                               "SW_CONFIG and SW2.6 on GND (then its address is 192.168.33.180)"
                             : firewall_ + ": let UDP from " + options_.card_ip + " in");
      return false;
    }
    return true;
  }

  /// State of the card's address in the neighbour table: whether anything answers to it.
  std::string neighbourState() const {
    std::istringstream arp(readText(fs::path(options_.procfs) / "net/arp"));
    for (std::string line; std::getline(arp, line);) {
      std::istringstream fields(line);
      std::string ip, type, flags;
      fields >> ip >> type >> flags;
      if (ip == options_.card_ip) {
        return flags == "0x0" ? "it does not answer ARP either: power, cable or address"
                              : "it answers ARP: the card is on the wire";
      }
    }
    return "";
  }

  /// Runs the radar's self-test. The radar is brought up before the card is configured, which needs its LVDS clock.
  void selfTest() {
    SelfTestRig rig;
    rig.record = [this](std::size_t wanted, double expected_s, const std::function<void()>& begin) {
      return recordBytes(wanted, expected_s, begin);
    };
    rig.tell = [this](const CheckResult& result) { tell(result); };
    radarDevice(*options_.radar, "radar.yaml").self_test(*options_.radar, options_.radar_firmware, rig);
  }

  /// Implements SelfTestRig::record.
  std::vector<std::uint8_t> recordBytes(std::size_t wanted, double expected_s, const std::function<void()>& begin) {
    control_->resetFpga();
    control_->configureFpga(4);
    control_->configurePackets(options_.packet_delay_us);
    receiver_->drain();
    control_->startRecord();
    begin();
    std::vector<std::uint8_t> bytes(wanted);
    std::vector<bool> have(wanted);
    std::size_t missing = wanted;
    const auto until = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                          std::chrono::duration<double>(options_.first_packet_s + expected_s));
    while (missing > 0 && Clock::now() < until) {
      receiver_->receive(20, [&](const DataPacket& packet) {
        for (std::size_t i = 0; i < packet.size && packet.byte_count + i < wanted; ++i) {
          const std::size_t at = packet.byte_count + i;
          missing -= have[at] ? 0 : 1;
          have[at] = true;
          bytes[at] = packet.payload[i];
        }
      });
    }
    control_->stopRecord();
    if (missing == wanted) throw RigError("no samples came; seat the LVDS ribbon between the boards");
    if (missing > 0) {
      throw RigError(std::to_string(missing) + " of " + std::to_string(wanted) +
                     " bytes were lost; raise net.core.rmem_max, check the network cable");
    }
    return bytes;
  }

  void samples() {
    if (!options_.radar) {
      tell(Level::kNote, "samples", "not looked at", "give --radar radar.yaml to arm the card and look at them");
      return;
    }
    const RadarConfig& radar = *options_.radar;
    try {
      checkLinkBudget(radar, options_.packet_delay_us);
      tell(Level::kFine, "throughput", describe(linkBudget(radar, options_.packet_delay_us)));
    } catch (const InputError& error) {
      tell(Level::kProblem, "throughput", error.what(), "change radar.yaml or packet_delay_us so");
      return;
    }
    try {
      control_->resetFpga();
      control_->configureFpga(radar.layout == CaptureLayout::kTwoLane ? 2 : 4);
      control_->configurePackets(options_.packet_delay_us);
      receiver_->drain();
      control_->startRecord();
      listen(radar);
      control_->stopRecord();
    } catch (const RigError& error) {
      tell(Level::kProblem, "samples", error.what(), "run this again; power the card off and on if it stays so");
    }
  }

  void listen(const RadarConfig& radar) {
    const std::size_t wanted = radar.bytes_per_frame();
    const double watch_s = std::max(1.0, 5 * radar.frame_period_s);
    std::vector<std::uint8_t> frame(wanted);
    std::vector<bool> have(wanted);
    std::uint64_t first_count = 0, last_count = 0, received = 0;
    std::int64_t first_ns = 0, last_ns = 0;
    std::uint16_t status = 0;
    bool any = false;
    auto until = Clock::now() +
                 std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(options_.first_packet_s));
    const auto asked = Clock::now();
    double first_after_s = 0;
    while (Clock::now() < until) {
      receiver_->receive(20, [&](const DataPacket& packet) {
        if (!any) {
          any = true;
          first_after_s = std::chrono::duration<double>(Clock::now() - asked).count();
          first_count = packet.byte_count + packet.size;
          first_ns = packet.stamp_ns;
          until = Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(watch_s));
        } else {
          received += packet.size;
        }
        if (packet.byte_count + packet.size >= last_count) {
          last_count = packet.byte_count + packet.size;
          last_ns = packet.stamp_ns;
        }
        for (std::size_t i = 0; i < packet.size && packet.byte_count + i < wanted; ++i) {
          frame[packet.byte_count + i] = packet.payload[i];
          have[packet.byte_count + i] = true;
        }
      });
      while (const auto bits = control_->takeStatus(std::chrono::milliseconds(0))) status |= *bits;
    }
    if (status & static_cast<std::uint16_t>(~kRecordCompleted)) {
      tell(Level::kProblem, "status", "the card reports " + describeStatus(status),
           status & kFatalStatus ? "lower packet_delay_us or send fewer samples per second"
                                 : "check the LVDS ribbon between radar and card, and that the radar is configured");
    }
    if (!any) {
      tell(Level::kProblem, "samples", "no packet of samples within " + number("%.1f s", options_.first_packet_s),
           "start the radar's frames; if they run, seat the LVDS ribbon and check the lanes in the radar's data path" +
               std::string(firewall_.empty() ? "" : "; and let UDP from " + options_.card_ip + " in: " + firewall_));
      return;
    }
    tell(Level::kFine, "samples", "the first packet came after " + number("%.2f s", first_after_s));
    const std::uint64_t span = last_count - first_count;
    const std::uint64_t lost = span > received ? span - received : 0;
    const std::uint64_t drops = receiver_->counters().kernel_drops;
    if (lost > 0) {
      tell(Level::kProblem, "losses",
           std::to_string(lost) + " of " + std::to_string(span) + " bytes were lost" +
               (drops ? ", " + std::to_string(drops) + " packets in this host" : ""),
           drops ? "raise net.core.rmem_max and free the processor" : "check the cable; raise packet_delay_us");
    } else {
      tell(Level::kFine, "losses", "none in " + std::to_string(span) + " bytes");
    }
    // The card's packets of a frame arrive together: a rate needs an interval of several frames.
    if (span >= 3 * wanted && last_ns > first_ns) {
      tell(checkRate(radar, static_cast<double>(span), static_cast<double>(last_ns - first_ns) * 1e-9));
    }
    if (std::find(have.begin(), have.end(), false) == have.end()) {
      tell(checkLanes(radar, frame));
    } else {
      tell(Level::kNote, "lanes", "the first frame is not whole, its lanes were not looked at",
           "start the frames after this program says that it waits for them, and run it again");
    }
  }

  const RigDoctorOptions& options_;
  const std::function<void(const CheckResult&)>& report_;
  std::unique_ptr<PacketReceiver> receiver_;
  std::unique_ptr<Dca1000Control> control_;
  std::string firewall_;
  bool problem_ = false;
};

}  // namespace

bool checkRig(const RigDoctorOptions& options, const std::function<void(const CheckResult&)>& report) {
  parseIpv4(options.host_ip);
  parseIpv4(options.card_ip);
  packetDelayTicks(options.packet_delay_us);
  if (options.self_test && !(options.radar && options.usb)) {
    throw InputError("the self-test needs a radar.yaml (--radar) and the radar's USB port");
  }
  if (options.self_test && !radarDevice(*options.radar, "radar.yaml").self_test) {
    throw InputError("radar.yaml: key device: '" + options.radar->device + "' has no self-test");
  }
  return Examination(options, report).run();
}

std::string firewallHint(const std::string& nft, const std::string& iptables, const std::string& ufw) {
  std::string found;
  const auto add = [&found](const std::string& what) { found += (found.empty() ? "" : ", ") + what; };
  if (nft.find("policy drop") != std::string::npos || nft.find(" drop") != std::string::npos ||
      nft.find(" reject") != std::string::npos) {
    add("nftables has rules that drop packets");
  }
  if (iptables.find("-P INPUT DROP") != std::string::npos || iptables.find("-j DROP") != std::string::npos ||
      iptables.find("-j REJECT") != std::string::npos) {
    add("iptables has rules that drop packets");
  }
  if (ufw.find("ENABLED=yes") != std::string::npos) add("ufw is on");
  return found;
}

CheckResult checkLanes(const RadarConfig& radar, const std::vector<std::uint8_t>& frame) {
  const bool two_lanes = radar.layout == CaptureLayout::kTwoLane;
  // Four lanes: words I rx0..rx3, Q rx0..rx3. Two lanes: I I Q Q, one receiver after the other within a chirp.
  const std::size_t words = two_lanes ? 4 : 2 * static_cast<std::size_t>(radar.capture_receivers());
  const auto word = [&frame](std::size_t i) { return static_cast<std::int16_t>(frame[2 * i] | frame[2 * i + 1] << 8); };
  std::vector<bool> silent(words, true);
  for (std::size_t i = 0; i < frame.size() / 2; ++i) {
    if (word(i) != 0) silent[i % words] = false;
  }
  CheckResult result;
  result.subject = "lanes";
  std::string quiet;
  std::size_t count = 0;
  const std::size_t used = two_lanes ? 4 : static_cast<std::size_t>(radar.receivers());
  for (std::size_t i = 0; i < words; ++i) {
    const std::size_t lane = two_lanes ? i : i % (words / 2);
    if (!silent[i] || lane >= used) continue;
    ++count;
    const std::string name = two_lanes ? "word " + std::to_string(i) + " of 4"
                                       : std::string(i < words / 2 ? "I" : "Q") + " of rx" + std::to_string(lane);
    quiet += (quiet.empty() ? "" : ", ") + name;
  }
  const std::size_t all = two_lanes ? 4 : 2 * used;
  if (count == all) {
    result.level = CheckResult::Level::kProblem;
    result.found = "all samples of the first frame are zero";
    result.next = "seat the LVDS ribbon, and check that the radar's data path sends ADC samples over LVDS";
  } else if (count > 0) {
    result.level = CheckResult::Level::kProblem;
    result.found = "always zero: " + quiet;
    result.next =
        "check that the radar has these receivers on, that it sends complex samples, and that its lanes are "
        "those of radar.yaml's layout (4lane for AWR2243 and xWR14xx, 2lane for xWR16xx, 18xx and 68xx)";
  } else {
    result.found = "all " + std::to_string(two_lanes ? 2 : 4) + " lanes carry samples";
  }
  return result;
}

CheckResult checkRate(const RadarConfig& radar, double bytes, double elapsed_s) {
  const double expected = static_cast<double>(radar.bytes_per_frame()) / radar.frame_period_s;
  const double ratio = bytes / elapsed_s / expected;
  CheckResult result;
  result.subject = "rate";
  result.found = number("%.3f", bytes / elapsed_s * 8e-6) + " Mbit/s of samples, radar.yaml says " +
                 number("%.3f Mbit/s", expected * 8e-6);
  if (ratio > 0.8 && ratio < 1.25) return result;
  result.level = CheckResult::Level::kProblem;
  if (ratio > 1.6 && ratio < 2.5) {
    result.next =
        "the rate is doubled: set layout (2lane or 4lane) to the radar's lanes, and see that radar.yaml's "
        "samples_per_chirp, loops_per_frame and transmitters are those that the radar runs with";
  } else if (ratio > 0.4 && ratio < 0.6) {
    result.next = "the rate is halved: see that the radar sends complex samples on all lanes of radar.yaml's layout";
  } else {
    result.next =
        "radar.yaml is not what the radar runs with: compare frame_period_s, samples_per_chirp, "
        "loops_per_frame and the number of transmitters";
  }
  return result;
}

}  // namespace mmradartwin
