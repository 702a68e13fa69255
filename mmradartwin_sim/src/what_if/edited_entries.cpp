#include "what_if/edited_entries.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

[[noreturn]] void failRange(const std::string& what, double value, double min, double max) {
  std::ostringstream text;
  text << what << ": " << value << " is not from " << min << " to " << max;
  throw InputError(text.str());
}

bool isWithin(double value, double min, double max) { return value >= min && value <= max; }  // NaN is not

}  // namespace

void setValue(Material& material, const std::string& key, double value) {
  std::string known;
  for (const MaterialNumber& n : materialNumbers(material.model)) {
    known += (known.empty() ? "" : ", ") + std::string(n.key);
    if (key != n.key) continue;
    if (!isWithin(value, n.min, n.max)) failRange("material " + material.name + ": key " + key, value, n.min, n.max);
    material.*n.member = value;
    return;
  }
  throw InputError("material " + material.name + " has no number " + key + "; it has " + known);
}

void setNumber(NamedParameters& mechanism, const std::string& key, double value) {
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism.mechanism)->parameters()) {
    if (s.name != key) continue;
    if (s.kind != ParameterKind::kNumber && s.kind != ParameterKind::kInteger) break;
    if (s.kind == ParameterKind::kInteger) value = std::round(value);
    if (!isWithin(value, s.min, s.max))
      failRange("mechanism " + mechanism.mechanism + ": key " + key, value, s.min, s.max);
    mechanism.values.set(key, value);
    return;
  }
  throw InputError("mechanism " + mechanism.mechanism + " has no number " + key);
}

NamedParameters newMechanism(const std::string& name, const std::string& actor, const std::string& material) {
  NamedParameters made{name, {}};
  bool named = false;
  for (const ParameterSpec& s : MechanismRegistry::instance().create(name)->parameters()) {
    ParameterValue value = s.default_value;
    const bool text = s.kind == ParameterKind::kText || s.kind == ParameterKind::kTexts;
    const bool of_actor = s.name == "actor" || s.name == "actors" || s.name == "walls";
    const bool of_material = s.name == "material" && (s.required || actor.empty());
    const std::string subject = of_actor ? actor : of_material ? material : "";
    if (text && !named && !subject.empty()) {
      value = s.kind == ParameterKind::kTexts ? ParameterValue(std::vector<std::string>{subject}) : subject;
      named = true;
    } else if (text && s.required) {
      throw InputError("mechanism " + name + ": key " + s.name + ": name an actor or a material of the scene");
    } else if (s.required && (s.kind == ParameterKind::kNumber || s.kind == ParameterKind::kInteger)) {
      const auto* start = std::get_if<double>(&s.default_value);
      value = std::isfinite(s.neutral) ? s.neutral : std::clamp(start ? *start : 0.0, s.min, s.max);
    }
    made.values.set(s.name, value);
  }
  return made;
}

void refuseExclusions(const std::vector<NamedParameters>& mechanisms) {
  for (std::size_t i = 0; i < mechanisms.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!excludeEachOther(mechanisms[i], mechanisms[j])) continue;
      throw InputError("mechanism " + mechanisms[i].mechanism + " stands in the twin already" +
                       (subjectOf(mechanisms[i]).empty() ? "" : ", for " + subjectOf(mechanisms[i])));
    }
  }
}

WhatIfEntry* entryNumber(std::vector<WhatIfEntry>& entries, const std::string& mechanism, std::size_t entry) {
  for (WhatIfEntry& e : entries) {
    if (e.named.mechanism == mechanism && entry-- == 0) return &e;
  }
  return nullptr;
}

const WhatIfEntry* entryAbout(const std::vector<WhatIfEntry>& entries, const std::string& mechanism,
                              const std::string& actor) {
  for (const WhatIfEntry& e : entries) {
    if (e.named.mechanism == mechanism && e.named.values.text("actor") == actor) return &e;
  }
  return nullptr;
}

void switchAbout(std::vector<WhatIfEntry>& entries, const std::string& mechanism, const std::string& actor, bool on) {
  for (WhatIfEntry& e : entries) {
    if (&e != entryAbout(entries, mechanism, actor)) continue;
    e.on = on;
    return;
  }
  if (!on) return;
  WhatIfEntry made{{mechanism, {}}, true, false};
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism)->parameters()) {
    made.named.values.set(s.name, s.name == "actor" ? ParameterValue(actor) : s.default_value);
  }
  entries.push_back(std::move(made));
}

void placeActor(std::vector<WhatIfEntry>& entries, const std::string& actor, const Eigen::Vector3d& shift_m,
                double yaw_deg) {
  switchAbout(entries, "actor_moved", actor, true);
  for (WhatIfEntry& e : entries) {
    if (&e != entryAbout(entries, "actor_moved", actor)) continue;
    setNumber(e.named, "dx_m", shift_m.x());
    setNumber(e.named, "dy_m", shift_m.y());
    setNumber(e.named, "dz_m", shift_m.z());
    setNumber(e.named, "dyaw_deg", yaw_deg);
    const Parameters& values = e.named.values;
    e.on = !(shift_m.isZero(0) && yaw_deg == 0 && values.number("dpitch_deg") == 0 && values.number("droll_deg") == 0);
  }
}

void setMounting(std::vector<WhatIfEntry>& entries, const std::string& mechanism,
                 const std::vector<std::pair<std::string, double>>& values) {
  const bool on = std::any_of(values.begin(), values.end(), [](const auto& v) { return v.second != 0; });
  WhatIfEntry* entry = entryNumber(entries, mechanism, 0);
  if (!entry && !on) return;
  if (!entry) entry = &entries.emplace_back(WhatIfEntry{newMechanism(mechanism, "", ""), true, false});
  entry->on = on;
  for (const auto& [key, value] : values) setNumber(entry->named, key, value);
}

}  // namespace mmradartwin
