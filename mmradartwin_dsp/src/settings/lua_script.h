#pragma once

#include <functional>
#include <string>

#include "settings/script_record.h"

namespace mmradartwin {

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
