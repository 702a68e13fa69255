#pragma once

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// A gap narrower than some 5 cm that rays leave the scene through.
struct SceneGap {
  Eigen::Vector3d place, direction;  ///< of the ray
  Eigen::Vector3d at;                ///< where it passes the surfaces beside it
  std::string beside;                ///< the actor that most neighbouring rays meet
};

/// What a plane's residuals let expect of its specular path, 1 standard deviation.
struct PathExpectation {
  std::string plane;
  double range_m = 0;
  double level_db = 0;  ///< at kExpectedRange_m
};

/// Distance of the radar that the expected level error holds for; it grows in proportion.
constexpr double kExpectedRange_m = 3;

/// What rays and the scene's facets show of a scene that was made of a scan.
struct ScanQuality {
  std::size_t places = 0;                                ///< free places inside the room that rays left from
  std::size_t rays = 0;                                  ///< in all
  std::size_t through_gaps = 0;                          ///< rays that left through such a gap
  std::size_t through_openings = 0;                      ///< rays that left where the scan is open
  std::vector<SceneGap> gaps;                            ///< the first of each actor beside one
  std::vector<std::pair<std::string, int>> bodies;       ///< actors that hold free places, and how many
  std::vector<std::pair<std::string, double>> coincide;  ///< "a in b", area that two actors claim, m2
  std::vector<std::pair<std::string, int>> slivers;      ///< actors with facets narrower than a wavelength
  std::vector<std::string> open;                         ///< things that are no closed body
  std::vector<PathExpectation> expected;                 ///< of upright planes, largest first

  bool clean() const { return through_gaps == 0 && bodies.empty() && coincide.empty() && slivers.empty(); }
};

/// Rays from 200 free places within the room, and a look at all facets. A place is free where the scan has a floor
/// below and nothing within 30 cm. Deterministic.
ScanQuality checkScanScene(const ScanScene& scene);

/// What a person should know of it, a sentence each; no sentence where all is well.
std::vector<std::string> qualityNotes(const ScanQuality& quality);

/// Writes quality.yaml and the pictures top_view.png, residuals.png and before_after.png into a folder. Throws
/// std::runtime_error where they cannot be written.
void writeScanQuality(const ScanScene& scene, const ScanQuality& quality, const std::string& folder);

}  // namespace mmradartwin
