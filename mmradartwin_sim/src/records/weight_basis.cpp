#include "mmradartwin_sim/weight_basis.h"

#include <map>
#include <stdexcept>

namespace mmradartwin {

WeightBasis::WeightBasis(const RadarConfig& radar, const std::vector<PathRecord>& records)
    : channels_(radar.channels()), samples_(radar.samples_per_chirp) {
  std::map<std::pair<const std::string*, PerInteraction<int>>, std::size_t> known;
  std::vector<std::vector<PathRecord>> members;
  for (const PathRecord& r : records) {
    const auto [group, fresh] = known.emplace(std::make_pair(r.event, r.actors), groups_.size());
    if (fresh) {
      groups_.emplace_back();
      groups_.back().event = r.event;
      groups_.back().actors = r.actors;
      members.emplace_back();
    }
    Group& g = groups_[group->second];
    ++g.paths;
    g.power += r.amplitude * r.amplitude;
    members[group->second].push_back(r);
  }
  for (std::size_t i = 0; i < groups_.size(); ++i) {
    groups_[i].x = ComplexGrid::Zero(channels_, samples_);
    accumulate(radar, members[i], groups_[i].x);
  }
}

void WeightBasis::sum(const std::vector<std::complex<double>>& weights, ComplexGrid& x) const {
  if (weights.size() != groups_.size()) throw std::invalid_argument("WeightBasis: one weight per group");
  x = ComplexGrid::Zero(channels_, samples_);
  for (std::size_t i = 0; i < groups_.size(); ++i) x += weights[i] * groups_[i].x;
}

}  // namespace mmradartwin
