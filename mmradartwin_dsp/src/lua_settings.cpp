#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <set>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "raw_settings.h"
#include "text_file.h"

namespace mmradartwin {
namespace {

/// Numbers, names of numbers, + - * / and parentheses. No value where it takes more than kSteps or nests deeper than
/// kDeepest: names of names grow exponentially.
class Arithmetic {
 public:
  Arithmetic(const std::string& text, const std::map<std::string, std::string>& names)
      : Arithmetic(text, names, own_steps_, 0) {}
  std::optional<double> value() {
    const auto result = sum();
    skip();
    return at_ == text_.size() ? result : std::nullopt;
  }

 private:
  void skip() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_]))) ++at_;
  }
  bool take(char c) {
    skip();
    if (at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }
  std::optional<double> sum() {
    auto left = product();
    while (left) {
      const bool plus = take('+');
      if (!plus && !take('-')) break;
      const auto right = product();
      if (!right) return std::nullopt;
      *left += plus ? *right : -*right;
    }
    return left;
  }
  std::optional<double> product() {
    auto left = atom();
    while (left) {
      const bool times = take('*');
      if (!times && !take('/')) break;
      const auto right = atom();
      if (!right) return std::nullopt;
      *left = times ? *left * *right : *left / *right;
    }
    return left;
  }
  std::optional<double> atom() {
    if (depth_ > kDeepest || ++steps_ > kSteps) return std::nullopt;
    if (take('-')) {
      ++depth_;
      const auto value = atom();
      --depth_;
      return value ? std::optional(-*value) : std::nullopt;
    }
    if (take('(')) {
      ++depth_;
      const auto value = sum();
      --depth_;
      return value && take(')') ? value : std::nullopt;
    }
    skip();
    if (at_ >= text_.size()) return std::nullopt;
    const char c = text_[at_];
    if (std::isdigit(static_cast<unsigned char>(c)) || c == '.') {
      const char* begin = text_.c_str() + at_;
      char* end = nullptr;
      const double value = std::strtod(begin, &end);
      at_ += static_cast<std::size_t>(end - begin);
      return value;
    }
    if (!std::isalpha(static_cast<unsigned char>(c)) && c != '_') return std::nullopt;
    std::string name;
    while (at_ < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at_])) || text_[at_] == '_')) {
      name += text_[at_++];
    }
    const auto known = names_.find(name);
    if (known == names_.end()) return std::nullopt;
    return Arithmetic(known->second, names_, steps_, depth_ + 1).value();
  }

  static constexpr int kDeepest = 100, kSteps = 10000;

  Arithmetic(const std::string& text, const std::map<std::string, std::string>& names, int& steps, int depth)
      : text_(text), names_(names), steps_(steps), depth_(depth) {}

  const std::string& text_;
  const std::map<std::string, std::string>& names_;
  int own_steps_ = 0;
  int& steps_;
  int depth_;
  std::size_t at_ = 0;
};

/// Comments become blanks, so that lines keep their numbers.
std::string withoutComments(std::string text) {
  char quote = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (quote) {
      if (text[i] == '\\') {
        ++i;
      } else if (text[i] == quote || text[i] == '\n') {
        quote = 0;
      }
    } else if (text[i] == '"' || text[i] == '\'') {
      quote = text[i];
    } else if (text.compare(i, 2, "--") == 0) {
      const bool block = text.compare(i, 4, "--[[") == 0;
      std::size_t end = block ? text.find("]]", i) : text.find('\n', i);
      if (end == std::string::npos) end = text.size();
      if (block && end < text.size()) end += 2;
      for (; i < end; ++i) {
        if (text[i] != '\n') text[i] = ' ';
      }
      --i;
    }
  }
  return text;
}

struct Call {
  std::string name;
  std::vector<std::string> arguments;
  std::string where;
};

class Script {
 public:
  explicit Script(const std::string& file) : file_(file) {
    text_ = withoutComments(readTextFile(file, "give a Lua script that exists"));
    findNames();
    findCalls();
  }

  const std::vector<Call>& calls() const { return calls_; }

