#pragma once

#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "../emulator/child_process.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {

/// Addresses of this process's own on the loopback network, so that tests run beside each other.
inline std::string loopbackIp(int host) {
  const int id = getpid();
  return "127." + std::to_string(64 + id % 60) + "." + std::to_string(id / 60 % 250 + 1) + "." + std::to_string(host);
}

/// The files of a test; they go with the object.
class TestFolder {
 public:
  std::string file(const std::string& name) const { return (std::filesystem::path(folder_.path()) / name).string(); }

 private:
  TemporaryFolder folder_;
};

inline void writeText(const std::string& file, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(file).parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

inline std::vector<std::uint8_t> readBytes(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// The paper's radar: 2048 bytes per frame; frames as often as asked.
inline std::string paperRadarYaml(double frame_period_s) {
  return "device: awr2243\ncarrier_hz: 77.0e+9\nslope_hz_per_s: 75.0e+12\nsamples_per_chirp: 64\nsample_rate_hz: "
         "5.0e+6\n"
         "adc_start_s: 6.0e-6\nloops_per_frame: 1\nframe_period_s: " +
         std::to_string(frame_period_s) +
         "\ntx_position_m: [[0, 0, 0], [0, 0.0077867, 0]]\n"
         "rx_position_m: [[0, 0, 0], [0, 0.0019467, 0], [0, 0.0038934, 0], [0, 0.0058401, 0]]\n";
}

inline std::string randomBytes(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// Poses "a", "b", ... one metre apart, with random captures of so many frames each.
inline void writeSession(const TestFolder& folder, double frame_period_s, const std::vector<int>& frames) {
  writeText(folder.file("session.yaml"),
            "format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\ncaptures: captures/{pose}.bin\n");
  writeText(folder.file("radar.yaml"), paperRadarYaml(frame_period_s));
  std::string poses = "pose,location,stamp,x,y,z,qx,qy,qz,qw\n";
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const std::string name(1, static_cast<char>('a' + i));
    poses += name + ",spot_" + name + "," + std::to_string(1700000000 + 100 * i) + "," + std::to_string(i) +
             ".0,0.5,1.2,0,0,0.6,0.8\n";
    writeText(folder.file("captures/" + name + ".bin"), randomBytes(2048u * frames[i], static_cast<unsigned>(i)));
  }
  writeText(folder.file("poses.csv"), poses);
}

/// Whether it comes true within a minute: a busy machine may need long for what otherwise takes a moment.
inline bool waitUntil(const std::function<bool()>& condition) {
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return true;
}

/// The emulator as a process of its own.
class EmulatorProcess {
 public:
  EmulatorProcess(const std::string& host_ip, const std::string& card_ip, std::vector<std::string> arguments)
      : process_(MMRADARTWIN_EMULATOR, complete(std::move(arguments), host_ip, card_ip)) {
    waitFor("ready");
  }
  /// The first line that begins so, or nothing after a minute.
  std::optional<std::string> waitFor(const std::string& beginning) {
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < until) {
      const auto line = process_.readLine(100);
      if (line && line->compare(0, beginning.size(), beginning) == 0) return line;
    }
    return std::nullopt;
  }
  /// When the radar's first frame begins; after RECORD_START.
  std::int64_t firstFrame_ns() {
    const std::string armed = "armed first_frame_ns=";
    const auto line = waitFor(armed);
    return line ? std::stoll(line->substr(armed.size())) : 0;
  }
  /// The most, by its own account after it has "completed", that this machine made a packet late.
  static std::int64_t ownLate_ns(const std::string& completed) {
    const std::string key = "own_late_us=";
    return 1000 * std::stoll(completed.substr(completed.find(key) + key.size()));
  }
  ChildProcess& process() { return process_; }

 private:
  static std::vector<std::string> complete(std::vector<std::string> arguments, const std::string& host_ip,
                                           const std::string& card_ip) {
    for (const std::string& more : {std::string("--host-ip"), host_ip, std::string("--card-ip"), card_ip}) {
      arguments.push_back(more);
    }
    arguments.push_back("--end-with-parent");
    return arguments;
  }
  ChildProcess process_;
};

}  // namespace mmradartwin
