#include "diagnosis/hypotheses/hypothesis.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/numbers/number_text.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis::hypotheses {
namespace {

// Two actors are tried as a corner where their bounding boxes come this near.
constexpr double kNear_m = 0.1;
// Least area of a face that mirrors a room.
constexpr double kMirrorArea_m2 = 0.5;

bool hasFittedNumber(const std::vector<ParameterSpec>& specs) {
  return std::any_of(specs.begin(), specs.end(), [](const ParameterSpec& s) { return !std::isnan(s.neutral); });
}

/// True for mechanisms about something in the scene that are present or absent and have no number.
bool isPresence(const std::vector<ParameterSpec>& specs) {
  return std::any_of(specs.begin(), specs.end(), [](const ParameterSpec& s) {
    return (s.kind == ParameterKind::kText && s.required && s.name == "actor") ||
           (s.kind == ParameterKind::kTexts && s.name == "actors");
  });
}

/// False for horizontal facets: floors, ceilings and table tops neither reflect nor scatter
/// (docs/reference/contracts.md, section 4).
bool takesPart(const Scene& scene, const Actor& actor) {
  return std::any_of(actor.facets.begin(), actor.facets.end(), [&](int id) {
    const Facet& f = scene.facets[static_cast<std::size_t>(id)];
    return f.present && f.reflects;
  });
}

double mirrorArea_m2(const Scene& scene, const Actor& actor) {
  double largest = 0;
  for (int id : actor.facets) {
    const Facet& f = scene.facets[static_cast<std::size_t>(id)];
    if (f.present && f.reflects) largest = std::max(largest, f.area_m2);
  }
  return largest;
}

void addSubjects(const Twin& twin, const Hypothesis& bare, const std::vector<ParameterSpec>& specs,
                 std::vector<Hypothesis>& out) {
  const Scene& scene = twin.scene();
  const auto spec = [&](const char* name) {
    return std::find_if(specs.begin(), specs.end(), [&](const ParameterSpec& s) { return s.name == name; });
  };
  const auto with = [&](const char* parameter, Parameters::Value value, const std::string& subject) {
    Hypothesis h = bare;
    h.mechanism.values.set(parameter, std::move(value));
    h.subject = subject;
    out.push_back(std::move(h));
  };
  const bool material = spec("material") != specs.end() && spec("material")->kind == ParameterKind::kText;
  const bool actor = spec("actor") != specs.end() && spec("actor")->kind == ParameterKind::kText;
  if (material) {
    std::set<std::string> tags;
    for (const Actor& a : scene.actors) {
      // A material that scatters already lacks no scattering.
      const bool scatters = a.material.scattering_coefficient > 0 && spec("scattering_coefficient") != specs.end();
      if (a.present && !scatters) tags.insert(a.material_tag);
    }
    for (const std::string& tag : tags) with("material", tag, tag);
  }
  if (actor) {
    for (const Actor& a : scene.actors) {
      // Things lie on tables and floors, which are no echoes' mirrors.
      const bool may_be_named = bare.form() == MechanismForm::kSurfaceClutter || takesPart(scene, a);
      if (a.present && may_be_named) with("actor", a.name, a.name);
    }
  }
  if (spec("walls") != specs.end()) {
    for (const Actor& a : scene.actors) {
      if (a.present && mirrorArea_m2(scene, a) > kMirrorArea_m2) {
        with("walls", std::vector<std::string>{a.name}, a.name);
      }
    }
  }
  if (spec("actors") != specs.end()) {
    for (std::size_t i = 0; i < scene.actors.size(); ++i) {
      const Actor& a = scene.actors[i];
      if (!a.present || mirrorArea_m2(scene, a) == 0) continue;
      with("actors", std::vector<std::string>{a.name}, a.name);  // an alcove within one actor
      for (std::size_t j = i + 1; j < scene.actors.size(); ++j) {
        const Actor& b = scene.actors[j];
        if (!b.present || a.bounds.exteriorDistance(b.bounds) > kNear_m || mirrorArea_m2(scene, b) == 0) continue;
        with("actors", std::vector<std::string>{a.name, b.name}, a.name + ";" + b.name);
      }
    }
  }
  const bool slot = spec("slot") != specs.end();
  for (int s = 0; slot && s < twin.radar().slots(); ++s) {
    with("slot", static_cast<double>(s), "transmitter " + std::to_string(s));
  }
  if (!material && !actor && !slot && spec("walls") == specs.end() && spec("actors") == specs.end()) {
    out.push_back(bare);
  }
}

/// Adds each hypothesis once more with the second value of a parameter that has one.
void addSecondValues(const std::vector<ParameterSpec>& specs, std::vector<Hypothesis>& all) {
  for (const ParameterSpec& s : specs) {
    if (!s.also) continue;
    std::vector<Hypothesis> others = all;
    for (Hypothesis& h : others) {
      h.mechanism.values.set(s.name, *s.also);
      const auto* text = std::get_if<std::string>(&*s.also);
      h.variant = s.name + " " + (text != nullptr ? *text : number(std::get<double>(*s.also)));
      h.searched += 1;
    }
    all.insert(all.end(), others.begin(), others.end());
  }
}

/// The hypothesis with the values that the twin states as neutral ones. Nothing where scale 0 would give other values.
std::optional<Hypothesis> aboutStated(Hypothesis hypothesis, const NamedParameters& stated) {
  hypothesis.stated = true;
  std::map<std::string, std::size_t> lengths;
  for (const Coordinate& c : hypothesis.coordinates) {
    if (c.logarithmic() || c.reciprocal()) return std::nullopt;
    if (c.element >= 0) lengths[c.parameter] = hypothesis.mechanism.values.numbers(c.parameter).size();
  }
  if (hypothesis.coordinates.empty()) return std::nullopt;
  hypothesis.mechanism = stated;
  for (const auto& [parameter, length] : lengths) {
    std::vector<double> list = stated.values.numbers(parameter);
    if (!hypothesis.variant.empty() && list.size() != length) return std::nullopt;  // the steps are at other times
    list.resize(length, 0.0);
    hypothesis.mechanism.values.set(parameter, std::move(list));
  }
  for (Coordinate& c : hypothesis.coordinates) {
    const double value = c.element < 0
                             ? stated.values.number(c.parameter)
                             : hypothesis.mechanism.values.numbers(c.parameter)[static_cast<std::size_t>(c.element)];
    const double step = c.typical - c.neutral;
    c.neutral = value;
    c.typical = value + step > c.max || value + step < c.min ? value - step : value + step;
  }
  return hypothesis;
}

bool isSame(const NamedParameters& a, const NamedParameters& b) {
  return a.mechanism == b.mechanism && a.values.all() == b.values.all();
}

}  // namespace

