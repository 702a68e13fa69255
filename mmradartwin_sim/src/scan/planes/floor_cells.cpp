#include "scan/planes/floor_cells.h"

namespace mmradartwin {
namespace {

constexpr double kLeastShare = 0.35;  // of a cell of the room that the scan has: furniture hides the rest
constexpr std::array<CellStep, 4> kSteps = {{{-1, 0}, {1, 0}, {0, -1}, {0, 1}}};

/// Index of a neighbour, cells.inside.size() beyond the rim.
std::size_t neighbour(const FloorCells& cells, std::size_t i, std::size_t k, const CellStep& step) {
  const auto columns = static_cast<long>(cells.xs.size()) - 1, rows = static_cast<long>(cells.ys.size()) - 1;
  const long ni = static_cast<long>(i) + step[0], nk = static_cast<long>(k) + step[1];
  if (ni < 0 || nk < 0 || ni >= columns || nk >= rows) return cells.inside.size();
  return cells.index(static_cast<std::size_t>(ni), static_cast<std::size_t>(nk));
}

}  // namespace

void fillFrom(std::size_t first, const std::vector<double>& share, const IsWalled& is_walled, FloorCells& cells) {
  const std::size_t rows = cells.ys.size() - 1;
  cells.inside.assign(share.size(), 0);
  cells.inside[first] = 1;
  std::vector<std::size_t> queue = {first};
  for (std::size_t q = 0; q < queue.size(); ++q) {
    const std::size_t i = queue[q] / rows, k = queue[q] % rows;
    for (const CellStep& step : kSteps) {
      const std::size_t next = neighbour(cells, i, k, step);
      if (next == cells.inside.size() || cells.inside[next] || share[next] < kLeastShare) continue;
      if (is_walled(i, k, step)) continue;
      cells.inside[next] = 1;
      queue.push_back(next);
    }
  }
}

void fillNooks(const IsWalled& is_walled, FloorCells& cells) {
  for (bool filled = true; filled;) {
    filled = false;
    for (std::size_t i = 0; i + 1 < cells.xs.size(); ++i) {
      for (std::size_t k = 0; k + 1 < cells.ys.size(); ++k) {
        if (cells.inside[cells.index(i, k)]) continue;
        int closed = 0, open = 0;
        for (const CellStep& step : kSteps) {
          const std::size_t next = neighbour(cells, i, k, step);
          const bool wall = is_walled(i, k, step);
          closed += wall;
          open += !wall && next != cells.inside.size() && cells.inside[next];
        }
        if (open == 0 || open + closed < 3) continue;
        cells.inside[cells.index(i, k)] = 1;
        filled = true;
      }
    }
  }
}

}  // namespace mmradartwin
