#include <tinyxml2.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>

#include "mmradartwin_dsp/input_error.h"
#include "settings/raw_settings.h"

namespace mmradartwin {
namespace {

/// One section of the file, <apiname_..._cfg> with <param name="..." value="..."/> in it.
class Section {
 public:
  Section(const tinyxml2::XMLElement* root, const std::string& file, const std::string& name)
      : where_(file + ": " + name), element_(root->FirstChildElement(name.c_str())) {
    for (auto* param = element_ ? element_->FirstChildElement("param") : nullptr; param;
         param = param->NextSiblingElement("param")) {
      const char* key = param->Attribute("name");
      const char* value = param->Attribute("value");
      if (!key || !value) throw InputError(where_ + ": has a param without name or value");
      if (!values_.emplace(key, value).second) throw InputError(where_ + ": " + key + " is given twice");
    }
    if (element_ && element_->NextSiblingElement(name.c_str())) {
      throw InputError(where_ + ": is there twice; give one configuration");
    }
  }
  bool there() const { return element_ != nullptr; }
  bool has(const std::string& key) const { return values_.count(key) > 0; }
  const std::string& where() const { return where_; }
  double number(const std::string& key) const {
    const auto found = values_.find(key);
    if (found == values_.end())
      throw InputError(where_ + ": has no " + key + "; give a file as mmWave Studio saves it");
    std::string text = found->second;
    // Saved under a locale with a decimal comma.
    const std::size_t comma = text.find(',');
    if (comma != std::string::npos && text.find('.') == std::string::npos) text[comma] = '.';
    char* end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (text.empty() || *end != 0 || !std::isfinite(value)) {
      throw InputError(where_ + ": " + key + " '" + found->second + "' is no number");
    }
    return value;
  }
  int integer(const std::string& key) const { return wholeNumber(number(key), where_ + ": " + key); }
  /// Of switches FIRST0SECOND, FIRST1SECOND...: a bit for each that is on.
  int mask(const std::string& head, int from, int count, const std::string& tail) const {
    int bits = 0;
    for (int i = 0; i < count; ++i) {
      if (integer(head + std::to_string(from + i) + tail) != 0) bits |= 1 << i;
    }
    return bits;
  }

 private:
  std::string where_;
  const tinyxml2::XMLElement* element_;
  std::map<std::string, std::string> values_;
};

void readXmlProfile(const Section& section, RawSettings& settings) {
  RawSettings::Profile profile{};
  profile.start_ghz = section.number("startFreqConst");
  profile.idle_us = section.number("idleTimeConst");
  profile.adc_start_us = section.number("adcStartTimeConst");
  profile.ramp_end_us = section.number("rampEndTime");
  profile.slope_mhz_per_us = section.number("freqSlopeConst");
  profile.samples = section.integer("numAdcSamples");
  profile.ksps = section.number("digOutSampleRate");
  profile.hpf1 = section.integer("hpfCornerFreq1");
  profile.hpf2 = section.integer("hpfCornerFreq2");
  profile.rx_gain = section.integer("rxGain");
  for (int tx = 1; tx <= 3; ++tx) {
    const std::string name = "tx" + std::to_string(tx);
    if (section.has(name + "OutPowerBackoffCode")) {
      profile.backoff_db[static_cast<std::size_t>(tx - 1)] = section.number(name + "OutPowerBackoffCode");
    }
    if (section.has(name + "PhaseShifter") && section.number(name + "PhaseShifter") != 0) {
      throw InputError(section.where() + ": the transmitters' phases are shifted; only unshifted ones are known here");
    }
  }
  settings.setProfile(section.integer("pprofileId"), profile, section.where());
}

void readXmlChirps(const Section& section, RawSettings& settings) {
  for (const char* variation : {"startFreqVar", "freqSlopeVar", "idleTimeVar", "adcStartTimeVar"}) {
    if (section.has(variation) && section.number(variation) != 0) {
      throw InputError(section.where() + ": " + variation +
                       " is not 0: this chirp differs from its profile; only chirps that are all alike are known here");
    }
  }
  const auto mask = static_cast<unsigned>(section.mask("tx", 1, 3, "Enable"));
  settings.setChirps(section.integer("chirpStartIdx"), section.integer("chirpEndIdx"),
                     {section.integer("cprofileId"), mask}, section.where());
}

/// The section holds places in the lists of Studio's window, not the values that it sends. Saved files of captures over
/// LVDS that hold ADC samples only have 1 and 0 (first packet: samples, second: none); no public document says what
/// the others stand for.
void readXmlDataPath(const Section& section, RawSettings& settings) {
  const auto known = [&](const std::string& key, int value, const std::string& meaning) {
    if (section.integer(key) == value) return;
    throw InputError(section.where() + ": " + key + " is " + std::to_string(section.integer(key)) + ", known is " +
                     std::to_string(value) + " (" + meaning +
                     "): TI does not document what others mean; give the script or the JSON instead, which say it");
  };
  known("dataPathCfgPath", 1, "LVDS");
  known("dataCfgFmt0", 0, "ADC samples only");
  if (section.has("dataCfgFmt1")) known("dataCfgFmt1", 0, "no second packet");
  settings.set("interface", 1, section.where());
  settings.set("packet", 1, section.where());
}

}  // namespace

void readXmlSettings(const std::string& file, const std::string& text, RawSettings& settings) {
  tinyxml2::XMLDocument document;
  if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
    throw InputError(file + ": is no XML: " + document.ErrorStr());
  }
  const tinyxml2::XMLElement* root = document.FirstChildElement("configuration");
  if (!root) throw InputError(file + ": is no settings file of mmWave Studio, which has a <configuration>");
  const auto section = [&](const std::string& name) { return Section(root, file, "apiname_" + name + "_cfg"); };

  const Section profile = section("profile"), chirps = section("chirp"), frame = section("frame");
  if (!profile.there() && !chirps.there() && !frame.there()) {
    throw InputError(file +
                     ": holds neither profile, chirps nor frame (apiname_profile_cfg and so on); save the "
                     "settings in mmWave Studio after they have been sent to the radar");
  }
  if (profile.there()) readXmlProfile(profile, settings);
  if (chirps.there()) readXmlChirps(chirps, settings);
  settings.only_last_chirps = file;
  const auto set = [&](const Section& from, const std::string& name, const std::string& key) {
    settings.set(name, from.integer(key), from.where());
  };
  if (frame.there()) {
    set(frame, "chirp_start", "fchirpStartIdx");
    set(frame, "chirp_end", "fchirpEndIdx");
    set(frame, "loops", "loopCount");
    settings.set("period_ms", frame.number("periodicity"), frame.where());
  }
  if (const Section channel = section("channel"); channel.there()) {
    settings.set("rx_mask", channel.mask("rx", 0, 4, "En"), channel.where());
  }
  if (const Section adc = section("adc"); adc.there()) {
    set(adc, "adc_bits", "bitsVal");
    set(adc, "adc_format", "formatVal");
    set(adc, "iq_swap", "IQSwap");
  }
  if (const Section path = section("datapath"); path.there()) readXmlDataPath(path, settings);
  if (const Section lanes = section("lvdslane"); lanes.there()) {
    set(lanes, "lane_format", "laneFormat");
    settings.set("lanes", __builtin_popcount(static_cast<unsigned>(lanes.mask("lane", 1, 4, "En"))), lanes.where());
  }
}

}  // namespace mmradartwin