  double number(const Call& call, std::size_t argument) const {
    const std::string& text = call.arguments[argument];
    for (const std::string& name : ambiguous_) {
      if (text.find(name) != std::string::npos) {
        throw InputError(call.where + ": '" + name +
                         "' has several values in the script; write the number in its place");
      }
    }
    const auto value = Arithmetic(text, names_).value();
    if (!value || !std::isfinite(*value)) {
      throw InputError(call.where + ": argument " + std::to_string(argument + 1) + " of ar1." + call.name + ", '" +
                       text + "', is no number that can be read off the script; write the number in its place");
    }
    return *value;
  }
  int integer(const Call& call, std::size_t argument) const {
    return wholeNumber(number(call, argument), call.where + ": argument " + std::to_string(argument + 1) + " of ar1." +
                                                   call.name + ", '" + call.arguments[argument] + "'");
  }
  static void count(const Call& call, std::size_t least, std::size_t most) {
    const std::size_t n = call.arguments.size();
    if (n >= least && n <= most) return;
    throw InputError(call.where + ": ar1." + call.name + " has " + std::to_string(n) +
                     " arguments; known is the form " + "with " + std::to_string(least) +
                     (most > least ? " to " + std::to_string(most) : std::string()) + " (mmWave Studio 2 and 3)");
  }

 private:
  void findNames() {
    std::istringstream lines(text_);
    for (std::string line; std::getline(lines, line);) {
      std::size_t at = line.find_first_not_of(" \t");
      if (at == std::string::npos) continue;
      if (line.compare(at, 6, "local ") == 0) at = line.find_first_not_of(" \t", at + 6);
      std::size_t end = at;
      while (end < line.size() && (std::isalnum(static_cast<unsigned char>(line[end])) || line[end] == '_')) ++end;
      const std::size_t equals = line.find_first_not_of(" \t", end);
      if (end == at || equals == std::string::npos || line[equals] != '=' || line.compare(equals, 2, "==") == 0)
        continue;
      std::string value = line.substr(equals + 1);
      while (!value.empty() && (std::isspace(static_cast<unsigned char>(value.back())) || value.back() == ';')) {
        value.pop_back();
      }
      const auto [known, fresh] = names_.emplace(line.substr(at, end - at), value);
      if (!fresh && known->second != value) ambiguous_.insert(known->first);
    }
  }

  void findCalls() {
    std::ptrdiff_t line = 1;
    for (std::size_t at = 0, counted = 0; (at = text_.find("ar1.", at)) != std::string::npos;) {
      Call call;
      line += std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted),
                         text_.begin() + static_cast<std::ptrdiff_t>(at), '\n');
      counted = at;
      call.where = file_ + ":" + std::to_string(line);
      at += 4;
      while (at < text_.size() && (std::isalnum(static_cast<unsigned char>(text_[at])) || text_[at] == '_')) {
        call.name += text_[at++];
      }
      while (at < text_.size() && std::isspace(static_cast<unsigned char>(text_[at]))) ++at;
      if (at >= text_.size() || text_[at] != '(') continue;
      int depth = 0;
      char quote = 0;
      std::string argument;
      const auto finish = [&] {
        const std::size_t first = argument.find_first_not_of(" \t\r\n"), last = argument.find_last_not_of(" \t\r\n");
        if (first != std::string::npos) call.arguments.push_back(argument.substr(first, last - first + 1));
        argument.clear();
      };
      for (; at < text_.size(); ++at) {
        const char c = text_[at];
        if (quote) {
          if (c == quote) quote = 0;
        } else if (c == '"' || c == '\'') {
          quote = c;
        } else if (c == '(') {
          if (depth++ == 0) continue;
        } else if (c == ')') {
          if (--depth == 0) break;
        } else if (c == ',' && depth == 1) {
          finish();
          continue;
        }
        argument += c;
      }
      finish();
      calls_.push_back(call);
    }
  }

  std::string file_, text_;
  std::map<std::string, std::string> names_;
  std::set<std::string> ambiguous_;
  std::vector<Call> calls_;
};

