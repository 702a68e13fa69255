#include "scene/vertex_weld.h"

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace mmradartwin {
namespace {

constexpr double kWeld_m = 1e-5;  // vertices nearer than this are one: STL and glTF repeat them per triangle

struct CellHash {
  std::size_t operator()(const std::array<std::int64_t, 3>& c) const {
    return static_cast<std::size_t>(c[0] * 73856093LL ^ c[1] * 19349663LL ^ c[2] * 83492791LL);
  }
};

}  // namespace

std::vector<int> weldVertices(const std::vector<Eigen::Vector3d>& vertices) {
  std::unordered_map<std::array<std::int64_t, 3>, std::vector<int>, CellHash> cells;
  std::vector<int> first(vertices.size());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    std::array<std::int64_t, 3> low, high;
    for (int a = 0; a < 3; ++a) {
      low[a] = static_cast<std::int64_t>(std::floor((vertices[i][a] - kWeld_m) / (4 * kWeld_m)));
      high[a] = static_cast<std::int64_t>(std::floor((vertices[i][a] + kWeld_m) / (4 * kWeld_m)));
    }
    int found = -1;
    for (auto x = low[0]; x <= high[0] && found < 0; ++x) {
      for (auto y = low[1]; y <= high[1] && found < 0; ++y) {
        for (auto z = low[2]; z <= high[2] && found < 0; ++z) {
          const auto cell = cells.find({x, y, z});
          if (cell == cells.end()) continue;
          for (int j : cell->second) {
            if ((vertices[j] - vertices[i]).squaredNorm() < kWeld_m * kWeld_m) {
              found = j;
              break;
            }
          }
        }
      }
    }
    if (found < 0) {
      found = static_cast<int>(i);
      std::array<std::int64_t, 3> cell;
      for (int a = 0; a < 3; ++a) cell[a] = static_cast<std::int64_t>(std::floor(vertices[i][a] / (4 * kWeld_m)));
      cells[cell].push_back(found);
    }
    first[i] = found;
  }
  return first;
}

}  // namespace mmradartwin
