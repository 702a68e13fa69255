#include "mmradartwin_dsp/device_settings.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "files/text_file.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"
#include "settings/raw_settings.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr int kLastChirp = 511;

std::string shortest(double value) { return yamlNumber(value); }

std::string said(double value) { return significantNumber(value, 12); }

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// One step of a path into a JSON file, with errors that name the whole path.
class JsonPlace {
 public:
  JsonPlace(const json& value, const std::string& where) : value_(value), where_(where) {}

  bool has(const std::string& key) const { return value_.is_object() && value_.contains(key); }
  JsonPlace operator[](const std::string& key) const {
    if (!has(key)) throw InputError(where_ + ": has no " + key + "; give settings as mmWave Studio writes them");
    return {value_.at(key), where_ + "/" + key};
  }
  std::vector<JsonPlace> items() const {
    if (!value_.is_array()) throw InputError(where_ + ": must be a list");
    std::vector<JsonPlace> all;
    for (std::size_t i = 0; i < value_.size(); ++i) all.emplace_back(value_[i], where_ + "/" + std::to_string(i));
    return all;
  }
  /// What stands in a list or an object, each with its key.
  std::vector<std::pair<std::string, JsonPlace>> children() const {
    std::vector<std::pair<std::string, JsonPlace>> all;
    if (!value_.is_structured()) return all;
    for (const auto& item : value_.items()) {
      all.emplace_back(value_.is_object() ? item.key() : "", JsonPlace(item.value(), where_ + "/" + item.key()));
    }
    return all;
  }
  bool isNonZero() const { return (value_.is_number() || value_.is_string()) && number() != 0; }
  /// Numbers stand as such, or as text in hexadecimal.
  double number() const {
    if (value_.is_number()) return value_.get<double>();
    if (value_.is_string()) {
      const std::string text = value_.get<std::string>();
      char* end = nullptr;
      const double value = text.compare(0, 2, "0x") == 0 ? static_cast<double>(std::strtoul(text.c_str(), &end, 16))
                                                         : std::strtod(text.c_str(), &end);
      if (!text.empty() && *end == 0) return value;
    }
    throw InputError(where_ + ": " + value_.dump().substr(0, 100) + " is no number");
  }
  int integer() const { return wholeNumber(number(), where_); }
  std::string text() const {
    if (!value_.is_string()) throw InputError(where_ + ": must be text");
    return value_.get<std::string>();
  }
  const std::string& where() const { return where_; }

 private:
  const json& value_;
  std::string where_;
};

/// Whether a number below a key that contains `part` is not 0 (structures, named ..._t, do not count as such a key).
bool holdsNonZero(const JsonPlace& place, const std::string& part, bool below = false) {
  for (const auto& [key, child] : place.children()) {
    const bool structure = key.size() > 2 && key.compare(key.size() - 2, 2, "_t") == 0;
    const bool counts = below || (!structure && key.find(part) != std::string::npos);
    if (child.children().empty() ? counts && child.isNonZero() : holdsNonZero(child, part, counts)) return true;
  }
  return false;
}

/// What a frame of equal chirps, sent by one transmitter each, does not have. Studio writes all lists, mostly empty.
void refuseBeyondTdm(const JsonPlace& rf) {
  const auto refuse = [](const JsonPlace& place, const std::string& what) {
    throw InputError(place.where() + ": " + what + "; " + kOnlyTdm);
  };
  if (rf.has("MIMOScheme")) {
    const std::string scheme = lowerCase(rf["MIMOScheme"].text());
    const std::vector<std::string> known = {"", "tdm", "none", "simo", "siso"};
    if (std::find(known.begin(), known.end(), scheme) == known.end()) {
      refuse(rf["MIMOScheme"], "transmitters send by " + rf["MIMOScheme"].text());
    }
  }
  struct Feature {
    std::string key, part, what;  ///< part: of the keys whose values count; "*": any entry does
  };
  const std::vector<Feature> features = {
      {"rlBpmChirps", "constBpmVal", "transmitters are inverted by chirp (BPM)"},
      {"rlBpmCommonCfg_t", "b2SrcSel", "transmitters are inverted by chirp (BPM)"},
      {"rlRfPhaseShiftCfgs", "PhaseShift", "transmitters' phases are shifted by chirp (beam steering or DDMA)"},
      {"rlDynPerChirpPhShftCfgs", "PhaseShift", "transmitters' phases are shifted by chirp (beam steering or DDMA)"},
      {"rlDynChirpCfgs", "*", "chirps change while frames are sent"},
      {"rlLoopbackBursts", "loopbackSel", "frames hold loopback bursts"}};
  for (const Feature& feature : features) {
    if (!rf.has(feature.key)) continue;
    const JsonPlace place = rf[feature.key];
    const bool there = feature.part == "*" ? !place.children().empty() : holdsNonZero(place, feature.part);
    if (there) refuse(place, feature.what);
  }
  for (const auto& [key, place] : rf.children()) {
    if (key.find("AdvChirp") != std::string::npos && !place.children().empty()) {
      refuse(place, "chirps differ from their profile (advanced chirps)");
    }
  }
}

