#include "evidence_bounds.h"

#include <algorithm>

#include "mmradartwin_attribution/finding.h"

namespace mmradartwin {
namespace {

// Of 104 sessions with nothing hidden (blind protocol's rows `clean`, office tier, 24 poses at 17 places, seeds 701 and
// 702) the best were worth 19 nats of laws over all echoes, 15 of what concerns an actor or a material, 5 of laws
// without a name, 18 of what moves echoes (40 of one that its own errors refuse) and 44 of an object; of one with 154
// poses 47, 13, none, 4 and none.
constexpr double kLaw = 25;
constexpr double kSubject = 30;                              ///< and laws without a name
constexpr double kTraces = 30;                               ///< the likelihood is rough there
constexpr double kObject = 70;                               ///< it has the whole room to choose from
constexpr double kLawPerPose = 0.4, kSubjectPerPose = 1;  ///< a twin's own errors add up

}  // namespace

double leastNats(const Hypothesis& hypothesis, bool traces, std::size_t poses) {
  const double n = static_cast<double>(poses);
  if (hypothesis.mechanism.mechanism == "actor_unmodelled") return std::max(kObject, kLawPerPose * n);
  const bool unnamed = !isCatalogued(hypothesis.mechanism.mechanism);
  if (unnamed || !hypothesis.subject.empty()) return std::max(kSubject, kSubjectPerPose * n);
  return std::max(traces ? kTraces : kLaw, kLawPerPose * n);
}

}  // namespace mmradartwin