void readProfile(const Script& script, const Call& call, RawSettings& settings) {
  Script::count(call, 18, 18);
  RawSettings::Profile profile{};
  profile.start_ghz = script.number(call, 1);
  profile.idle_us = script.number(call, 2);
  profile.adc_start_us = script.number(call, 3);
  profile.ramp_end_us = script.number(call, 4);
  for (std::size_t tx = 0; tx < 3; ++tx) profile.backoff_db[tx] = script.number(call, 5 + tx);
  for (std::size_t tx = 0; tx < 3; ++tx) {
    if (script.number(call, 8 + tx) != 0) {
      throw InputError(call.where + ": the transmitters' phases are shifted; only unshifted ones are known here");
    }
  }
  profile.slope_mhz_per_us = script.number(call, 11);
  profile.samples = script.integer(call, 13);
  profile.ksps = script.number(call, 14);
  profile.hpf1 = script.integer(call, 15) & 0xffff;  // the upper half carries flags
  profile.hpf2 = script.integer(call, 16) & 0xffff;
  profile.rx_gain = script.integer(call, 17);
  settings.setProfile(script.integer(call, 0), profile, call.where);
}

void readChirps(const Script& script, const Call& call, RawSettings& settings) {
  Script::count(call, 10, 10);
  for (std::size_t i = 3; i < 7; ++i) {
    if (script.number(call, i) != 0) {
      throw InputError(call.where + ": this chirp differs from its profile (argument " + std::to_string(i + 1) +
                       "); only chirps that are all alike are known here");
    }
  }
  unsigned mask = 0;
  for (std::size_t tx = 0; tx < 3; ++tx) mask |= script.integer(call, 7 + tx) ? 1u << tx : 0u;
  settings.setChirps(script.integer(call, 0), script.integer(call, 1), {script.integer(call, 2), mask}, call.where);
}

}  // namespace

void readLuaSettings(const std::string& file, RawSettings& settings) {
  const Script script(file);
  bool any = false;
  for (const Call& call : script.calls()) {
    const auto set = [&](const std::string& name, double value) { settings.set(name, value, call.where); };
    any = true;
    if (call.name == "ProfileConfig") {
      readProfile(script, call, settings);
    } else if (call.name == "ChirpConfig") {
      readChirps(script, call, settings);
    } else if (call.name == "FrameConfig") {
      Script::count(call, 6, 9);
      set("chirp_start", script.integer(call, 0));
      set("chirp_end", script.integer(call, 1));
      set("loops", script.integer(call, 3));
      set("period_ms", script.number(call, 4));
    } else if (call.name == "ChanNAdcConfig") {
      Script::count(call, 10, 10);
      int mask = 0;
      for (std::size_t rx = 0; rx < 4; ++rx) mask |= script.integer(call, 3 + rx) & 0xffff ? 1 << rx : 0;
      set("rx_mask", mask);
      set("adc_bits", script.integer(call, 7));
      set("adc_format", script.integer(call, 8) & 0xffff);
      set("iq_swap", script.integer(call, 9) & 0xffff);
    } else if (call.name == "DataPathConfig") {
      Script::count(call, 3, 3);
      set("interface", script.integer(call, 0) & 0xff);
      set("packet", script.integer(call, 1) & 0xff);
    } else if (call.name == "LVDSLaneConfig") {
      Script::count(call, 8, 8);
      set("lane_format", script.integer(call, 0));
      int lanes = 0;
      for (std::size_t lane = 0; lane < 4; ++lane) lanes += script.integer(call, 1 + lane) ? 1 : 0;
      set("lanes", lanes);
    } else if (call.name == "CaptureCardConfig_Mode") {
      Script::count(call, 6, 6);
      const int lvds = script.integer(call, 1);  // 1: four lanes, 2: two
      if (lvds == 1 || lvds == 2) set("lanes", lvds == 1 ? 4 : 2);
    } else if (call.name == "CaptureCardConfig_PacketDelay") {
      Script::count(call, 1, 1);
      set("packet_delay_us", script.number(call, 0));
    } else if (call.name == "deviceVariantSelection" && call.arguments.size() == 1) {
      settings.setDevice(call.arguments[0], call.where);
    } else if (call.name == "AdvancedFrameConfig" || call.name == "BpmChirpConfig" ||
               call.name == "SetPerChirpPhaseShifterConfig" || call.name.find("_mult") != std::string::npos) {
      throw InputError(call.where + ": ar1." + call.name +
                       " is not among the settings that radar.yaml can hold (one device, one frame of equal chirps)");
    }
  }
  if (!any) throw InputError(file + ": holds no ar1.* call; give a mmWave Studio script");
}

}  // namespace mmradartwin
