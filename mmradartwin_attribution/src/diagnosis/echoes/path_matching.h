#pragma once

#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::echoes {

/// Change of one echo by a change of mechanisms.
struct PathShift {
  std::size_t place;  ///< index of its pose among those asked for
  const std::string* event;
  PerInteraction<int> facets, actors;
  double amplitude;
  double range_m, azimuth_rad;  ///< one-way range and departure azimuth, after minus before
};

/// Mean change of echoes, weighted by amplitude.
struct EchoShift {
  std::vector<double> range_m;      ///< [actors] one-way, over echoes that meet only this actor
  std::vector<double> azimuth_rad;  ///< [poses asked for] over a pose's echoes that meet one actor
};

/// Mechanism of `list` that has the same rank as mechanisms[index] among those of its name and subject. Null where the
/// list has fewer of them.
const NamedParameters* sameInOtherList(const std::vector<NamedParameters>& mechanisms, std::size_t index,
                                       const std::vector<NamedParameters>& list);

/// Paths grouped by the actors that they meet.
std::map<PerInteraction<int>, std::vector<const PathRecord*>> byActors(const std::vector<PathRecord>& records);

/// Appends to `all` the paths of `there` that `here` has too, and those of `here` that `there` lacks. Scatter points of
/// one facet share a name, and their cells change with every step: those of `here` are kept.
void addShared(const std::vector<PathRecord>& there, const std::vector<PathRecord>& here, std::vector<PathRecord>& all);

/// Appends the shifts, from `here` to `there`, of paths that occur once in both lists. place: see PathShift.
void addShifts(std::size_t place, const std::vector<PathRecord>& there, std::vector<PathRecord> here,
               std::vector<PathShift>& shifts);

/// Means over the shifts of paths that meet one actor.
EchoShift meanShift(const std::vector<PathShift>& shifts, std::size_t actors, std::size_t poses);

}  // namespace mmradartwin::diagnosis::echoes
