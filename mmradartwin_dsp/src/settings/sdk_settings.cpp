#include <cmath>
#include <cstdlib>
#include <iterator>
#include <set>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "settings/raw_settings.h"

namespace mmradartwin {
namespace {

/// One line of the file: a command and its arguments.
class Command {
 public:
  Command(const std::string& line, const std::string& where) : where_(where) {
    std::istringstream words(line.substr(0, line.find_first_of("%#")));
    words >> name_;
    for (std::string word; words >> word;) arguments_.push_back(word);
  }

  const std::string& name() const { return name_; }
  const std::string& where() const { return where_; }
  std::size_t size() const { return arguments_.size(); }
  /// Throws InputError where the command has fewer or more arguments.
  void count(std::size_t least, std::size_t most) const {
    if (size() >= least && size() <= most) return;
    throw InputError(where_ + ": " + name_ + " has " + std::to_string(size()) + " arguments; known is the form with " +
                     std::to_string(least) + (most > least ? " to " + std::to_string(most) : std::string()) +
                     " (mmWave SDK 1 to 3)");
  }
  double number(std::size_t i) const {
    char* end = nullptr;
    const double value = std::strtod(arguments_[i].c_str(), &end);
    if (*end != 0 || !std::isfinite(value)) {
      throw InputError(where_ + ": argument " + std::to_string(i + 1) + " of " + name_ + ", '" + arguments_[i] +
                       "', is no number");
    }
    return value;
  }
  int integer(std::size_t i) const {
    return wholeNumber(number(i), where_ + ": argument " + std::to_string(i + 1) + " of " + name_);
  }
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(where_ + ": " + name_ + " " + why + "; " + kOnlyTdm);
  }