double Coordinate::value(double scaled_values) const {
  if (logarithmic()) return std::clamp(typical + 10 * std::log10(std::max(scaled_values, 1e-12)), min, max);
  if (reciprocal()) return std::clamp(typical / std::max(scaled_values, 1e-12), min, max);
  return std::clamp(neutral + scaled_values * (typical - neutral), min, max);
}

double Coordinate::scaled(double v) const {
  if (logarithmic()) return std::pow(10.0, (v - typical) / 10);
  if (reciprocal()) return typical / v;
  return (v - neutral) / (typical - neutral);
}

double Coordinate::slope(double scaled_values) const {
  if (logarithmic()) return 10 / std::log(10.0) / std::max(scaled_values, 1e-12);
  if (reciprocal()) return -typical / std::max(scaled_values * scaled_values, 1e-12);
  return typical - neutral;
}

NamedParameters Hypothesis::at(const std::vector<double>& scaled_values) const {
  NamedParameters fitted = mechanism;
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const Coordinate& coordinate = coordinates[i];
    if (!coordinate.shape.empty()) {
      std::vector<double> list = fitted.values.numbers(coordinate.parameter);
      for (std::size_t k = 0; k < list.size(); ++k) list[k] += coordinate.value(scaled_values[i]) * coordinate.shape[k];
      fitted.values.set(coordinate.parameter, std::move(list));
    } else if (coordinate.element < 0) {
      fitted.values.set(coordinate.parameter, coordinate.value(scaled_values[i]));
    } else {
      std::vector<double> list = fitted.values.numbers(coordinate.parameter);
      list[static_cast<std::size_t>(coordinate.element)] = coordinate.value(scaled_values[i]);
      fitted.values.set(coordinate.parameter, std::move(list));
    }
  }
  return fitted;
}

std::string Hypothesis::label() const {
  return mechanism.mechanism + (subject.empty() ? "" : " of " + subject) + (variant.empty() ? "" : ", " + variant);
}

bool Hypothesis::isOneSided() const {
  return std::all_of(coordinates.begin(), coordinates.end(), [](const Coordinate& c) { return c.oneSided(); });
}

bool Hypothesis::isGeometry() const {
  return subject.empty() && !coordinates.empty() && coordinates.size() <= 3 && isCatalogued(mechanism.mechanism) &&
         causeDescription(mechanism.mechanism).residual_class == ResidualClass::kShiftedResponse;
}

bool Hypothesis::isMove() const { return form() == MechanismForm::kActorMoved; }

