#pragma once

#include <vector>

#include "scan/samples/cell_raster.h"
#include "scan/samples/scan_bounds.h"
#include "scan/things/loose_surface.h"
#include "scan/things/thing_shapes.h"

namespace mmradartwin {

/// A level plate over free space.
struct TableTop {
  double height_m;
  CellRaster footprint{bounds::kCell_m};
  std::vector<int> samples;
  UprightBox rim;  ///< its rectangle

  bool covers(const Eigen::Vector3d& p) const { return footprint.has(footprint.index(p.x()), footprint.index(p.y())); }
};

/// Level flat parts at a table's height under which there is more room than surface. Sets top_of of each sample:
/// index of the top that it is part of, -1 none.
std::vector<TableTop> tableTops(const LooseSurface& surface, std::vector<int>& top_of);

}  // namespace mmradartwin