void readMmwave(const JsonPlace& root, RawSettings& settings) {
  const auto devices = root["mmWaveDevices"].items();
  if (devices.size() != 1) {
    throw InputError(root.where() + ": configures " + std::to_string(devices.size()) +
                     " devices; a radar.yaml holds one");
  }
  const JsonPlace rf = devices[0]["rfConfig"];
  if (rf.has("waveformType") && rf["waveformType"].text() != "legacyFrameChirp") {
    throw InputError(rf["waveformType"].where() + ": is " + rf["waveformType"].text() +
                     "; known is legacyFrameChirp (one frame of equal chirps)");
  }
  const auto set = [&settings](const std::string& name, const JsonPlace& place) {
    settings.set(name, place.integer(), place.where());
  };
  refuseBeyondTdm(rf);
  for (const JsonPlace& item : rf["rlProfiles"].items()) {
    const JsonPlace p = item["rlProfileCfg_t"];
    RawSettings::Profile profile{};
    profile.start_ghz = p["startFreqConst_GHz"].number();
    profile.idle_us = p["idleTimeConst_usec"].number();
    profile.adc_start_us = p["adcStartTimeConst_usec"].number();
    profile.ramp_end_us = p["rampEndTime_usec"].number();
    profile.slope_mhz_per_us = p["freqSlopeConst_MHz_usec"].number();
    profile.samples = p["numAdcSamples"].integer();
    profile.ksps = p["digOutSampleRate"].number();
    profile.hpf1 = p["hpfCornerFreq1"].integer();
    profile.hpf2 = p["hpfCornerFreq2"].integer();
    profile.rx_gain = p["rxGain_dB"].integer();
    const int backoff = p.has("txOutPowerBackoffCode") ? p["txOutPowerBackoffCode"].integer() : 0;
    for (std::size_t tx = 0; tx < 3; ++tx) profile.backoff_db[tx] = backoff >> (8 * tx) & 0xff;
    if (p.has("txPhaseShifter") && p["txPhaseShifter"].integer() != 0) {
      throw InputError(p["txPhaseShifter"].where() +
                       ": the transmitters' phases are shifted; only unshifted ones are known here");
    }
    settings.setProfile(p["profileId"].integer(), profile, p.where());
  }
  for (const JsonPlace& item : rf["rlChirps"].items()) {
    const JsonPlace c = item["rlChirpCfg_t"];
    for (const char* variation :
         {"startFreqVar_MHz", "freqSlopeVar_KHz_usec", "idleTimeVar_usec", "adcStartTimeVar_usec"}) {
      if (c.has(variation) && c[variation].number() != 0) {
        throw InputError(c[variation].where() +
                         ": this chirp differs from its profile; only chirps that are all alike "
                         "are known here");
      }
    }
    settings.setChirps(c["chirpStartIdx"].integer(), c["chirpEndIdx"].integer(),
                       {c["profileId"].integer(), static_cast<unsigned>(c["txEnable"].integer())}, c.where());
  }
  const JsonPlace frame = rf["rlFrameCfg_t"];
  set("chirp_start", frame["chirpStartIdx"]);
  set("chirp_end", frame["chirpEndIdx"]);
  set("loops", frame["numLoops"]);
  settings.set("period_ms", frame["framePeriodicity_msec"].number(), frame.where());
  set("rx_mask", rf["rlChanCfg_t"]["rxChannelEn"]);
  const JsonPlace format = rf["rlAdcOutCfg_t"]["fmt"];
  set("adc_bits", format["b2AdcBits"]);
  set("adc_format", format["b2AdcOutFmt"]);
  const JsonPlace raw = devices[0]["rawDataCaptureConfig"];
  set("iq_swap", raw["rlDevDataFmtCfg_t"]["iqSwapSel"]);
  set("interleave", raw["rlDevDataFmtCfg_t"]["chInterleave"]);
  set("interface", raw["rlDevDataPathCfg_t"]["intfSel"]);
  set("packet", raw["rlDevDataPathCfg_t"]["transferFmtPkt0"]);
  if (raw["rlDevDataPathCfg_t"].has("transferFmtPkt1")) {
    const JsonPlace second = raw["rlDevDataPathCfg_t"]["transferFmtPkt1"];
    settings.set("second_packet", second.integer() & 0x3f, second.where());  // above: a channel of CSI2
  }
  if (raw.has("rlDevLaneEnable_t")) {
    const JsonPlace lanes = raw["rlDevLaneEnable_t"]["laneEn"];
    settings.set("lanes", __builtin_popcount(static_cast<unsigned>(lanes.integer())), lanes.where());
  }
  if (raw.has("rlDevLvdsLaneCfg_t")) set("lane_format", raw["rlDevLvdsLaneCfg_t"]["laneFormat"]);
}

