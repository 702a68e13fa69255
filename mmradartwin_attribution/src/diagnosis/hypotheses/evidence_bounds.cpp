#include "diagnosis/hypotheses/evidence_bounds.h"

#include <algorithm>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::hypotheses {
namespace {

constexpr UsualScatter kScatterOfLevels = {bounds::kUsualOverdispersionOfLevels, bounds::kPlacesOfUsualOverdispersion};

bool isTypical(const std::vector<double>& scaled_values) {
  return std::all_of(scaled_values.begin(), scaled_values.end(), [](double v) { return v > bounds::kTypicalShare; });
}

}  // namespace

bool isOfLevels(const Hypothesis& h) {
  const auto adds = [](const Coordinate& c) { return c.oneSided(); };
  if (h.coordinates.empty() || std::any_of(h.coordinates.begin(), h.coordinates.end(), adds)) return false;
  if (isCatalogued(h.mechanism.mechanism)) {
    const ResidualClass c = causeDescription(h.mechanism.mechanism).residual_class;
    return c == ResidualClass::kWeakSupport || c == ResidualClass::kUnsupportedAnchor;
  }
  return std::all_of(h.coordinates.begin(), h.coordinates.end(), [](const Coordinate& c) { return c.unit == "dB"; });
}

bool isFaintAddition(const Hypothesis& h, const std::vector<double>& scaled_values) {
  return h.coordinates.size() == 1 && h.coordinates.front().parameter == "level" && !isTypical(scaled_values);
}

UsualScatter usualScatter(const Hypothesis& hypothesis) {
  return isOfLevels(hypothesis) ? kScatterOfLevels : UsualScatter{};
}

double shrunkOverdispersion(double overdispersion, const Hypothesis& hypothesis, std::size_t locations) {
  const UsualScatter usual = usualScatter(hypothesis);
  const double places = static_cast<double>(locations) - 1;
  if (usual.places + places <= 0) return std::max(1.0, overdispersion);
  return std::max(1.0, (usual.places * usual.overdispersion + places * overdispersion) / (usual.places + places));
}

double leastNats(const Hypothesis& hypothesis, const std::vector<double>& scaled_values, bool traces,
                 std::size_t poses) {
  const double n = static_cast<double>(poses);
  const std::string& name = hypothesis.mechanism.mechanism;
  const MechanismForm form = hypothesis.form();
  if (form == MechanismForm::kUnmodelledObject || form == MechanismForm::kLateEcho)
    return std::max(bounds::kLeastNatsOfPlacedObject, bounds::kLeastNatsOfGlobalPerPose * n);
  const bool unnamed = !isCatalogued(name);
  const bool adds = !unnamed && causeDescription(name).residual_class == ResidualClass::kMissingMechanism;
  if (form == MechanismForm::kLaw && hypothesis.mechanism.values.text("actor").empty()) {
    return std::max(bounds::kLeastNatsOfSubject, bounds::kLeastNatsOfGlobalPerPose * n);
  }
  if (form == MechanismForm::kLaw)
    return std::max(bounds::kLeastNatsOfActorLaw, bounds::kLeastNatsOfActorLawPerPose * n);
  if (unnamed || !hypothesis.subject.empty())
    return std::max(adds ? bounds::kLeastNatsOfAdditionOfSubject : bounds::kLeastNatsOfSubject,
                    bounds::kLeastNatsOfSubjectPerPose * n);
  if (adds) {
    return std::max(bounds::kLeastNatsOfAddition, (isTypical(scaled_values) ? bounds::kLeastNatsOfTypicalAdditionPerPose
                                                                            : bounds::kLeastNatsOfAdditionPerPose) *
                                                      n);
  }
  return std::max(traces ? bounds::kLeastNatsOfTracing : bounds::kLeastNatsOfGlobal,
                  bounds::kLeastNatsOfGlobalPerPose * n);
}

}  // namespace mmradartwin::diagnosis::hypotheses
