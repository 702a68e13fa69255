#pragma once

#include <array>
#include <string>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::catalogue {

/// Value of the key "format" of findings.json.
inline constexpr const char* kFindingsFormat = "mmradartwin_findings/1";
/// Keys of FindingGain::recall_band in findings.json.
inline constexpr std::array<const char*, 3> kRecallBands = {"near", "mid", "far"};

/// Kind of the value that a parameter holds.
ParameterKind kindOf(const Parameters::Value& value);

/// Way to what findings.json must not hold, and why: "findings/0/parameters/x_m: is missing". "" where nothing is
/// wrong. Throws InputError for a cause that is not catalogued.
std::string problemOf(const Findings& findings);
/// Way and reason within one finding: "parameters/x_m: is missing".
std::string problemOf(const Finding& finding);

}  // namespace mmradartwin::diagnosis::catalogue
