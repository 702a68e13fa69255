#include "diagnosis/echoes/path_matching.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/echoes/echo_field.h"

namespace mmradartwin::diagnosis::echoes {
namespace {

using PathKey = std::tuple<const std::string*, PerInteraction<int>>;

PathKey keyOf(const PathRecord& record) { return {record.event, record.facets}; }

double azimuthOf(const PathRecord& record) { return std::atan2(record.departure.y(), record.departure.x()); }

}  // namespace

const NamedParameters* sameInOtherList(const std::vector<NamedParameters>& mechanisms, std::size_t index,
                                       const std::vector<NamedParameters>& list) {
  const NamedParameters& wanted = mechanisms[index];
  const std::string subject = subjectOf(wanted);
  const auto alike = [&](const NamedParameters& m) {
    return m.mechanism == wanted.mechanism && subjectOf(m) == subject;
  };
  auto before = std::count_if(mechanisms.begin(), mechanisms.begin() + static_cast<std::ptrdiff_t>(index), alike);
  const auto found =
      std::find_if(list.begin(), list.end(), [&](const NamedParameters& m) { return alike(m) && before-- == 0; });
  return found == list.end() ? nullptr : &*found;
}

std::map<PerInteraction<int>, std::vector<const PathRecord*>> byActors(const std::vector<PathRecord>& records) {
  std::map<PerInteraction<int>, std::vector<const PathRecord*>> groups;
  for (const PathRecord& r : records) groups[actorsOf(r)].push_back(&r);
  return groups;
}

void addShared(const std::vector<PathRecord>& there, const std::vector<PathRecord>& here,
               std::vector<PathRecord>& all) {
  std::map<PathKey, int> count;
  for (const PathRecord& r : here) ++count[keyOf(r)];
  std::map<PathKey, int> found;
  for (const PathRecord& r : there) {
    const auto counted = count.find(keyOf(r));
    if (counted == count.end() || counted->second > 1) continue;
    ++found[counted->first];
    all.push_back(r);
  }
  for (const PathRecord& r : here) {
    if (found.find(keyOf(r)) == found.end()) all.push_back(r);
  }
}

void addShifts(std::size_t place, const std::vector<PathRecord>& there, std::vector<PathRecord> here,
               std::vector<PathShift>& shifts) {
  std::map<PathKey, std::vector<PathRecord>> by_key;
  for (PathRecord& r : here) by_key[keyOf(r)].push_back(std::move(r));
  for (const PathRecord& r : there) {
    const auto same = by_key.find(keyOf(r));
    if (same == by_key.end() || same->second.size() > 1) continue;
    const PathRecord& before = same->second.front();
    shifts.push_back({place, r.event, r.facets, r.actors, r.amplitude, 0.5 * (r.length_m[0] - before.length_m[0]),
                      azimuthOf(r) - azimuthOf(before)});
  }
}

EchoShift meanShift(const std::vector<PathShift>& shifts, std::size_t actors, std::size_t poses) {
  EchoShift mean;
  mean.range_m.assign(actors, 0.0);
  mean.azimuth_rad.assign(poses, 0.0);
  std::vector<double> of_actor(actors, 1e-30), of_pose(poses, 1e-30);  // sums of amplitudes
  for (const PathShift& p : shifts) {
    if (p.actors.size() != 1 || p.actors[0] < 0) continue;
    const std::size_t actor = static_cast<std::size_t>(p.actors[0]);
    mean.range_m[actor] += p.amplitude * p.range_m;
    of_actor[actor] += p.amplitude;
    mean.azimuth_rad[p.place] += p.amplitude * p.azimuth_rad;
    of_pose[p.place] += p.amplitude;
  }
  for (std::size_t a = 0; a < actors; ++a) mean.range_m[a] /= of_actor[a];
  for (std::size_t j = 0; j < poses; ++j) mean.azimuth_rad[j] /= of_pose[j];
  return mean;
}

}  // namespace mmradartwin::diagnosis::echoes