void readCard(const JsonPlace& card, RawSettings& settings) {
  if (card.has("dataLoggingMode") && card["dataLoggingMode"].text() != "raw") {
    throw InputError(card["dataLoggingMode"].where() + ": is '" + card["dataLoggingMode"].text() +
                     "'; only raw captures hold samples as radar.yaml tells them");
  }
  const JsonPlace lanes = card["lvdsMode"];
  if (lanes.integer() != 1 && lanes.integer() != 2) {
    throw InputError(lanes.where() + ": must be 1 (four lanes) or 2 (two lanes)");
  }
  settings.set("lanes", lanes.integer() == 1 ? 4 : 2, lanes.where());
  if (card.has("dataFormatMode")) {
    const JsonPlace format = card["dataFormatMode"];  // 1: 12 bit, 2: 14 bit, 3: 16 bit
    settings.set("adc_bits", format.integer() - 1, format.where());
  }
  if (card.has("packetDelay_us")) {
    settings.set("packet_delay_us", card["packetDelay_us"].number(), card["packetDelay_us"].where());
  }
}

/// Deeper than any of TI's files by far; messages quote values, and quoting recurses.
constexpr int kDeepestJson = 100;

void readJson(const std::string& file, const std::string& text, const std::vector<std::string>& files,
              RawSettings& settings) {
  json root;
  try {
    root = json::parse(text, [&file](int depth, json::parse_event_t, json&) {
      if (depth > kDeepestJson) throw InputError(file + ": is nested too deeply for a settings file");
      return true;
    });
  } catch (const json::exception& error) {
    throw InputError(file + ": is no JSON: " + error.what());
  }
  const JsonPlace place(root, file);
  bool known = false;
  if (place.has("mmWaveDevices")) {
    readMmwave(place, settings);
    known = true;
  }
  if (place.has("DCA1000Config")) {
    readCard(place["DCA1000Config"], settings);
    known = true;
  }
  if (place.has("mmWaveDevice")) settings.setDevice(place["mmWaveDevice"].text(), file);
  if (place.has("configUsed")) {
    known = true;
    // Written on Windows: of the path only the name can be looked for.
    std::string name = place["configUsed"].text();
    name = name.substr(name.find_last_of("/\\") + 1);
    const bool given = std::any_of(files.begin(), files.end(),
                                   [&](const std::string& other) { return fs::path(other).filename() == name; });
    const std::string beside = (fs::path(file).parent_path() / name).string();
    std::error_code error;
    if (!given && !fs::exists(beside, error)) {
      throw InputError(file + ": names " + name + ", which is not beside it; put it there or give it too");
    }
    if (!given) {
      std::vector<std::string> known = files;
      known.insert(known.end(), {file, beside});
      readJson(beside, readTextFile(beside, "give a JSON file that exists"), known, settings);
    }
  }
  if (!known) {
    throw InputError(file +
                     ": is none of the known JSON files (mmWave Studio's *.mmwave.json with mmWaveDevices, its "
                     "setup.json with configUsed, cf.json with DCA1000Config)");
  }
}

