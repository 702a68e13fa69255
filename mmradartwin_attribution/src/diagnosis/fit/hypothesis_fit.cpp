#include "diagnosis/fit/hypothesis_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::fit {

std::vector<int> everyPose(const ModelState& state) {
  std::vector<int> poses(state.echoes.size());
  std::iota(poses.begin(), poses.end(), 0);
  return poses;
}

std::vector<int> evenlySpread(std::size_t poses, std::size_t wanted) {
  wanted = std::min(poses, wanted);
  std::vector<int> indices;
  for (std::size_t i = 0; i < wanted; ++i) indices.push_back(static_cast<int>(i * poses / wanted));
  return indices;
}

std::size_t HypothesisFit::numbers() const {
  return std::max<std::size_t>(1, hypothesis.coordinates.size()) + static_cast<std::size_t>(hypothesis.searched);
}

double HypothesisFit::ranking() const {
  const NamedParameters& m = hypothesis.mechanism;
  const bool nests = hypothesis.form() == MechanismForm::kLaw &&
                     !(m.values.numbers("channels").empty() && m.values.numbers("angle_deg").empty());
  const bool adapts = !isCatalogued(m.mechanism) && hypothesis.form() != MechanismForm::kSurfaceClutter;
  const double share = nests                     ? bounds::kRankedShareOfNestingLaw
                       : adapts                  ? bounds::kRankedShareOfLaw
                       : hypothesis.searched > 1 ? bounds::kRankedShareOfSteps
                                                 : 1;
  double nats = share * gain - bounds::kPriceOfNumber_nats * static_cast<double>(numbers());
  if (hypothesis.form() == MechanismForm::kUnmodelledObject) nats -= bounds::kPriceOfPlace_nats;
  if (hypothesis.isMove() && moved_m() < stated.leastMove_m()) nats -= bounds::kPriceOfNumber_nats;
  return nats;
}

double HypothesisFit::moved_m() const {
  if (hypothesis.isMove()) {
    const NamedParameters m = hypothesis.at(scaled_values);
    return std::hypot(m.values.number("dx_m"), m.values.number("dy_m"));
  }
  double all_by_m = 0;
  for (std::size_t i = 0; hypothesis.isGeometry() && i < scaled_values.size(); ++i) {
    const Coordinate& c = hypothesis.coordinates[i];
    if (c.unit == "m") all_by_m = std::hypot(all_by_m, c.value(scaled_values[i]) - c.neutral);
  }
  return all_by_m;
}

bool HypothesisFit::isFarAway() const {
  return moved_m() > stated.farAway_m() &&
         (overwhelming || gain_without_best_place / overdispersion > bounds::kLeastNatsOfFarAway);
}

double HypothesisFit::size_m() const {
  if (hypothesis.form() != MechanismForm::kUnmodelledObject) return 0;
  return hypothesis.at(scaled_values).values.number("size_m");
}

}  // namespace mmradartwin::diagnosis::fit
