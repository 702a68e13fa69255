#pragma once

#include <functional>
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

/// Runs a mmWave Studio script and records its calls of ar1. The script runs alone: it has no files, no programs and no
/// other modules, and it ends with an InputError after a number of steps and a number of bytes.
///
/// Each function of ar1 and of RSTD answers 0, which means success (1 where it asks for a connection). Where the script
/// asks for its part (ar1.ReadRegister of the part's fuses, names such as ar1.partNumber or partId) the answer is
/// `part`, four digits, or empty: not known. All other names of mmWave Studio can be called and indexed; what they
/// answer is unknown, and so is what is computed of it. Throws InputError where the script does not run, or where the
/// calls that `configures` names depend on such an answer.
ScriptRecord recordScript(const std::string& file, const std::string& text, const std::string& part,
                          const std::function<bool(const std::string& name)>& configures);

}  // namespace mmradartwin
