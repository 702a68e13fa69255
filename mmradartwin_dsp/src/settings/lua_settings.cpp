#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "settings/lua_script.h"
#include "settings/raw_settings.h"

namespace mmradartwin {
namespace {

/// A call whose arguments are read as numbers.
class SettingsCall {
 public:
  explicit SettingsCall(const ScriptCall& call) : call_(call) {}

  const std::string& where() const { return call_.where; }
  std::size_t size() const { return call_.arguments.size(); }
  /// Throws InputError where the call has fewer or more arguments.
  void count(std::size_t least, std::size_t most) const {
    if (size() >= least && size() <= most) return;
    throw InputError(where() + ": ar1." + call_.name + " has " + std::to_string(size()) +
                     " arguments; known is the form with " + std::to_string(least) +
                     (most > least ? " to " + std::to_string(most) : std::string()) + " (mmWave Studio 2 and 3)");
  }
  double number(std::size_t i) const {
    const ScriptArgument& argument = call_.arguments[i];
    if (argument.number && std::isfinite(*argument.number)) return *argument.number;
    const std::string what = where() + ": argument " + std::to_string(i + 1) + " of ar1." + call_.name;
    if (!argument.unknown_from.empty()) {
      throw InputError(what + " comes from " + argument.unknown_from +
                       ", which only mmWave Studio can answer; write the number in its place");
    }
    throw InputError(what + " is " + (argument.number ? "not finite" : "'" + argument.text + "', which is no number") +
                     "; write the number in its place");
  }
  int integer(std::size_t i) const {
    return wholeNumber(number(i), where() + ": argument " + std::to_string(i + 1) + " of ar1." + call_.name);
  }
  std::string text(std::size_t i) const { return i < size() ? call_.arguments[i].text : ""; }
  /// Whether all arguments from the i-th on are 0 or not given (nil).
  bool zeroFrom(std::size_t i) const {
    for (; i < size(); ++i) {
      if (call_.arguments[i].text != "nil" && number(i) != 0) return false;
    }
    return true;
  }
  [[noreturn]] void refuse(const std::string& why) const { throw InputError(where() + ": ar1." + call_.name + why); }

