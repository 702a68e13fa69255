#include "mmradartwin_sim/twin_description.h"

#include <Eigen/Core>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <iterator>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "mmradartwin_sim/plugin.h"

namespace mmradartwin {
namespace {

std::string specList(const std::vector<ParameterSpec>& specs) {
  std::ostringstream out;
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const ParameterSpec& s = specs[i];
    out << (i ? ", " : "") << s.name;
    if (s.kind == ParameterKind::kNumber || s.kind == ParameterKind::kInteger || s.kind == ParameterKind::kNumbers) {
      out << " (" << s.unit << ", " << s.min << " to " << s.max << ")";
    }
  }
  return specs.empty() ? "none" : out.str();
}

Parameters readParameters(YamlMap& yaml, const std::vector<ParameterSpec>& specs, const std::string& mechanism) {
  Parameters values;
  for (const std::string& key : yaml.keys()) {
    bool known = false;
    for (const ParameterSpec& s : specs) known = known || s.name == key;
    if (!known) yaml.fail(key, "mechanism " + mechanism + " has no such parameter; known: " + specList(specs));
  }
  for (const ParameterSpec& s : specs) {
    if (!yaml.has(s.name)) {
      if (s.required)
        yaml.fail(s.name, "is missing; mechanism " + mechanism + " needs it; parameters: " + specList(specs));
      values.set(s.name, s.default_value);
      continue;
    }
    switch (s.kind) {
      case ParameterKind::kNumber:
        if (s.or_list && yaml.isList(s.name)) {
          values.set(s.name, yaml.numbers(s.name, s.min, s.max));
        } else {
          values.set(s.name, yaml.number(s.name, s.min, s.max));
        }
        break;
      case ParameterKind::kInteger:
        values.set(s.name, static_cast<double>(
                               yaml.integer(s.name, static_cast<long long>(s.min), static_cast<long long>(s.max))));
        break;
      case ParameterKind::kText:
        values.set(s.name, yaml.text(s.name));
        break;
      case ParameterKind::kNumbers:
        values.set(s.name, yaml.numbers(s.name, s.min, s.max));
        break;
      case ParameterKind::kTexts:
        values.set(s.name, yaml.texts(s.name));
        break;
    }
  }
  return values;
}

Parameters defaults(const std::vector<ParameterSpec>& specs) {
  Parameters values;
  for (const ParameterSpec& s : specs) values.set(s.name, s.default_value);
  return values;
}

std::vector<NamedParameters> baseMechanisms() {
  std::vector<NamedParameters> base;
  for (const char* name : {"specular", "corner", "diffuse"}) {
    base.push_back({name, defaults(MechanismRegistry::instance().create(name)->parameters())});
  }
  return base;
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

/// A number that reads back as the same double; with a point or exponent's sign, so that PyYAML reads a number too.
std::string formatNumber(double v) {
  char shortest[32], written[32];
  char* const end = std::to_chars(std::begin(shortest), std::end(shortest), v, std::chars_format::scientific).ptr;
  const auto digits = std::count_if(std::begin(shortest), std::find(std::begin(shortest), end, 'e'),
                                    [](char c) { return c >= '0' && c <= '9'; });
  std::string text(std::begin(written), std::to_chars(std::begin(written), std::end(written), v,
                                                      std::chars_format::general, std::max(6, static_cast<int>(digits)))
                                            .ptr);
  const std::size_t e = text.find('e');
  if (e != std::string::npos && text.find('.') == std::string::npos) text.insert(e, ".0");
  return text;
}

bool isEmpty(const Parameters::Value& value) {
  const auto* text = std::get_if<std::string>(&value);
  const auto* numbers = std::get_if<std::vector<double>>(&value);
  const auto* texts = std::get_if<std::vector<std::string>>(&value);
  return (text && text->empty()) || (numbers && numbers->empty()) || (texts && texts->empty());
}

void write(std::ostream& out, const Parameters::Value& value) {
  if (const auto* number = std::get_if<double>(&value)) {
    out << formatNumber(*number);
  } else if (const auto* text = std::get_if<std::string>(&value)) {
    out << quoted(*text);
  } else if (const auto* numbers = std::get_if<std::vector<double>>(&value)) {
    out << '[';
    for (std::size_t i = 0; i < numbers->size(); ++i) out << (i ? ", " : "") << formatNumber((*numbers)[i]);
    out << ']';
  } else if (const auto* texts = std::get_if<std::vector<std::string>>(&value)) {
    out << '[';
    for (std::size_t i = 0; i < texts->size(); ++i) out << (i ? ", " : "") << quoted((*texts)[i]);
    out << ']';
  }
}

void write(std::ostream& out, const Parameters& values) {
  out << '{';
  bool first = true;
  for (const auto& [key, value] : values.all()) {
    if (isEmpty(value)) continue;  // stands for: not given
    out << (first ? "" : ", ") << key << ": ";
    write(out, value);
    first = false;
  }
  out << '}';
}

}  // namespace

std::string TwinDescription::toYaml() const {
  std::ostringstream out;
  if (!scene_file.empty()) out << "scene: " << quoted(scene_file) << "\n";
  if (!radar_file.empty()) out << "radar: " << quoted(radar_file) << "\n";
  out << "mechanisms:\n";
  std::set<std::string> written;
  for (const NamedParameters& named : mechanisms) {
    if (!written.insert(named.mechanism).second) continue;
    std::vector<const Parameters*> all;
    for (const NamedParameters& m : mechanisms) {
      if (m.mechanism == named.mechanism) all.push_back(&m.values);
    }
    out << "  " << named.mechanism << ": ";
    if (all.size() == 1) {
      write(out, *all.front());
    } else {
      for (const Parameters* values : all) write(out << "\n    - ", *values);
    }
    out << "\n";
  }
  return out.str();
}

std::string subjectOf(const NamedParameters& mechanism) {
  std::string subject;
  for (const char* key : {"actor", "actors", "material", "walls", "pose", "variable"}) {
    if (!mechanism.values.has(key) || isEmpty(mechanism.values.all().at(key))) continue;
    std::ostringstream text;
    write(text << key << ' ', mechanism.values.all().at(key));
    subject += (subject.empty() ? "" : ", ") + text.str();
  }
  return subject;
}

bool excludeEachOther(const NamedParameters& a, const NamedParameters& b) {
  if (a.mechanism != b.mechanism) return false;
  const std::string subject = subjectOf(a);
  return !MechanismRegistry::instance().create(a.mechanism)->standsSeveralTimes() ||
         (!subject.empty() && subject == subjectOf(b));
}

std::vector<NamedParameters> readMechanisms(YamlMap& mechanisms) {
  std::vector<NamedParameters> read;
  for (const std::string& name : mechanisms.keys()) {
    std::vector<ParameterSpec> specs;
    try {
      specs = MechanismRegistry::instance().create(name)->parameters();
    } catch (const InputError& e) {
      mechanisms.fail(name, e.what());
    }
    // One mapping, or a list of them where it stands several times.
    std::vector<YamlMap> entries;
    if (mechanisms.isList(name)) {
      entries = mechanisms.maps(name);
      if (entries.empty()) mechanisms.fail(name, "is an empty list; write {} for its defaults or leave the key out");
    } else {
      entries.push_back(mechanisms.map(name));
    }
    for (YamlMap& parameters : entries) {
      NamedParameters named{name, readParameters(parameters, specs, name)};
      parameters.rejectUnknownKeys();
      for (const NamedParameters& m : read) {
        if (!excludeEachOther(m, named)) continue;
        const std::string subject = subjectOf(named);
        mechanisms.fail(name, subject.empty() ? "stands once in a twin, not in a list"
                                              : "names " + subject + " twice; leave one of the two out");
      }
      read.push_back(std::move(named));
    }
  }
  return read;
}

TwinDescription loadTwin(const std::string& twin_file, const std::optional<std::string>& default_scene,
                         const RadarConfig& default_radar) {
  loadMechanismPluginsOfEnvironment();
  TwinDescription twin;
  twin.file = twin_file;
  twin.radar = default_radar;
  twin.scene_file = default_scene.value_or("");
  if (twin_file.empty()) {
    if (twin.scene_file.empty())
      throw MissingScene(
          "no scene to simulate: the session names none and there is no twin.yaml; add a line scene: to session.yaml");
    twin.mechanisms = baseMechanisms();
    return twin;
  }
  YamlMap yaml = YamlMap::load(twin_file);
  if (yaml.has("scene")) twin.scene_file = resolvePath(yaml.text("scene"), twin_file);
  if (yaml.has("radar")) {
    twin.radar_file = resolvePath(yaml.text("radar"), twin_file);
    twin.radar = loadRadarConfig(twin.radar_file);
  }
  if (!yaml.has("mechanisms")) {
    twin.mechanisms = baseMechanisms();
  } else {
    YamlMap mechanisms = yaml.map("mechanisms");
    twin.mechanisms = readMechanisms(mechanisms);
  }
  yaml.rejectUnknownKeys();
  if (twin.scene_file.empty()) {
    throw MissingScene(twin_file + ": key scene: is missing, and no session names one; give the path of a scene.yaml");
  }
  return twin;
}

void refuseSameChannelError(const TwinDescription& twin, const ChannelCorrection& correction) {
  const auto channels = static_cast<Eigen::Index>(correction.phase_deg.size());
  Eigen::VectorXcd corrected(channels);
  for (Eigen::Index k = 0; k < channels; ++k) corrected(k) = correction.error(static_cast<std::size_t>(k));
  for (const NamedParameters& m : twin.mechanisms) {
    if (m.mechanism != "channel_phase_error") continue;
    ChannelCorrection own{twin.file, m.values.numbers("phase_deg"), m.values.numbers("gain_db")};
    for (std::vector<double>* list : {&own.phase_deg, &own.gain_db}) {
      if (list->empty()) list->resize(correction.phase_deg.size());
      if (list->size() != correction.phase_deg.size()) return;  // the twin's own check names this
    }
    Eigen::VectorXcd simulated(channels);
    for (Eigen::Index k = 0; k < channels; ++k) simulated(k) = own.error(static_cast<std::size_t>(k));
    // A common level and phase mean nothing. More like the corrected error than like none: the same.
    const double same = std::abs(corrected.dot(simulated)) / corrected.norm();
    const double none = std::abs(simulated.sum()) / std::sqrt(static_cast<double>(channels));
    if (same <= none) continue;
    throw InputError(correction.file + ": takes channel errors out of the measurement which the twin" +
                     (twin.file.empty() ? "" : " " + twin.file) +
                     " has as channel_phase_error: they would count twice; leave one of the two out");
  }
}

}  // namespace mmradartwin
