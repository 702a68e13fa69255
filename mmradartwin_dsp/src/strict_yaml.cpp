#include "mmradartwin_dsp/strict_yaml.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <sstream>

#include "files/text_file.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "yaml_document.h"

namespace mmradartwin {

struct YamlMap::State {
  YAML::Node node;
  std::string file;
  std::string prefix;              // "meshes[0]." of a nested mapping
  std::vector<std::string> known;  // keys asked for, in order of asking
};

namespace {

std::string formatNumber(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

std::string describeRange(double min, double max) {
  return "allowed: " + formatNumber(min) + " to " + formatNumber(max);
}

/// A value as it goes into a one-line message.
std::string quote(const YAML::Node& node) {
  if (!node.IsDefined() || node.IsNull()) return "nothing";
  if (node.IsMap()) return "a mapping";
  if (node.IsSequence()) return "a list";
  std::string text = node.Scalar();
  std::replace(text.begin(), text.end(), '\n', ' ');
  if (text.size() > 60) text = text.substr(0, 57) + "...";
  return "'" + text + "'";
}

/// The whole of `text` as a decimal number; quoted numbers count, since PyYAML writes 77.0e9 as a string.
std::optional<double> parseNumber(const std::string& text) {
  if (text == ".nan" || text == ".NaN" || text == ".NAN") return std::numeric_limits<double>::quiet_NaN();
  const char* begin = text.data();
  const char* end = begin + text.size();
  if (begin != end && *begin == '+') ++begin;
  if (begin != end && *begin == '+') return std::nullopt;
  std::string_view rest(begin, static_cast<std::size_t>(end - begin));
  const bool negative = !rest.empty() && rest.front() == '-';
  if (negative) rest.remove_prefix(1);
  if (rest == ".inf" || rest == ".Inf" || rest == ".INF") {
    return negative ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
  }
  double value = 0;
  const auto result = std::from_chars(begin, end, value);
  if (result.ec != std::errc() || result.ptr != end) return std::nullopt;
  return value;
}

std::string join(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

/// Mapping keys must be plain words and stand once; yaml-cpp itself lets the last of two equal keys win or lose
/// silently.
void checkKeys(const YAML::Node& node, const std::string& file, const std::string& prefix) {
  std::set<std::string> seen;
  for (const auto& entry : node) {
    if (!entry.first.IsScalar()) {
      throw InputError(file + ": " + (prefix.empty() ? "the file" : "key " + prefix) + " has a key that is no word");
    }
    const std::string key = entry.first.Scalar();
    if (!seen.insert(key).second) {
      throw InputError(file + ": key " + prefix + key + " stands twice (second time in line " +
                       std::to_string(entry.first.Mark().line + 1) + "); remove one");
    }
  }
}

}  // namespace

YamlMap::YamlMap(std::shared_ptr<State> state) : state_(std::move(state)) {}

YamlMap YamlMap::load(const std::string& file) {
  return parse(readTextFile(file, "check that the file exists and is readable"), file);
}

YamlMap YamlMap::parse(const std::string& text, const std::string& name) {
  auto state = std::make_shared<State>();
  state->file = name;
  state->node = parseYamlDocument(text, name);
  if (state->node.IsNull()) throw InputError(name + ": the file is empty; expected a YAML mapping");
  if (!state->node.IsMap()) throw InputError(name + ": expected a YAML mapping, found " + quote(state->node));
  checkKeys(state->node, name, "");
  return YamlMap(std::move(state));
}

namespace {

/// Non-creating look-up; `YAML::Node::operator[]` on a non-const node would insert.
YAML::Node lookUp(const YAML::Node& node, const std::string& key) {
  for (const auto& entry : node) {
    if (entry.first.Scalar() == key) return entry.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

void note(std::vector<std::string>& known, const std::string& key) {
  if (std::find(known.begin(), known.end(), key) == known.end()) known.push_back(key);
}

}  // namespace

bool YamlMap::has(const std::string& key) const {
  note(state_->known, key);
  return lookUp(state_->node, key).IsDefined();
}

std::vector<std::string> YamlMap::keys() const {
  std::vector<std::string> keys;
  for (const auto& entry : state_->node) keys.push_back(entry.first.Scalar());
  return keys;
}

bool YamlMap::isList(const std::string& key) const { return lookUp(state_->node, key).IsSequence(); }

void YamlMap::fail(const std::string& key, const std::string& why) const {
  throw InputError(state_->file + ": key " + state_->prefix + key + ": " + why);
}

namespace {

/// The value of a required key; marks it known.
YAML::Node require(const YamlMap& map, const YAML::Node& node, const std::string& key) {
  if (!map.has(key)) {
    // A misspelt key is the likeliest reason for a missing one.
    for (const std::string& present : map.keys()) {
      if (editDistance(present, key) <= std::max<std::size_t>(1, key.size() / 4)) {
        map.fail(key, "is missing (the file has '" + present + "'); add it");
      }
    }
    map.fail(key, "is missing; add it");
  }
  return lookUp(node, key);
}

double readNumber(const YamlMap& map, const std::string& key, const YAML::Node& node, double min, double max) {
  const std::optional<double> value = node.IsScalar() ? parseNumber(node.Scalar()) : std::nullopt;
  if (!value) map.fail(key, quote(node) + " is no number; " + describeRange(min, max));
  if (!(std::isfinite(*value) && *value >= min && *value <= max)) {
    map.fail(key, quote(node) + " is out of range; " + describeRange(min, max));
  }
  return *value;
}

long long readInteger(const YamlMap& map, const std::string& key, const YAML::Node& node, long long min,
                      long long max) {
  const std::string range = "allowed: " + std::to_string(min) + " to " + std::to_string(max);
  const std::optional<double> value = node.IsScalar() ? parseNumber(node.Scalar()) : std::nullopt;
  if (!value || (std::isfinite(*value) && *value != std::floor(*value))) {
    map.fail(key, quote(node) + " is no whole number; " + range);
  }
  if (!(*value >= static_cast<double>(min) && *value <= static_cast<double>(max))) {
    map.fail(key, quote(node) + " is out of range; " + range);
  }
  return static_cast<long long>(*value);
}

std::string readText(const YamlMap& map, const std::string& key, const YAML::Node& node) {
  if (!node.IsScalar() || node.Scalar().empty()) map.fail(key, quote(node) + " is no text");
  return node.Scalar();
}

YAML::Node requireList(const YamlMap& map, const YAML::Node& node, const std::string& key) {
  const YAML::Node list = require(map, node, key);
  if (!list.IsSequence()) map.fail(key, quote(list) + " is no list; write it in [ ]");
  return list;
}

std::string indexed(const std::string& key, std::size_t i) { return key + "[" + std::to_string(i) + "]"; }

}  // namespace

double YamlMap::number(const std::string& key, double min, double max) {
  return readNumber(*this, key, require(*this, state_->node, key), min, max);
}

long long YamlMap::integer(const std::string& key, long long min, long long max) {
  return readInteger(*this, key, require(*this, state_->node, key), min, max);
}

bool YamlMap::boolean(const std::string& key) {
  const YAML::Node node = require(*this, state_->node, key);
  bool value = false;
  if (!node.IsScalar() || !YAML::convert<bool>::decode(node, value)) {
    fail(key, quote(node) + " is neither true nor false");
  }
  return value;
}

std::string YamlMap::text(const std::string& key) { return readText(*this, key, require(*this, state_->node, key)); }

std::string YamlMap::choice(const std::string& key, const std::vector<std::string>& allowed) {
  const std::string value = text(key);
  if (std::find(allowed.begin(), allowed.end(), value) == allowed.end()) {
    fail(key, "'" + value + "' is not allowed; " + didYouMean(value, allowed) + "allowed: " + join(allowed));
  }
  return value;
}

std::vector<double> YamlMap::numbers(const std::string& key, double min, double max) {
  std::vector<double> values;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    values.push_back(readNumber(*this, indexed(key, values.size()), node, min, max));
  }
  return values;
}

std::vector<long long> YamlMap::integers(const std::string& key, long long min, long long max) {
  std::vector<long long> values;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    values.push_back(readInteger(*this, indexed(key, values.size()), node, min, max));
  }
  return values;
}

std::vector<std::string> YamlMap::texts(const std::string& key) {
  std::vector<std::string> values;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    values.push_back(readText(*this, indexed(key, values.size()), node));
  }
  return values;
}

std::vector<std::vector<double>> YamlMap::rows(const std::string& key, std::size_t columns, double min, double max) {
  std::vector<std::vector<double>> rows;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    const std::string row_key = indexed(key, rows.size());
    if (!node.IsSequence() || node.size() != columns) {
      fail(row_key, quote(node) + (node.IsSequence() ? " of " + std::to_string(node.size()) + " numbers" : "") +
                        "; expected a list of " + std::to_string(columns) + " numbers");
    }
    std::vector<double> row;
    for (const YAML::Node& cell : node) row.push_back(readNumber(*this, indexed(row_key, row.size()), cell, min, max));
    rows.push_back(std::move(row));
  }
  return rows;
}

std::vector<std::vector<long long>> YamlMap::integerLists(const std::string& key, long long min, long long max) {
  std::vector<std::vector<long long>> lists;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    const std::string list_key = indexed(key, lists.size());
    if (!node.IsSequence()) fail(list_key, quote(node) + " is no list; write it in [ ]");
    std::vector<long long> list;
    for (const YAML::Node& cell : node)
      list.push_back(readInteger(*this, indexed(list_key, list.size()), cell, min, max));
    lists.push_back(std::move(list));
  }
  return lists;
}