 private:
  std::string name_, where_;
  std::vector<std::string> arguments_;
};

void readProfile(const Command& command, RawSettings& settings) {
  command.count(14, 14);
  RawSettings::Profile profile{};
  profile.start_ghz = command.number(1);
  profile.idle_us = command.number(2);
  profile.adc_start_us = command.number(3);
  profile.ramp_end_us = command.number(4);
  const int backoff = command.integer(5);
  for (std::size_t tx = 0; tx < 3; ++tx) profile.backoff_db[tx] = backoff >> (8 * tx) & 0xff;
  if (command.number(6) != 0) command.refuse("shifts the transmitters' phases (argument 7)");
  profile.slope_mhz_per_us = command.number(7);
  profile.samples = command.integer(9);
  profile.ksps = command.number(10);
  profile.hpf1 = command.integer(11);
  profile.hpf2 = command.integer(12);
  profile.rx_gain = command.integer(13);
  settings.setProfile(command.integer(0), profile, command.where());
}

void readChirps(const Command& command, RawSettings& settings) {
  command.count(8, 8);
  for (std::size_t i = 3; i < 7; ++i) {
    if (command.number(i) != 0) {
      command.refuse("differs from its profile (argument " + std::to_string(i + 1) + ")");
    }
  }
  settings.setChirps(command.integer(0), command.integer(1),
                     {command.integer(2), static_cast<unsigned>(command.integer(7))}, command.where());
}

void readFrame(const Command& command, RawSettings& settings) {
  command.count(7, 7);
  settings.set("chirp_start", command.integer(0), command.where());
  settings.set("chirp_end", command.integer(1), command.where());
  settings.set("loops", command.integer(2), command.where());
  settings.set("period_ms", command.number(4), command.where());
}

void readChannels(const Command& command, RawSettings& settings) {
  command.count(3, 3);
  settings.set("rx_mask", command.integer(0), command.where());
  if (command.integer(2) != 0) {
    throw InputError(command.where() + ": channelCfg cascades devices; a radar.yaml holds one");
  }
}

void readAdc(const Command& command, RawSettings& settings) {
  command.count(2, 2);
  settings.set("adc_bits", command.integer(0), command.where());
  settings.set("adc_format", command.integer(1), command.where());
}

/// [subframe,] real, Q first, RX after RX, chirps of a buffer. SDK 1 has no subframe.
void readAdcBuffer(const Command& command, RawSettings& settings) {
  command.count(4, 5);
  const std::size_t first = command.size() - 4;
  if (command.integer(first) != 0) {
    throw InputError(command.where() + ": adcbufCfg: samples must be complex (code 0), these are real");
  }
  settings.set("iq_swap", command.integer(first + 1), command.where());
  settings.set("interleave", command.integer(first + 2), command.where());
}

/// subframe, HSI header, samples (0: none, 1: samples, 4: with chirp parameters and quality), data of the program.
void readStream(const Command& command, RawSettings& settings) {
  command.count(4, 4);
  const auto note = [&](const std::string& text) { settings.notes.push_back(command.where() + ": " + text); };
  const int samples = command.integer(2);
  if (samples == 0) {
    note("lvdsStreamCfg sends no ADC samples over LVDS: captures come from other settings than these");
  } else if (samples != 1) {
    throw InputError(command.where() + ": lvdsStreamCfg sends more than ADC samples (data format " +
                     std::to_string(samples) + "); captures are known with samples only (1)");
  }
  if (samples != 0) {
    settings.set("interface", 1, command.where());
    settings.set("packet", 1, command.where());
    if (command.integer(1) != 0) note("lvdsStreamCfg puts an HSI header before the samples of each chirp");
  }
  if (command.integer(3) != 0) {
    throw InputError(command.where() +
                     ": lvdsStreamCfg sends data of the program between the frames (argument 4); captures are known "
                     "with ADC samples only (0)");
  }
}

void refuseBpm(const Command& command, RawSettings&) {
  command.count(2, 4);
  if (command.integer(1) != 0) command.refuse("is on: transmitters are inverted by chirp (BPM)");
}
void readOutputMode(const Command& command, RawSettings&) {
  command.count(1, 1);
  const int mode = command.integer(0);
  if (mode == 2) command.refuse("2 streams a constant frequency");
  if (mode == 3) command.refuse("3 sends advanced frames (advFrameCfg, subFrameCfg)");
  if (mode != 1) command.refuse(std::to_string(mode) + " is not known");
}
void refuseSubframes(const Command& command, RawSettings&) {
  command.refuse("sends advanced frames of several subframes");
}
void refuseAdvancedChirp(const Command& command, RawSettings&) {
  command.refuse("sends chirps that differ from their profile (advanced chirps)");
}
void refuseLowPower(const Command& command, RawSettings&) {
  throw InputError(command.where() + ": " + command.name() +
                   " belongs to the low-power devices (xWRL6432 and its like), which are not known here; known are "
                   "xWR1243, 1443, 2243, 1642, 1843, 6443 and 6843");
}
void refusePhases(const Command& command, RawSettings&) { command.refuse("shifts transmitters' phases by chirp"); }

/// What this file configured before is no longer valid, but for channels and samples.
void flush(const Command& command, RawSettings& settings) {
  const std::string file = command.where().substr(0, command.where().rfind(':') + 1);
  const auto here = [&](const std::string& where) { return where.compare(0, file.size(), file) == 0; };
  const auto forget = [](auto& map, const auto& condition) {
    for (auto it = map.begin(); it != map.end();) it = condition(*it) ? map.erase(it) : std::next(it);
  };
  forget(settings.profiles, [&](const auto& profile) { return here(settings.profile_from[profile.first]); });
  forget(settings.chirps, [&](const auto& chirp) { return here(chirp.second.where); });
  for (const char* name : {"chirp_start", "chirp_end", "loops", "period_ms"}) {
    const auto value = settings.values.find(name);
    if (value != settings.values.end() && here(value->second.where)) settings.values.erase(value);
  }
}

using Reader = void (*)(const Command&, RawSettings&);

/// Commands that say how samples are made; the demos have many others, about what becomes of the samples.
const std::map<std::string, Reader>& readers() {
  static const std::map<std::string, Reader> all = {{"channelCfg", readChannels},
                                                    {"adcCfg", readAdc},
                                                    {"adcbufCfg", readAdcBuffer},
                                                    {"profileCfg", readProfile},
                                                    {"chirpCfg", readChirps},
                                                    {"frameCfg", readFrame},
                                                    {"dfeDataOutputMode", readOutputMode},
                                                    {"lvdsStreamCfg", readStream},
                                                    {"flushCfg", flush},
                                                    {"bpmCfg", refuseBpm},
                                                    {"advFrameCfg", refuseSubframes},
                                                    {"subFrameCfg", refuseSubframes},
                                                    {"chirpComnCfg", refuseLowPower},
                                                    {"chirpTimingCfg", refuseLowPower},
                                                    {"advChirpCfg", refuseAdvancedChirp},
                                                    {"LUTDataCfg", refuseAdvancedChirp},
                                                    {"perChirpPhaseShiftCfg", refusePhases},
                                                    {"phaseShiftCfg", refusePhases}};
  return all;
}

/// TI's visualizer writes "% Platform:xWR68xx_AOP": the first part of the family.
void readPlatform(const std::string& line, const std::string& where, RawSettings& settings) {
  const std::size_t at = line.find("Platform:xWR");
  if (line.compare(0, 1, "%") != 0 || at == std::string::npos) return;
  static const std::map<std::string, std::string> parts = {{"12", "1243"}, {"14", "1443"}, {"16", "1642"},
                                                           {"18", "1843"}, {"64", "6443"}, {"68", "6843"}};
  const std::string family = line.substr(at + 12, 2);
  const auto part = parts.find(family);
  if (part == parts.end()) return;
  if (partOf(settings.device).compare(0, 2, family) == 0) return;
  const bool on_package = line.find("AOP", at) != std::string::npos;
  settings.setDevice("xwr" + part->second + (on_package ? "aop" : ""), where);
}

}  // namespace

bool looksLikeSdkSettings(const std::string& text) {
  static const std::set<std::string> others = {"sensorStop", "sensorStart", "guiMonitor", "lowPower", "cfarCfg"};
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const Command command(line, "");
    if (command.name().empty()) continue;
    if (readers().count(command.name()) || others.count(command.name())) return true;
  }
  return false;
}

void readSdkSettings(const std::string& file, const std::string& text, RawSettings& settings) {
  settings.sdk_from = file;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    const std::string where = file + ":" + std::to_string(++number);
    readPlatform(line, where, settings);
    const Command command(line, where);
    const auto reader = readers().find(command.name());
    if (reader != readers().end()) reader->second(command, settings);
  }
}

}  // namespace mmradartwin