double required(const RawSettings& settings, const std::string& name, const std::string& from) {
  const auto value = settings.values.find(name);
  if (value == settings.values.end())
    throw InputError("the settings do not say " + from + "; give the file that does too");
  return value->second.value;
}

void demand(const RawSettings& settings, const std::string& name, const std::vector<int>& allowed,
            const std::string& why) {
  const auto value = settings.values.find(name);
  if (value == settings.values.end()) return;
  if (std::find(allowed.begin(), allowed.end(), static_cast<int>(value->second.value)) != allowed.end()) return;
  throw InputError(value->second.where + ": " + shortest(value->second.value) + ": " + why);
}

/// Whether a device of this name has the antennas of TI's BOOST boards: its part, a letter of its revision, or the
/// board. Antennas on the package (AOP), those of ODS boards and of cascades stand elsewhere.
bool hasBoostAntennas(const std::string& device) {
  const std::string part = partOf(device);
  std::string variant = device.substr(device.find(part) + part.size());
  for (const std::string& board : {std::string("boost"), std::string("isk")}) {
    const bool ends =
        variant.size() >= board.size() && variant.compare(variant.size() - board.size(), board.size(), board) == 0;
    if (ends) variant.resize(variant.size() - board.size());
  }
  return variant.size() <= 1;
}

void placeAntennas(ImportedSettings& imported, const std::string& digits, const std::vector<int>& receivers,
                   const std::vector<int>& transmitters) {
  const bool two = digits.compare(0, 2, "16") == 0;  // xWR16xx have two transmitters, the others three
  const double half_m = std::round(kSpeedOfLight_m_per_s / imported.radar.carrier_hz / 2 * 1e7) * 1e-7;
  for (const int rx : receivers) imported.radar.rx_position_m.emplace_back(0, rx * half_m, 0);
  for (const int tx : transmitters) {
    const bool raised = !two && tx == 1;
    const double halves = tx == 0 ? 0 : raised ? 2 : 4;
    imported.radar.tx_position_m.emplace_back(0, halves * half_m, raised ? half_m : 0);
  }
  imported.assumed.push_back("antenna positions: those of TI's BOOST boards for this device, elements " +
                             shortest(half_m) +
                             " m (half a wavelength at the chirp's start) apart along y; check "
                             "them, and the sign of y, against the board as it is mounted");
  const std::vector<int> line = imported.radar.slotsOnALine();
  if (line.empty() || static_cast<int>(line.size()) == imported.radar.slots()) return;
  imported.radar.angle_slots = line;
  imported.assumed.push_back(
      "angle_slots: the slots on a line; the others' transmitter is raised, which the angle transform cannot use");
}

}  // namespace

void RawSettings::set(const std::string& name, double value, const std::string& where) {
  const auto [known, fresh] = values.emplace(name, Given{value, where});
  if (fresh || known->second.value == value) return;
  throw InputError(where + ": " + name + " is " + said(value) + ", but " + known->second.where + " says " +
                   said(known->second.value) + "; give one configuration");
}

std::string partOf(const std::string& device) {
  const std::size_t digit = device.find_first_of("0123456789");
  return digit == std::string::npos ? "" : device.substr(digit, 4);
}

