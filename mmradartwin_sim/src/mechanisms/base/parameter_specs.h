#pragma once

#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_sim/parameters.h"

namespace mmradartwin {

inline ParameterSpec numberSpec(const char* name, const char* unit, double min, double max, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.unit = unit;
  s.min = min;
  s.max = max;
  s.meaning = meaning;
  return s;
}

inline ParameterSpec numberSpec(const char* name, const char* unit, double min, double max, double default_value,
                                const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, meaning);
  s.required = false;
  s.default_value = default_value;
  return s;
}

/// Says at which value a diagnosis finds the mechanism doing nothing, and at which plainly something.
inline ParameterSpec tried(ParameterSpec spec, double neutral, double typical) {
  spec.neutral = neutral;
  spec.typical = typical;
  return spec;
}

/// Says that a diagnosis tries the mechanism with this value of a parameter, too, beside its default.
inline ParameterSpec alsoAt(ParameterSpec spec, ParameterValue value) {
  spec.also = std::move(value);
  return spec;
}

/// Says that a list over receivers may stand in the number's place.
inline ParameterSpec orPerReceiver(ParameterSpec spec) {
  spec.or_list = true;
  return spec;
}

/// Says that traced paths do not depend on the parameter.
inline ParameterSpec weighing(ParameterSpec spec) {
  spec.weighs = true;
  return spec;
}

inline ParameterSpec textSpec(const char* name, bool required, const char* default_value, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.kind = ParameterKind::kText;
  s.required = required;
  s.default_value = std::string(default_value);
  s.meaning = meaning;
  return s;
}

inline ParameterSpec textsSpec(const char* name, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.kind = ParameterKind::kTexts;
  s.default_value = std::vector<std::string>();
  s.meaning = meaning;
  return s;
}

/// A list; an empty one stands for: not given.
inline ParameterSpec optionalNumbersSpec(const char* name, const char* unit, double min, double max,
                                         const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, meaning);
  s.kind = ParameterKind::kNumbers;
  s.required = false;
  s.default_value = std::vector<double>();
  return s;
}

inline ParameterSpec integerSpec(const char* name, const char* unit, double min, double max, double default_value,
                                 const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, default_value, meaning);
  s.kind = ParameterKind::kInteger;
  return s;
}

}  // namespace mmradartwin
