#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/pose_context.h"
#include "mmradartwin_sim/seen_sides.h"

namespace mmradartwin {

/// The radar's elements at one pose, in map.
struct ElementsInMap {
  explicit ElementsInMap(const PoseContext& context);
  std::vector<Eigen::Vector3d> tx, rx;
  Eigen::Vector3d p;   ///< origin of radar_link
  Eigen::Vector3d up;  ///< axis of the vertical antennas
  SeenSides sides;     ///< of the scene's facets, from p

  /// Full lengths by way of one point, per virtual element.
  PerChannel<double> lengthsVia(const Eigen::Vector3d& point) const;
  /// Full lengths where `image` maps a transmitter to its image.
  template <typename Image>
  PerChannel<double> lengthsByImage(Image image) const {
    PerChannel<double> lengths;
    lengths.reserve(tx.size() * rx.size());
    for (const auto& t : tx) {
      const Eigen::Vector3d i = image(t);
      for (const auto& r : rx) lengths.push_back((i - r).norm());
    }
    return lengths;
  }
};

}  // namespace mmradartwin