void RawSettings::setDevice(const std::string& name, const std::string& where) {
  std::string plain;
  for (const char c : lowerCase(name)) {
    if (std::isalnum(static_cast<unsigned char>(c))) plain += c;
  }
  const auto isFamily = [](const std::string& text) { return text.compare(0, 3, "xwr") == 0; };
  const bool same_part = !partOf(plain).empty() && partOf(plain) == partOf(device);
  if (same_part && (isFamily(plain) || isFamily(device))) {
    // The prefix of one and the variant (such as AOP) of the other; a person who names the device means just that.
    const auto variantOf = [](const std::string& text) { return text.substr(text.find(partOf(text)) + 4); };
    const std::string& exact = isFamily(device) ? plain : device;
    const bool stated = device_from == "--device" || variantOf(device).size() > variantOf(plain).size();
    const std::string variant = variantOf(stated ? device : plain);
    device = exact.substr(0, exact.find(partOf(exact)) + 4) + variant;
    return;
  }
  // A person may leave out the variant that a file names: so its antennas are not those of the file's device.
  if (device_from == "--device" && same_part && plain.compare(0, device.size(), device) == 0) return;
  if (!device.empty() && device != plain) {
    throw InputError(where + ": the device is " + plain + ", but " + device_from + " says " + device +
                     "; give one configuration");
  }
  device = plain;
  device_from = where;
}

void RawSettings::setProfile(int id, const Profile& profile, const std::string& where) {
  const auto [known, fresh] = profiles.emplace(id, profile);
  const auto values = [](const Profile& p) {
    return std::vector<std::pair<const char*, double>>{{"start in GHz", p.start_ghz},
                                                       {"idle time in us", p.idle_us},
                                                       {"ADC start in us", p.adc_start_us},
                                                       {"ramp end in us", p.ramp_end_us},
                                                       {"slope in MHz/us", p.slope_mhz_per_us},
                                                       {"sample rate in ksps", p.ksps},
                                                       {"number of samples", p.samples},
                                                       {"first high-pass code", p.hpf1},
                                                       {"second high-pass code", p.hpf2},
                                                       {"receiver gain code", p.rx_gain},
                                                       {"backoff of TX 0 in dB", p.backoff_db[0]},
                                                       {"backoff of TX 1 in dB", p.backoff_db[1]},
                                                       {"backoff of TX 2 in dB", p.backoff_db[2]}};
  };
  if (fresh) {
    profile_from[id] = where;
    return;
  }
  const auto now = values(profile), before = values(known->second);
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].second == before[i].second) continue;
    throw InputError(where + ": profile " + std::to_string(id) + " is given twice: its " + now[i].first + " is " +
                     said(now[i].second) + ", but " + profile_from[id] + " says " + said(before[i].second) +
                     "; give one configuration");
  }
}

void RawSettings::setChirps(int first, int last, const Chirp& chirp, const std::string& where) {
  if (first < 0 || last < first || last > kLastChirp) {
    throw InputError(where + ": chirps " + std::to_string(first) + " to " + std::to_string(last) +
                     ": must be within 0 to " + std::to_string(kLastChirp) + ", in order");
  }
  for (int i = first; i <= last; ++i) {
    const auto [known, fresh] = chirps.emplace(i, chirp);
    if (fresh) {
      known->second.where = where;
    } else if (known->second.tx_mask != chirp.tx_mask || known->second.profile != chirp.profile) {
      known->second.conflict = where;
    }
  }
}

int wholeNumber(double value, const std::string& what) {
  if (value != std::floor(value) || std::abs(value) > 4294967295.0) {
    throw InputError(what + ": " + shortest(value) + " must be a whole number of at most 32 bits");
  }
  return static_cast<int>(static_cast<long long>(value));
}

