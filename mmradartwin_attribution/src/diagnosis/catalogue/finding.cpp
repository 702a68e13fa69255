#include "mmradartwin_attribution/finding.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/catalogue/bounds.h"

namespace mmradartwin {

std::array<double, 2> Finding::placeError_m() const {
  const auto half = [&](const std::string& axis) {
    const FindingParameter* p = parameter(axis);
    if (p == nullptr) p = parameter("d" + axis);
    return p != nullptr && !p->ci95.empty() ? (p->ci95[0][1] - p->ci95[0][0]) / 2 : 0;
  };
  return {half("x_m"), half("y_m")};
}

double ChangedRecord::strongest_db() const {
  return std::max(before ? before->amplitude_db : -INFINITY, after ? after->amplitude_db : -INFINITY);
}

const FindingParameter* Finding::parameter(const std::string& name) const {
  for (const FindingParameter& p : parameters) {
    if (p.name == name) return &p;
  }
  return nullptr;
}

bool Findings::isFarWorse(const std::string& key) const {
  const auto estimate = estimated.find(key);
  const auto& keys = accuracyKeys();
  const auto stated = std::find_if(keys.begin(), keys.end(), [&](const AccuracyKey& k) { return k.name == key; });
  if (estimate == estimated.end() || stated == keys.end()) return false;
  const double stated_value = accuracy.*stated->member;
  return estimate->second.low > stated_value && estimate->second.value > diagnosis::bounds::kFarWorse * stated_value;
}

std::string Findings::verdict() const {
  if (findings.empty()) return "none";
  return findings.front().cause == "unknown" ? "unknown" : "named";
}

}  // namespace mmradartwin
