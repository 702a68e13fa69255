#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace mmradartwin {

/// A place in the plane of a fan: x along the boresight, y to the left.
struct FanPoint {
  double x_m = 0, y_m = 0;
};

/// A fan as triangles, with the map as its texture: a row per range bin, a column per angle bin.
struct FanMesh {
  struct Vertex {
    FanPoint place;
    double u, v;  ///< column and row of the texture as shares of its width and height
  };
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> triangles;  ///< three vertices each
};

/// The cells of a range-angle map: rings between the middles of range bins, sectors between those of angle bins. Angle
/// bins are uniform in the sine, so their middles are taken there. A bin without an angle (NaN) has no cells.
class FanGeometry {
 public:
  struct Sector {
    double from_rad, to_rad;  ///< NaN where the bin has no angle
  };
  FanGeometry() = default;
  /// Centres of the bins as the message has them, ascending. Throws InputError where they are not.
  FanGeometry(const std::vector<double>& range_m, const std::vector<double>& azimuth_rad);

  std::size_t ranges() const { return range_edges_m_.empty() ? 0 : range_edges_m_.size() - 1; }
  std::size_t angles() const { return sectors_.size(); }
  const std::vector<double>& rangeEdges_m() const { return range_edges_m_; }  ///< one more than there are bins
  const std::vector<Sector>& sectors() const { return sectors_; }
  double farthest_m() const { return range_edges_m_.empty() ? 0 : range_edges_m_.back(); }
  /// Near and far corner at the right edge, far and near one at the left.
  std::array<FanPoint, 4> corners(std::size_t range_bin, std::size_t angle_bin) const;
  /// Index of the cell in the message, range_bin * angles() + angle_bin; -1 where there is none.
  int cellAt(FanPoint place) const;
  /// Triangles in which every texel covers its cell: arcs are chords of at most `step_rad`, nothing else is
  /// approximated.
  FanMesh mesh(double step_rad, double up_to_m) const;

 private:
  std::vector<double> range_edges_m_;
  std::vector<Sector> sectors_;
};

}  // namespace mmradartwin
