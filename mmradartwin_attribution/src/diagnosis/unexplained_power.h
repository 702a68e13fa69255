#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis {

/// Finding `unknown` where a twin explains less of the measured power than it would if it were right; nothing where it
/// does not. What a right twin explains is computed: channels are drawn anew from the session's fitted model, with its
/// noise, clutter, speckle and errors of levels, and explained by the same twin. state: of the twin, all found
/// included.
std::optional<Finding> unexplainedPower(DiagnosisContext& context, const ModelState& state);

/// Paths of more bounces than a twin traces.
struct MissingBounces {
  int max_bounces = 0;
  std::size_t specular = 0;  ///< index of the mechanism that traces them
  int tried = 0;             ///< orders up to the highest one that can be traced
  ModelState state;          ///< with them
};
/// Number of bounces up to which paths make the data likelier than a twin's state does; nothing where none do. No
/// number is fitted to the data.
std::optional<MissingBounces> missingBounces(DiagnosisContext& context, const ModelState& state);
/// Finding `trace_coverage`, without its gain in maps.
Finding findingOf(const MissingBounces& missing, const ModelState& before);

}  // namespace mmradartwin::diagnosis
