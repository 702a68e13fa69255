#pragma once

#include <vector>

#include "scan/planes/room_planes.h"

namespace mmradartwin {

/// What stands off the planes of a room.
struct LooseSurface {
  const ScanSamples& samples;
  const std::vector<PlaneRegion>& regions;  ///< all flat parts
  const RoomPlanes& room;
  std::vector<char> free = {};      ///< of each sample: it is loose
  std::vector<int> region_of = {};  ///< of each sample: index into regions, -1 none

  /// How far samples may lie from their shape: three standard deviations of their noise, whatever its direction.
  double toleranceOf(const std::vector<int>& indices) const;
  /// Direction of the largest upright flat part, which is regularised already; else of the normals.
  double yawIn(const std::vector<int>& indices) const;
  /// Parts of some samples that hang together: each ascending, in the order of their first samples.
  std::vector<std::vector<int>> connected(const std::vector<int>& indices) const;
};

/// Loose is what neither lies on a plane, nor next to one where corners are rounded and noise is worst, nor outside.
LooseSurface looseSurface(const ScanSamples& samples, const std::vector<PlaneRegion>& regions, const RoomPlanes& room);

}  // namespace mmradartwin
