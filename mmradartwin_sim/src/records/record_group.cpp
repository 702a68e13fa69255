#include "records/record_group.h"

#include <algorithm>
#include <map>
#include <tuple>

namespace mmradartwin {

std::vector<std::vector<std::size_t>> groupByFacet(const std::vector<PathRecord>& records, int fewest) {
  using Key = std::tuple<const std::string*, PerInteraction<int>, PerInteraction<int>>;
  std::map<Key, std::vector<std::size_t>> same;
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PathRecord& r = records[i];
    if (!r.facets.empty() && r.departure == r.arrival) same[{r.event, r.actors, r.facets}].push_back(i);
  }
  std::vector<std::vector<std::size_t>> groups;
  for (auto& [key, members] : same) {
    if (static_cast<int>(members.size()) >= fewest) groups.push_back(std::move(members));
  }
  // By name and place in the scene, never by address.
  std::sort(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.front() < b.front(); });
  return groups;
}

PathRecord standIn(const PathRecord& first) {
  PathRecord r;
  r.event = first.event;
  r.actors = first.actors;
  r.facets = first.facets;
  r.bounces = first.bounces;
  r.reflection_cosine = first.reflection_cosine;
  return r;
}

}  // namespace mmradartwin
