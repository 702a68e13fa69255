#pragma once

#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// What a script gave to a function.
struct ScriptArgument {
  std::optional<double> number;  ///< a number, or text that Lua reads as one
  std::string text;              ///< the text itself, or what the value is, as an error quotes it
  std::string unknown_from;      ///< not empty: the value comes from here, which nobody but mmWave Studio can answer

  bool operator==(const ScriptArgument& other) const { return number == other.number && text == other.text; }
};

/// A call of a function of the table ar1.
struct ScriptCall {
  std::string name;  ///< without "ar1."
  std::vector<ScriptArgument> arguments;
  std::string where;  ///< FILE:LINE, and the line of the script that led there
};

struct ScriptRecord {
  std::vector<ScriptCall> calls;      ///< in their order
  std::string part_asked;             ///< FILE:LINE where the script asked for its part, which was not known
  std::vector<std::string> left_out;  ///< files of Lua that the script would have run, each with FILE:LINE
};

}  // namespace mmradartwin