YamlMap YamlMap::map(const std::string& key) {
  const YAML::Node node = require(*this, state_->node, key);
  auto child = std::make_shared<State>();
  child->file = state_->file;
  child->prefix = state_->prefix + key + ".";
  if (node.IsNull()) {
    child->node = YAML::Node(YAML::NodeType::Map);  // "corner:" stands for "corner: {}"
  } else if (node.IsMap()) {
    child->node = node;
  } else {
    fail(key, quote(node) + " is no mapping; write {key: value, ...}");
  }
  checkKeys(child->node, child->file, child->prefix);
  return YamlMap(std::move(child));
}

std::vector<YamlMap> YamlMap::maps(const std::string& key) {
  std::vector<YamlMap> maps;
  for (const YAML::Node& node : requireList(*this, state_->node, key)) {
    const std::string map_key = indexed(key, maps.size());
    if (!node.IsMap()) fail(map_key, quote(node) + " is no mapping; write {key: value, ...}");
    auto child = std::make_shared<State>();
    child->node = node;
    child->file = state_->file;
    child->prefix = state_->prefix + map_key + ".";
    checkKeys(child->node, child->file, child->prefix);
    maps.push_back(YamlMap(std::move(child)));
  }
  return maps;
}

void YamlMap::rejectUnknownKeys() const {
  for (const std::string& key : keys()) {
    if (std::find(state_->known.begin(), state_->known.end(), key) != state_->known.end()) continue;
    std::vector<std::string> known = state_->known;
    std::sort(known.begin(), known.end());
    fail(key, "is not known; " + didYouMean(key, known) +
                  (known.empty() ? "no keys are allowed here" : "known: " + join(known)));
  }
}

const std::string& YamlMap::file() const { return state_->file; }

std::string YamlMap::dump(const std::string& key) { return YAML::Dump(require(*this, state_->node, key)); }

std::string yamlText(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string yamlNumber(double value) {
  char buffer[64];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  std::string text(buffer, result.ptr);
  const std::size_t exponent = text.find('e');
  if (text.find('.') == std::string::npos) text.insert(exponent == std::string::npos ? text.size() : exponent, ".0");
  return text;
}

}  // namespace mmradartwin
