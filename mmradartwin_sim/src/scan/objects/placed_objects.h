#pragma once

#include <string>
#include <vector>

#include "scan/things/things.h"

namespace mmradartwin {

/// Objects that were scanned by themselves, in map.
struct PlacedObjects {
  std::vector<ScanThing> things;          ///< one of each, in their order
  std::vector<std::vector<int>> claimed;  ///< samples of the room's scan that each stands for
  std::vector<std::string> notes;
};

/// Gives each object its shape at its place, and takes what it covers of the room's scan out of what things are made
/// of: room.owner becomes kOfObject. Throws InputError naming the object: no unit fits its size, it lies outside of the
/// room, two objects fill the same place, it has the name of a plane.
PlacedObjects placeObjects(const ScanFrame& frame, const ScanOptions& options, const ScanSamples& samples,
                           RoomPlanes& room);

/// Owner of samples that objects stand for, until objects have indices.
constexpr int kOfObject = -3;

/// Adds objects to the things that the room's scan has, takes out what is left of the things that they replace, and
/// gives things another number whose name an object has.
void joinObjects(const ScanSamples& samples, PlacedObjects objects, Things& things);

}  // namespace mmradartwin