namespace {

enum class SettingsFormat { kXml, kJson, kSdk, kLua };  // scripts are run last: for the device that other files name

/// By what a file holds, and by its name only where that does not tell.
SettingsFormat formatOf(const std::string& file, const std::string& text) {
  const std::size_t start = text.compare(0, 3, "\xEF\xBB\xBF") == 0 ? 3 : 0;
  const std::size_t first = text.find_first_not_of(" \t\r\n", start);
  const char head = first == std::string::npos ? '\0' : text[first];
  if (head == '<') return SettingsFormat::kXml;
  if (head == '{') return SettingsFormat::kJson;
  if (text.find("ar1.") != std::string::npos) return SettingsFormat::kLua;
  if (looksLikeSdkSettings(text)) return SettingsFormat::kSdk;
  const std::string extension = lowerCase(fs::path(file).extension().string());
  if (extension == ".lua") return SettingsFormat::kLua;
  if (extension == ".json") return SettingsFormat::kJson;
  if (extension == ".xml") return SettingsFormat::kXml;
  throw InputError(file +
                   ": is no settings file that is known; give mmWave Studio's .lua, .xml or .json, the DCA1000's "
                   "cf.json, or profile.cfg of the mmWave SDK");
}

RawSettings readSettings(const std::vector<std::string>& files, const std::string& device) {
  if (files.empty()) throw InputError("no settings file; give a .lua script, XML, JSON or profile.cfg");
  RawSettings raw;
  if (!device.empty()) raw.setDevice(device, "--device");
  std::multimap<SettingsFormat, std::pair<std::string, std::string>> texts;
  for (const std::string& file : files) {
    std::string text = readTextFile(file, "give a settings file that exists");
    const SettingsFormat format = formatOf(file, text);
    texts.emplace(format, std::make_pair(file, std::move(text)));
  }
  for (const auto& [format, named] : texts) {
    const auto& [file, text] = named;
    switch (format) {
      case SettingsFormat::kXml:
        readXmlSettings(file, text, raw);
        break;
      case SettingsFormat::kJson:
        readJson(file, text, files, raw);
        break;
      case SettingsFormat::kSdk:
        readSdkSettings(file, text, raw);
        break;
      case SettingsFormat::kLua:
        readLuaSettings(file, text, raw);
        break;
    }
  }
  if (raw.device.empty()) {
    throw InputError(files.front() + ": does not say which device it is for; give setup.json too, or --device awr2243");
  }
  return raw;
}

struct Device {
  std::string digits;  ///< those of its name, such as 2243
  CaptureLayout layout;
};

Device knownDevice(const RawSettings& raw) {
  const std::size_t digit = raw.device.find_first_of("0123456789");
  const std::string digits = digit == std::string::npos ? "" : raw.device.substr(digit, 4);
  const std::vector<std::string> known = {"1243", "1443", "2243", "1642", "1843", "6443", "6843"};
  const std::optional<CaptureLayout> layout = captureLayoutOf(raw.device);
  if (!layout || std::find(known.begin(), known.end(), digits) == known.end()) {
    throw InputError(raw.device_from + ": device '" + raw.device +
                     "' is not known; known are xWR1243, 1443, 2243, 1642, 1843, 6443 and 6843");
  }
  if (!hasBoostAntennas(raw.device)) {
    const std::string plain = raw.device.substr(0, raw.device.find(digits) + digits.size());
    throw InputError(raw.device_from + ": device '" + raw.device +
                     "': its antennas are not those of TI's BOOST boards, the only ones that are known here, and no "
                     "settings file says where they are; give the positions yourself: import with --device " +
                     plain + ", then set tx_position_m and rx_position_m in radar.yaml by the data sheet of '" +
                     raw.device + "'");
  }
  return {digits, *layout};
}

struct FrameChirps {
  std::vector<int> transmitters;  ///< of each chirp
  int profile = 0;                ///< that of all of them
};

FrameChirps frameChirps(const RawSettings& raw) {
  const int first = static_cast<int>(required(raw, "chirp_start", "which chirps a frame has (FrameConfig)"));
  const int last = static_cast<int>(required(raw, "chirp_end", "which chirps a frame has (FrameConfig)"));
  if (first < 0 || last < first || last > kLastChirp) {
    throw InputError(raw.values.at("chirp_end").where + ": chirps " + std::to_string(first) + " to " +
                     std::to_string(last) + " of a frame: must be within 0 to " + std::to_string(kLastChirp) +
                     ", in order");
  }
  std::vector<int> transmitters;
  std::optional<int> profile_id;
  for (int chirp = first; chirp <= last; ++chirp) {
    const auto found = raw.chirps.find(chirp);
    if (found == raw.chirps.end()) {
      throw InputError(raw.values.at("chirp_end").where + ": the frame uses chirp " + std::to_string(chirp) +
                       ", which is not configured" +
                       (raw.only_last_chirps.empty() ? ""
                                                     : " in " + raw.only_last_chirps +
                                                           ": mmWave Studio's XML keeps the chirps that were set last "
                                                           "only; give the script or the JSON instead"));
    }
    if (!found->second.conflict.empty()) {
      throw InputError(found->second.conflict + ": chirp " + std::to_string(chirp) +
                       " is configured otherwise than at " + found->second.where + "; give one configuration");
    }
    if (profile_id && *profile_id != found->second.profile) {
      throw InputError(found->second.where + ": the frame's chirps have several profiles; a radar.yaml holds one");
    }
    profile_id = found->second.profile;
    const unsigned mask = found->second.tx_mask;
    if (mask != 1 && mask != 2 && mask != 4) {
      throw InputError(found->second.where + ": chirp " + std::to_string(chirp) + " is sent by transmitters of mask " +
                       std::to_string(mask) +
                       ": where several send at once (or none), its position in the virtual array is not known here");
    }
    transmitters.push_back(mask == 4 ? 2 : static_cast<int>(mask) - 1);
  }
  return {transmitters, *profile_id};
}

const RawSettings::Profile& profileOf(const RawSettings& raw, int id) {
  const auto used = raw.profiles.find(id);
  if (used == raw.profiles.end()) {
    throw InputError("the frame's chirps have profile " + std::to_string(id) + ", which is not configured");
  }
  return used->second;
}

void setChirp(RadarConfig& radar, const RawSettings::Profile& profile) {
  radar.carrier_hz = std::round(profile.start_ghz * 1e9);
  radar.slope_hz_per_s = std::round(profile.slope_mhz_per_us * 1e9) * 1e3;
  radar.samples_per_chirp = profile.samples;
  radar.sample_rate_hz = profile.ksps * 1e3;
  radar.adc_start_s = profile.adc_start_us / 1e6;
  radar.idle_s = profile.idle_us / 1e6;
  radar.ramp_end_s = profile.ramp_end_us / 1e6;
}

void setGains(ImportedSettings& imported, const RawSettings::Profile& profile, const std::vector<int>& transmitters) {
  RadarConfig& radar = imported.radar;
  radar.rx_gain_db = profile.rx_gain & 0x3f;
  if (profile.rx_gain & 0xc0) {
    imported.assumed.push_back("rx_gain_db: bits 5:0 of the gain field " + std::to_string(profile.rx_gain) +
                               "; the RF gain target in its bits 7:6 is not kept");
  }
  const double backoff_db = profile.backoff_db[static_cast<std::size_t>(transmitters.front())];
  const bool same = std::all_of(transmitters.begin(), transmitters.end(),
                                [&](int tx) { return profile.backoff_db[static_cast<std::size_t>(tx)] == backoff_db; });
  if (same) {
    radar.tx_backoff_db = backoff_db;
  } else {
    imported.assumed.push_back("tx_backoff_db left out: the transmitters' backoffs differ");
  }
}

void setHighPass(RadarConfig& radar, const std::string& profile_from, const RawSettings::Profile& profile) {
  const double corner1[] = {175e3, 235e3, 350e3, 700e3}, corner2[] = {350e3, 700e3, 1.4e6, 2.8e6};
  if (profile.hpf1 < 0 || profile.hpf1 > 3 || profile.hpf2 < 0 || profile.hpf2 > 3) {
    throw InputError(profile_from + ": high-pass codes " + std::to_string(profile.hpf1) + " and " +
                     std::to_string(profile.hpf2) + ": must be 0 to 3");
  }
  radar.if_highpass_hz = {corner1[profile.hpf1], corner2[profile.hpf2]};
}

/// How samples leave the device; throws InputError for forms that no capture layout has.
void setSampleFormat(ImportedSettings& imported, const RawSettings& raw, const Device& device) {
  demand(raw, "adc_bits", {2}, "samples must have 16 bits (code 2; in cf.json dataFormatMode 3)");
  demand(raw, "adc_format", {1, 2}, "samples must be complex (code 1 or 2)");
  demand(raw, "interface", {1}, "samples must leave over LVDS (code 1)");
  demand(raw, "packet", {1}, "packets must hold ADC samples only (code 1)");
  demand(raw, "second_packet", {0},
         "a second packet (chirp parameters, chirp quality) stands between the samples; "
         "captures are known with ADC samples only (0)");
  demand(raw, "lane_format", {0}, "lanes must be in their order (format map 0)");
  demand(raw, "iq_swap", {0, 1}, "must be 0 (I first) or 1 (Q first)");
  const bool four_lanes = device.layout == CaptureLayout::kFourLane;
  if (!raw.sdk_from.empty() && !raw.values.count("lanes")) {
    imported.assumed.push_back(std::string(four_lanes ? "four" : "two") + " LVDS lanes, as this device has them");
  } else if (const int lanes = static_cast<int>(
                 required(raw, "lanes", "how many LVDS lanes there are (LVDSLaneConfig, laneEn or cf.json)"));
             lanes != (four_lanes ? 4 : 2)) {
    throw InputError(raw.values.at("lanes").where + ": " + std::to_string(lanes) + " LVDS lanes of an " + raw.device +
                     ": known are four of xWR1243, 1443 and 2243, and two of the others");
  }
  demand(raw, "interleave", {four_lanes ? 0 : 1},
         std::string("samples of this device must be ") + (four_lanes ? "interleaved (0)" : "non-interleaved (1)"));
  imported.radar.layout = device.layout;
  if (raw.values.count("iq_swap")) {
    imported.radar.iq_order = raw.values.at("iq_swap").value != 0 ? IqOrder::kQi : IqOrder::kIq;
  } else {
    imported.assumed.push_back("iq_order: I first, as devices send it unless told otherwise");
  }
  if (raw.values.count("adc_format") && raw.values.at("adc_format").value == 2) {
    imported.assumed.push_back(
        "complex 2x samples: the band is symmetric, so that range bins beyond N/2 hold no echo, and the range ends at "
        "half of what radar.yaml's numbers give");
  }
  for (const char* name : {"adc_bits", "adc_format", "packet"}) {
    if (!raw.values.count(name)) {
      imported.assumed.push_back("16-bit complex ADC samples: the files do not say all of it");
      break;
    }
  }
}

}  // namespace

