#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/seen_sides.h"

namespace mmradartwin {

inline Eigen::Vector3d mirror(const Eigen::Vector3d& p, const Facet& facet) {
  return p - 2 * facet.planeDistance(p) * facet.normal;
}

/// Fresnel parameter up to which a path passes on the dark side of an edge, sqrt(2): the first Fresnel zone touches it.
constexpr double kDarkReach = 1.4142135623730951;

/// One straight part of a closed path.
struct PathLeg {
  Eigen::Vector3d from, to;
  int facets[2];  ///< that it begins and ends at, -1 where there is none
  double length_m;
  double gap_m;     ///< that rays leave at its ends
  double before_m;  ///< along the path, up to its beginning
  double total_m;   ///< of the path
};
using PathLegs = boost::container::small_vector<PathLeg, 4>;

/// Gap in m that a ray along `direction` leaves at a facet: a merged facet of a scan lies off the triangles that Embree
/// sees.
double legGap(const Facet& facet, const Eigen::Vector3d& direction);

PathLeg makeLeg(const Scene& scene, const Eigen::Vector3d& from, int from_facet, const Eigen::Vector3d& to,
                int to_facet, double before_m, double total_m);

/// The legs of a path from p over points on facets and back.
PathLegs legsOf(const Scene& scene, const Eigen::Vector3d& p, const PerInteraction<int>& facets,
                const PerInteraction<Eigen::Vector3d>& vertices);

/// A closed specular path from a point back to it.
struct ImagePath {
  PerInteraction<int> facets;                ///< in the order in which they are met
  PerInteraction<Eigen::Vector3d> vertices;  ///< on the facets' planes
  PerInteraction<Eigen::Vector3d>
      met;                ///< likewise, but where a vertex lies beside its facet the facet's nearest point
  Eigen::Vector3d image;  ///< of the point through all facets; the path is as long as it is far
  bool beside = false;    ///< one of the vertices lies beside its facet
};

/// Exhaustive image search over a scene's facets; what depends on the scene alone is computed once.
class ImageSearch {
 public:
  /// all_orientations: facets near the horizontal reflect too (the closed form of a box room).
  explicit ImageSearch(const Scene& scene, bool all_orientations = false);
  /// Some actors of the scene stand elsewhere now: as if made anew.
  void update(const std::vector<int>& actors);

  struct Limits {
    int max_order = 3;
    double max_length_m = 1e9;
    int only_actor = -1;  ///< paths that meet this actor alone are found; -1: all are
    /// Directions (map, from the point outwards) in which the radar sends and receives; empty: all.
    std::function<bool(const Eigen::Vector3d&)> in_view;
    /// Paths that pass beside one of their facets count up to kDarkReach; 0: none does.
    double wavelength_m = 0;
    /// Says whether a path goes on over a leg that something blocks, as edges leave light behind them; empty: none
    /// does.
    std::function<bool(const PathLeg&)> passes;
    /// Half space of in_view, for pruning: unit vector, or zero.
    Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  };
  /// Paths of order min_order..max_order whose reflection points lie inside their facets, one of them at most a Fresnel
  /// zone beside, and whose legs are all free or passed.
  /// Each facet sequence once; two sequences of the same facets with the same image once; perpendicular pairs at
  /// order 2 not at all (they are the corner's).
  std::vector<ImagePath> find(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                              int min_order = 1) const;

  /// The path of one facet sequence, where it exists.
  bool solve(const Eigen::Vector3d& p, const PerInteraction<int>& sequence, const RayCaster& rays, const Limits& limits,
             ImagePath& path) const;
  struct Seed {
    PerInteraction<int> facets;
    bool by_half;  ///< every second ray would have been enough to find it
  };
  /// Facet sequences that launched rays meet, up to max_order: seeds where there are too many facets to try all.
  std::vector<Seed> seeds(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits, int rays_launched,
                          const Eigen::Matrix3d& R_map_radar, double max_elevation_rad) const;

  /// Highest order for which all sequences can be tried at this number of facets.
  int exhaustiveOrder() const;
  const std::vector<int>& reflectors() const { return reflectors_; }

 private:
  class Finder;
  bool solve(const Eigen::Vector3d& p, const PerInteraction<int>& sequence, const RayCaster& rays, const Limits& limits,
             const SeenSides& sides, ImagePath& path) const;
  struct Corners {
    Eigen::Matrix<double, 3, 4> point;
  };
  bool faces(int a, bool positive_side, int b) const;  // b has a part on that side of a

  void build();
  const Facet& ownerOf(const RayCaster::Hit& hit) const;
  bool takesPart(const Facet& facet) const;
  void place(std::size_t reflector);
  /// Which facets have a part on which side of which others, as far as one of each two is marked.
  void findSides(const std::vector<char>& marked);

  const Scene& scene_;
  const bool all_orientations_;
  std::vector<int> reflectors_;   // facet ids
  std::vector<Corners> corners_;  // per reflector, of the bounding rectangle
  /// A facet as far as the search asks for it again and again, close together in memory: a point q of the plane lies in
  /// the bounding rectangle where e1.q - first1_m is from 0 to size1_m, and likewise the other.
  struct Mirror {
    Eigen::Vector3d normal, e1, e2;
    double offset_m, first1_m, first2_m, size1_m, size2_m;
  };
  std::vector<Mirror> mirrors_;  // per reflector
  std::vector<char> sides_;      // [a][b]: 1 where b has a part on a's negative side, 2 on its positive one, 3 both
  // [2 * reflector + side]: reflectors with a part on that side of it, 1 where its normal points. Empty where there are
  // too many for three bounces.
  std::vector<std::vector<int>> on_side_;
};

/// True for facets that are perpendicular within 0.1 deg: the corner's domain.
inline bool perpendicular(const Facet& a, const Facet& b) { return std::abs(a.normal.dot(b.normal)) < 1.745e-3; }

}  // namespace mmradartwin
