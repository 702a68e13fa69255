#pragma once

#include <string>

namespace mmradartwin {

/// Result of one check of the rig.
struct CheckResult {
  enum class Level { kFine, kNote, kProblem };
  Level level = Level::kFine;
  std::string subject;  ///< "link", "card", ...
  std::string found;    ///< one line
  std::string next;     ///< what to do; empty where all is fine
};

}  // namespace mmradartwin