MechanismForm Hypothesis::form() const { return traitsOf(mechanism.mechanism).form; }

void replaceOrAppend(const NamedParameters& mechanism, std::vector<NamedParameters>& mechanisms) {
  const auto at = std::find_if(mechanisms.begin(), mechanisms.end(),
                               [&](const NamedParameters& m) { return excludeEachOther(m, mechanism); });
  if (at == mechanisms.end()) {
    mechanisms.push_back(mechanism);
  } else {
    *at = mechanism;
  }
}

std::vector<NamedParameters> mechanismsWith(std::vector<NamedParameters> base, const std::vector<Hypothesis>& parts,
                                            const std::vector<double>& scaled_values) {
  auto from = scaled_values.begin();
  for (const Hypothesis& h : parts) {
    const auto to = from + static_cast<std::ptrdiff_t>(h.coordinates.size());
    replaceOrAppend(h.at({from, to}), base);
    from = to;
  }
  return base;
}

std::optional<Hypothesis> withSteps(Hypothesis hypothesis, int steps) {
  const std::vector<ParameterSpec> specs =
      MechanismRegistry::instance().create(hypothesis.mechanism.mechanism)->parameters();
  const auto spec =
      std::find_if(specs.begin(), specs.end(), [](const ParameterSpec& s) { return s.name == "steps_db"; });
  if (spec == specs.end()) return std::nullopt;
  hypothesis.coordinates.clear();
  hypothesis.mechanism.values.set(spec->name, std::vector<double>(static_cast<std::size_t>(steps), 0.0));
  for (int k = 0; k < steps; ++k)
    hypothesis.coordinates.push_back({spec->name, spec->unit, k, 0, 1, spec->min, spec->max, {}});
  hypothesis.variant = std::to_string(steps) + (steps > 1 ? " steps" : " step");
  return hypothesis;
}

std::vector<Hypothesis> allHypotheses(const Twin& twin, const std::vector<NamedParameters>& present) {
  std::vector<Hypothesis> result;
  const MechanismRegistry& registry = MechanismRegistry::instance();
  const std::size_t channels = static_cast<std::size_t>(twin.radar().channels());
  for (const std::string& name : registry.names()) {
    const std::vector<ParameterSpec> specs = registry.create(name)->parameters();
    if (!hasFittedNumber(specs) && !isPresence(specs)) continue;
    Hypothesis bare;
    bare.mechanism = defaultMechanism(name);
    for (const ParameterSpec& s : specs) {
      if (std::isnan(s.neutral)) continue;
      Coordinate coordinate{s.name, s.unit, -1, s.neutral, s.typical, s.min, s.max, {}};
      if (s.kind == ParameterKind::kNumber) {
        bare.mechanism.values.set(s.name, s.neutral);
        bare.coordinates.push_back(coordinate);
      } else if (s.kind == ParameterKind::kNumbers) {  // per channel; the first one is the reference
        bare.mechanism.values.set(s.name, std::vector<double>(channels, s.neutral));
        for (std::size_t k = 1; k < channels; ++k) {
          coordinate.element = static_cast<int>(k);
          bare.coordinates.push_back(coordinate);
        }
      }
    }
    std::vector<Hypothesis> all;
    addSubjects(twin, bare, specs, all);
    addSecondValues(specs, all);
    for (int steps = 1; steps <= kMostSteps; ++steps) {
      if (std::optional<Hypothesis> stepped = withSteps(bare, steps)) all.push_back(std::move(*stepped));
    }
    for (Hypothesis& hypothesis : all) {
      const auto there = std::find_if(present.begin(), present.end(), [&](const NamedParameters& m) {
        return excludeEachOther(m, hypothesis.mechanism);
      });
      if (there != present.end()) {
        const std::vector<NamedParameters>& given = twin.description().mechanisms;
        const bool is_stated =
            std::any_of(given.begin(), given.end(), [&](const NamedParameters& m) { return isSame(m, *there); });
        std::optional<Hypothesis> other = is_stated ? aboutStated(std::move(hypothesis), *there) : std::nullopt;
        if (!other) continue;
        hypothesis = std::move(*other);
      }
      try {  // a mechanism that the scene or the radar does not allow is no hypothesis
        const Twin with = twin.changed({hypothesis.at(std::vector<double>(hypothesis.coordinates.size(), 1.0))});
        // A mechanism without numbers that notes a problem has no effect.
        if (hypothesis.coordinates.empty() && !with.notes().empty()) continue;
        result.push_back(std::move(hypothesis));
      } catch (const InputError&) {
      }
    }
  }
  return result;
}

}  // namespace mmradartwin::diagnosis::hypotheses
