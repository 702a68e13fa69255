#pragma once

#include <optional>
#include <string>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::report {

/// A number as a person reads it, "-" for NaN.
std::string shownNumber(double value, int significant_digits = 3);
/// "name = value unit (low to high)".
std::string shownParameter(const FindingParameter& parameter);
/// Sentences about what the session was judged by other than it and its twin state: accuracies that are far worse, and
/// how edges hide what is behind them.
std::vector<std::string> shownJudgedBy(const Diagnosis& diagnosis);
/// "cause (probability)" of a candidate, with what tells it from others of the same cause.
std::string shownCandidate(const CauseProbability& candidate);
/// Parameters of a finding's mechanism beyond those of its cause, in words: the shape of an object, the time of a step
/// of gain. Left out: what stands at its default, lists without elements, and the laws of an unknown, which
/// findings.json holds.
std::vector<std::string> shownBesides(const Finding& finding);
/// Names joined by ";".
std::string joined(const std::vector<std::string>& names);
/// Level, range and azimuth of a path record with `between` between them; empty fields where there is no record.
std::string shownRecord(const std::optional<RecordState>& record, const std::string& between);

}  // namespace mmradartwin::diagnosis::report
