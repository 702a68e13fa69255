#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace mmradartwin {

enum class ParameterKind { kNumber, kInteger, kText, kNumbers, kTexts };

using ParameterValue = std::variant<double, std::string, std::vector<double>, std::vector<std::string>>;

/// A parameter that a mechanism has. Ranges are checked before the mechanism sees a value.
struct ParameterSpec {
  std::string name;  ///< with its unit as in docs/reference/causes.md, e.g. yaw_deg
  std::string unit;  ///< "deg", "m", "dB", "1", "" for texts
  ParameterKind kind = ParameterKind::kNumber;
  double min = 0, max = 0;
  bool required = true;
  ParameterValue default_value = 0.0;
  std::string meaning;  ///< one line
  /// For a diagnosis that tries the mechanism on data: the value at which it does nothing, and one at which it plainly
  /// does something. NaN where the parameter keeps its default in a trial. An integer or text is never tried.
  double neutral = std::numeric_limits<double>::quiet_NaN(), typical = std::numeric_limits<double>::quiet_NaN();
  std::optional<ParameterValue> also;  ///< a second value at which a trial holds the parameter
  bool or_list = false;                ///< of a number: a list may stand in its place, one number per receiver
  bool weighs = false;                 ///< acts in reweight() and later alone: scene and traced paths stay as they are
};

/// Checked values by name; every parameter of the mechanism is present unless it is optional without default.
class Parameters {
 public:
  using Value = ParameterValue;
  void set(const std::string& name, Value value);
  bool has(const std::string& name) const;
  double number(const std::string& name) const;
  const std::string& text(const std::string& name) const;
  const std::vector<double>& numbers(const std::string& name) const;
  const std::vector<std::string>& texts(const std::string& name) const;
  const std::map<std::string, Value>& all() const { return values_; }

 private:
  std::map<std::string, Value> values_;
};

}  // namespace mmradartwin
