#include "scan/samples/cell_raster.h"

#include <algorithm>

namespace mmradartwin {

double CellRaster::share(const Eigen::AlignedBox2d& box) const {
  std::size_t set = 0, all = 0;
  for (int x = index(box.min().x() + 0.5 * side_m_); (x + 0.5) * side_m_ < box.max().x(); ++x) {
    for (int y = index(box.min().y() + 0.5 * side_m_); (y + 0.5) * side_m_ < box.max().y(); ++y)
      ++all, set += has(x, y);
  }
  return all ? static_cast<double>(set) / static_cast<double>(all) : 0;
}

std::vector<RasterGap> gapsOf(const CellRaster& raster, const Eigen::AlignedBox2d& area) {
  const int x0 = raster.index(area.min().x()), x1 = raster.index(area.max().x());
  const int y0 = raster.index(area.min().y()), y1 = raster.index(area.max().y());
  if (x1 <= x0 || y1 <= y0) return {};
  const int width = x1 - x0 + 1, height = y1 - y0 + 1;
  const auto at = [width](int x, int y) { return static_cast<std::size_t>(y * width + x); };
  // A cell without a sample among cells with samples is where the scan is thin.
  std::vector<char> empty(static_cast<std::size_t>(width * height), 0);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      int around = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) around += raster.has(x0 + x + dx, y0 + y + dy);
      }
      empty[at(x, y)] = !raster.has(x0 + x, y0 + y) && around < 5;
    }
  }
  std::vector<RasterGap> gaps;
  std::vector<std::pair<int, int>> queue;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      if (!empty[at(x, y)]) continue;
      queue.assign(1, {x, y});
      empty[at(x, y)] = 0;
      int left = x, right = x, low = y, high = y;
      for (std::size_t k = 0; k < queue.size(); ++k) {
        const auto [cx, cy] = queue[k];
        left = std::min(left, cx), right = std::max(right, cx), low = std::min(low, cy), high = std::max(high, cy);
        for (const auto& [nx, ny] : {std::pair{cx - 1, cy}, {cx + 1, cy}, {cx, cy - 1}, {cx, cy + 1}}) {
          if (nx < 0 || ny < 0 || nx >= width || ny >= height || !empty[at(nx, ny)]) continue;
          empty[at(nx, ny)] = 0;
          queue.emplace_back(nx, ny);
        }
      }
      RasterGap gap;
      const double side = raster.side_m();
      gap.box = Eigen::AlignedBox2d(Eigen::Vector2d((x0 + left) * side, (y0 + low) * side),
                                    Eigen::Vector2d((x0 + right + 1) * side, (y0 + high + 1) * side));
      gap.area_m2 = static_cast<double>(queue.size()) * side * side;
      gap.fill = gap.area_m2 / gap.box.volume();
      gap.touches_side = left == 0 || right == width - 1 || high == height - 1;
      gaps.push_back(gap);
    }
  }
  return gaps;
}

}  // namespace mmradartwin
