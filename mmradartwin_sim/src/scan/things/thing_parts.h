#pragma once

#include <cstddef>
#include <vector>

#include "scan/things/table_tops.h"

namespace mmradartwin {

/// Samples that are one thing.
struct ThingPart {
  std::vector<int> samples;
  int top = -1;        ///< of a table: index of its top, whose samples come first
  int stands_on = -1;  ///< index of the top that it stands on
};

struct ThingParts {
  std::vector<TableTop> tops;
  std::vector<ThingPart> parts;  ///< tables first, in the order of `tops`
  std::size_t crumbs = 0;        ///< samples in clusters too small for a thing
};

/// Connected parts of what is loose, with tables cut off: what is below a table's top is of the table.
ThingParts thingParts(const LooseSurface& surface);

}  // namespace mmradartwin
