#include "diagnosis/hypotheses/law_words.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "mmradartwin_sim/law_variable.h"

namespace mmradartwin::diagnosis::hypotheses {
namespace {

constexpr const char* kObservables[] = {"gain_db", "delay_m", "angle_deg", "phase_deg"};
constexpr std::size_t kMostInWords = 12;  ///< points of a law that are all written; of more, only the extremes

}  // namespace

std::string channelsInWords(const NamedParameters& law) {
  std::ostringstream out;
  for (double k : law.values.numbers("channels")) out << (out.tellp() > 0 ? " " : " of channels ") << k;
  return out.str();
}

std::string describeLaw(const Hypothesis& hypothesis, const NamedParameters& fitted) {
  std::ostringstream out;
  out << std::setprecision(3);
  if (hypothesis.form() != MechanismForm::kLaw) {
    out << "the mechanism " << fitted.mechanism;
    for (const Coordinate& c : hypothesis.coordinates) {
      if (c.element < 0) out << ", " << c.parameter << " = " << fitted.values.number(c.parameter);
    }
    return out.str();
  }
  const std::string variable = fitted.values.text("variable");
  const std::vector<double>& at = fitted.values.numbers("at");
  for (const char* observable : kObservables) {
    const std::vector<double>& values = fitted.values.numbers(observable);
    if (values.empty()) continue;
    out << observable << " of the echoes over " << variable;
    if (LawVariable::isAboutPlace(variable)) {
      out << " from x_m " << fitted.values.number("x_m") << ", y_m " << fitted.values.number("y_m");
    }
    if (variable == "standing_m") out << " along bearing_deg " << fitted.values.number("bearing_deg");
    if (!fitted.values.text("actor").empty()) out << " of " << fitted.values.text("actor");
    out << channelsInWords(fitted);
    if (!hypothesis.variant.empty()) out << " (" << hypothesis.variant << ")";
    if (values.size() > kMostInWords) {
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      out << ": from " << *low << " at " << at[static_cast<std::size_t>(low - values.begin())] << " to " << *high
          << " at " << at[static_cast<std::size_t>(high - values.begin())];
      continue;
    }
    out << ":";
    for (std::size_t i = 0; i < values.size(); ++i) out << (i ? ", " : " ") << values[i] << " at " << at[i];
  }
  return out.str();
}

std::string experimentFor(const std::vector<CauseProbability>& candidates) {
  Experiment first = Experiment::kAbsorber;
  for (const CauseProbability& candidate : candidates) first = std::min(first, traitsOf(candidate.cause).experiment);
  switch (first) {
    case Experiment::kReflector:
      return "put a corner reflector at a surveyed place, at several azimuths and ranges; use each transmitter alone";
    case Experiment::kHighPassCode:
      return "record the same places with another high-pass code, and a corner reflector from 0.5 m to the far wall";
    case Experiment::kTurnAndMeasure:
      return "turn the radar by 90 and 180 degrees at one place, and measure a distance with a laser";
    case Experiment::kRaise:
      return "raise the radar by 0.3 m at five places and record them again";
    case Experiment::kSurface:
      return "record the surface from oblique places, and with an absorber in front of it";
    case Experiment::kAbsorber:
      break;
  }
  return "cover the object in question with an absorber, and record from places around it";
}

}  // namespace mmradartwin::diagnosis::hypotheses