 private:
  const ScriptCall& call_;
};

void readLuaProfile(const SettingsCall& call, RawSettings& settings) {
  call.count(18, 18);
  RawSettings::Profile profile{};
  profile.start_ghz = call.number(1);
  profile.idle_us = call.number(2);
  profile.adc_start_us = call.number(3);
  profile.ramp_end_us = call.number(4);
  for (std::size_t tx = 0; tx < 3; ++tx) profile.backoff_db[tx] = call.number(5 + tx);
  for (std::size_t tx = 0; tx < 3; ++tx) {
    if (call.number(8 + tx) != 0) {
      throw InputError(call.where() + ": the transmitters' phases are shifted; only unshifted ones are known here");
    }
  }
  profile.slope_mhz_per_us = call.number(11);
  profile.samples = call.integer(13);
  profile.ksps = call.number(14);
  profile.hpf1 = call.integer(15) & 0xffff;  // the upper half carries flags
  profile.hpf2 = call.integer(16) & 0xffff;
  profile.rx_gain = call.integer(17);
  settings.setProfile(call.integer(0), profile, call.where());
}

void readLuaChirps(const SettingsCall& call, RawSettings& settings) {
  call.count(10, 10);
  for (std::size_t i = 3; i < 7; ++i) {
    if (call.number(i) != 0) {
      throw InputError(call.where() + ": this chirp differs from its profile (argument " + std::to_string(i + 1) +
                       "); only chirps that are all alike are known here");
    }
  }
  unsigned mask = 0;
  for (std::size_t tx = 0; tx < 3; ++tx) mask |= call.integer(7 + tx) ? 1u << tx : 0u;
  settings.setChirps(call.integer(0), call.integer(1), {call.integer(2), mask}, call.where());
}

void readLuaFrame(const SettingsCall& call, RawSettings& settings) {
  call.count(6, 9);
  settings.set("chirp_start", call.integer(0), call.where());
  settings.set("chirp_end", call.integer(1), call.where());
  settings.set("loops", call.integer(3), call.where());
  settings.set("period_ms", call.number(4), call.where());
}

void readLuaChannels(const SettingsCall& call, RawSettings& settings) {
  call.count(10, 10);
  int mask = 0;
  for (std::size_t rx = 0; rx < 4; ++rx) mask |= call.integer(3 + rx) & 0xffff ? 1 << rx : 0;
  settings.set("rx_mask", mask, call.where());
  settings.set("adc_bits", call.integer(7), call.where());
  settings.set("adc_format", call.integer(8) & 0xffff, call.where());
  settings.set("iq_swap", call.integer(9) & 0xffff, call.where());
}

void readLuaDataPath(const SettingsCall& call, RawSettings& settings) {
  call.count(3, 3);
  settings.set("interface", call.integer(0) & 0xff, call.where());
  settings.set("packet", call.integer(1) & 0xff, call.where());
  settings.set("second_packet", call.integer(2) & 0x3f, call.where());
}

void readLanes(const SettingsCall& call, RawSettings& settings) {
  call.count(8, 8);
  settings.set("lane_format", call.integer(0), call.where());
  int lanes = 0;
  for (std::size_t lane = 0; lane < 4; ++lane) lanes += call.integer(1 + lane) ? 1 : 0;
  settings.set("lanes", lanes, call.where());
}

void readCardMode(const SettingsCall& call, RawSettings& settings) {
  call.count(6, 6);
  const int lvds = call.integer(1);  // 1: four lanes, 2: two
  if (lvds == 1 || lvds == 2) settings.set("lanes", lvds == 1 ? 4 : 2, call.where());
}

void readPacketDelay(const SettingsCall& call, RawSettings& settings) {
  call.count(1, 1);
  settings.set("packet_delay_us", call.number(0), call.where());
}

void readVariant(const SettingsCall& call, RawSettings& settings) {
  if (call.size() == 1 && !call.text(0).empty()) settings.setDevice(call.text(0), call.where());
}

/// chirp first, chirp last, then what each transmitter does.
void refuseLuaBpm(const SettingsCall& call, RawSettings&) {
  if (!call.zeroFrom(2)) call.refuse(" inverts transmitters by chirp (BPM); " + std::string(kOnlyTdm));
}
void refuseLuaPhases(const SettingsCall& call, RawSettings&) {
  if (!call.zeroFrom(2))
    call.refuse(" shifts transmitters' phases by chirp (beam steering or DDMA); " + std::string(kOnlyTdm));
}
void refuseFrames(const SettingsCall& call, RawSettings&) {
  call.refuse(" is not among the settings that radar.yaml can hold: subframes; " + std::string(kOnlyTdm));
}
void refuseStream(const SettingsCall& call, RawSettings&) {
  call.refuse(" streams a constant frequency; " + std::string(kOnlyTdm));
}

using LuaReader = void (*)(const SettingsCall&, RawSettings&);

const std::map<std::string, LuaReader>& luaReaders() {
  static const std::map<std::string, LuaReader> all = {{"ProfileConfig", readLuaProfile},
                                                       {"ChirpConfig", readLuaChirps},
                                                       {"FrameConfig", readLuaFrame},
                                                       {"ChanNAdcConfig", readLuaChannels},
                                                       {"DataPathConfig", readLuaDataPath},
                                                       {"LVDSLaneConfig", readLanes},
                                                       {"CaptureCardConfig_Mode", readCardMode},
                                                       {"CaptureCardConfig_PacketDelay", readPacketDelay},
                                                       {"deviceVariantSelection", readVariant},
                                                       {"BpmChirpConfig", refuseLuaBpm},
                                                       {"SetPerChirpPhaseShifterConfig", refuseLuaPhases},
                                                       {"AdvanceFrameConfig", refuseFrames},
                                                       {"AdvancedFrameConfig", refuseFrames},
                                                       {"ContStrConfig", refuseStream}};
  return all;
}

bool isCascade(const std::string& name) { return name.find("_mult") != std::string::npos; }
bool isAdvancedChirp(const std::string& name) { return name.find("AdvChirp") != std::string::npos; }
bool configures(const std::string& name) {
  return luaReaders().count(name) > 0 || isCascade(name) || isAdvancedChirp(name);
}

void readCall(const ScriptCall& recorded, RawSettings& settings) {
  const SettingsCall call(recorded);
  const auto reader = luaReaders().find(recorded.name);
  if (isCascade(recorded.name)) call.refuse(" configures one of several devices; a radar.yaml holds one");
  if (isAdvancedChirp(recorded.name)) {
    call.refuse(" sets chirps that differ from their profile (advanced chirps); " + std::string(kOnlyTdm));
  }
  if (reader != luaReaders().end()) reader->second(call, settings);
}

/// The device by its whole name, as in SelectChipVersion("XWR1843"); "AR1642" is a family there.
ScriptCall chosenDevice(const std::vector<ScriptCall>& calls) {
  ScriptCall chosen;
  for (const ScriptCall& call : calls) {
    if (call.arguments.size() != 1 || partOf(call.arguments[0].text).empty()) continue;
    if (call.name == "deviceVariantSelection") return call;
    const char first = static_cast<char>(std::toupper(static_cast<unsigned char>(call.arguments[0].text[0])));
    if (call.name == "SelectChipVersion" && first == 'X') chosen = call;
  }
  return chosen;
}

}  // namespace

void readLuaSettings(const std::string& file, const std::string& text, RawSettings& settings) {
  ScriptRecord record = recordScript(file, text, partOf(settings.device), configures);
  const ScriptCall chosen = chosenDevice(record.calls);
  if (!record.part_asked.empty()) {
    if (chosen.name.empty()) {
      throw InputError(record.part_asked +
                       ": here the script asks which device it configures; say it, as in --device awr1843");
    }
    record = recordScript(file, text, partOf(chosen.arguments[0].text), configures);
  }
  for (const ScriptCall& call : record.calls) readCall(call, settings);
  if (settings.device.empty() && !chosen.name.empty()) settings.setDevice(chosen.arguments[0].text, chosen.where);
  for (const std::string& other : record.left_out) {
    settings.notes.push_back(other + " was not run; where it configures the radar, put its text into the script");
  }
  if (!record.calls.empty()) return;
  throw InputError(file + ": makes no ar1.* call" +
                   (record.left_out.empty() ? "" : " (" + record.left_out.front() + " was not run)") +
                   "; give a mmWave Studio script that does");
}

}  // namespace mmradartwin
