#include "scan/things/thing_parts.h"

#include <utility>

namespace mmradartwin {
namespace {

/// Below a table: a part of it. Above: on it.
void place(const LooseSurface& surface, ThingPart& part, ThingParts& found, std::vector<ThingPart>& others) {
  Eigen::AlignedBox3d box;
  for (int i : part.samples) box.extend(surface.samples.at(i));
  for (std::size_t t = 0; t < found.tops.size(); ++t) {
    std::size_t covered = 0;
    for (int i : part.samples) covered += found.tops[t].covers(surface.samples.at(i));
    if (2 * covered < part.samples.size()) continue;
    if (box.max().z() < found.tops[t].height_m + surface.toleranceOf(part.samples)) {
      found.parts[t].samples.insert(found.parts[t].samples.end(), part.samples.begin(), part.samples.end());
      return;
    }
    if (box.min().z() > found.tops[t].height_m - bounds::kSlab_m && box.min().z() < found.tops[t].height_m + 0.12)
      part.stands_on = static_cast<int>(t);
  }
  if (static_cast<double>(part.samples.size()) * surface.samples.area_m2() < bounds::kLeastThing_m2) {
    found.crumbs += part.samples.size();
    return;
  }
  others.push_back(std::move(part));
}

}  // namespace

ThingParts thingParts(const LooseSurface& surface) {
  ThingParts found;
  std::vector<int> top_of, loose;
  found.tops = tableTops(surface, top_of);
  for (std::size_t t = 0; t < found.tops.size(); ++t)
    found.parts.push_back({found.tops[t].samples, static_cast<int>(t), -1});
  for (std::size_t i = 0; i < surface.samples.size(); ++i) {
    if (surface.free[i] && top_of[i] < 0) loose.push_back(static_cast<int>(i));
  }
  std::vector<ThingPart> others;
  for (std::vector<int>& own : surface.connected(loose)) {
    ThingPart part{std::move(own), -1, -1};
    place(surface, part, found, others);
  }
  found.parts.insert(found.parts.end(), others.begin(), others.end());
  return found;
}

}  // namespace mmradartwin