ImportedSettings importSettings(const std::vector<std::string>& files, const std::string& device_name) {
  const RawSettings raw = readSettings(files, device_name);
  const Device device = knownDevice(raw);
  ImportedSettings imported;
  RadarConfig& radar = imported.radar;
  radar.device = raw.device.compare(0, 3, "xwr") == 0 && device.digits == "2243" ? "awr2243" : raw.device;
  const FrameChirps chirps = frameChirps(raw);
  for (const int transmitter : chirps.transmitters) radar.tx_enable.push_back({transmitter});
  const RawSettings::Profile& profile = profileOf(raw, chirps.profile);
  setChirp(radar, profile);
  radar.loops_per_frame = static_cast<int>(required(raw, "loops", "how many loops a frame has (FrameConfig)"));
  radar.frame_period_s = required(raw, "period_ms", "the frame period (FrameConfig)") / 1e3;
  setGains(imported, profile, chirps.transmitters);
  setHighPass(radar, raw.profile_from.at(chirps.profile), profile);
  setSampleFormat(imported, raw, device);
  const int rx_mask = static_cast<int>(required(raw, "rx_mask", "which receivers are on (ChanNAdcConfig)"));
  for (int rx = 0; rx < 4; ++rx) {
    if (rx_mask >> rx & 1) radar.rx_enable.push_back(rx);
  }
  placeAntennas(imported, device.digits, radar.rx_enable, chirps.transmitters);
  if (raw.values.count("packet_delay_us")) {
    imported.assumed.push_back("the card's packet delay is no part of radar.yaml: give the driver packet_delay_us:=" +
                               shortest(raw.values.at("packet_delay_us").value));
  }
  imported.assumed.insert(imported.assumed.end(), raw.notes.begin(), raw.notes.end());
  parseRadarConfig(toYaml(radar), files.front());  // its ranges hold for imported values too
  return imported;
}

std::string toYaml(const ImportedSettings& settings) {
  std::string text = "# From TI's settings. What they do not say:\n";
  for (const std::string& line : settings.assumed) text += "# - " + line + "\n";
  return text + toYaml(settings.radar);
}

}  // namespace mmradartwin
