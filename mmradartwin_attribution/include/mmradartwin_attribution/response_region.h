#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_attribution/attribution_config.h"
#include "mmradartwin_attribution/response.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

class RayCaster;

enum class RegionKind {
  kFacing,  ///< a facet that faces the radar: foot of the perpendicular inside it
  kCorner,  ///< concave right angle of two facets
  kEdge,    ///< the rim of a facet, nearest to a foot that lies beside it
  kExtent,  ///< visible surface away from those, where a rough one would scatter most
  kImage    ///< a facet, or a corner, that faces the radar by way of other facets: a path of two or three mirrors
};
const std::string& regionKindName(RegionKind kind);

/// A place in a pose's map where scene and pose alone call for a strong response.
struct ResponseRegion {
  double range_m = 0;
  double azimuth_rad = 0;  ///< as a line array along y sees it: asin of the direction's y
  RegionKind kind = RegionKind::kExtent;
  std::vector<int> actors;      ///< Scene::actors; two for a corner between actors
  std::string actor, material;  ///< names and tags, joined with ";"
  Eigen::Vector3d point;        ///< map
  /// Level by geometry alone, 20 log10 of the amplitude of a perfect reflector: lambda/(8 pi R) times its aperture
  /// factor. An image has the factors of all its mirrors and of the array, which adds its paths up there. An extent has
  /// lambda/(4 pi) sqrt(S^2 sum(cos^2 dA/(pi r^4))) over the visible surface in the tight window, with
  /// S = regions.extent_scattering.
  double support_db = 0;
  Field field = Field::kCentral;
  bool measured_strong = false;   ///< filled by the comparison: a measured response >= strong in the tight window
  bool simulated_strong = false;  ///< and a simulated one
};

class MirrorSearch;

/// Expected regions of one scene. The constructor finds all that depends on the scene alone; regions() is const and
/// thread-safe.
class RegionModel {
 public:
  /// Keeps references: scene and rays must outlive it.
  RegionModel(const Scene& scene, const RayCaster& rays, const EvaluationField& field, const RadarConfig& radar);
  ~RegionModel();
  /// Regions of a pose in order of range. No two regions of one actor lie in each other's tight window.
  std::vector<ResponseRegion> regions(const Eigen::Isometry3d& T_map_radar) const;
  /// Concave right-angled corners of the scene: pairs of facets with the segment they share.
  struct Corner {
    int first, second;                     ///< facets
    Eigen::Vector3d begin, end;            ///< of the common segment, map
    double toward_second, toward_first;    ///< sign of the plane distance on which the other facet lies
    double width_first_m, width_second_m;  ///< from the line to the far end
  };
  const std::vector<Corner>& corners() const { return corners_; }

 private:
  struct Probe {
    Eigen::Vector3d point;
    int facet;
    double area_m2;
  };
  void findCorners();
  void placeProbes();
  bool seen(const Eigen::Vector3d& radar_map, const Eigen::Vector3d& point, const Eigen::Vector3d& inward) const;
  bool place(const Eigen::Isometry3d& T_map_radar, const Eigen::Vector3d& point, ResponseRegion& region) const;
  void addFacets(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const;
  void addCorners(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const;
  void addImages(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const;
  void addExtents(const Eigen::Isometry3d& T, double floor_db, std::vector<ResponseRegion>& out) const;
  void addExtentsOf(int actor, const Eigen::Isometry3d& T, double floor_db, std::vector<ResponseRegion>& out) const;
  std::vector<ResponseRegion> merged(std::vector<ResponseRegion> found) const;

  const Scene& scene_;
  const RayCaster& rays_;
  EvaluationField field_;
  RadarConfig radar_;
  double wavelength_m_;
  double max_range_m_;
  std::unique_ptr<MirrorSearch> mirrors_;
  std::vector<Corner> corners_;
  std::vector<std::vector<Probe>> probes_;  // per actor
};

}  // namespace mmradartwin
