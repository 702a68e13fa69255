#pragma once

#include <string>
#include <vector>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// Reads objects.yaml (docs/room/scan_to_scene.md) and the scans that it names, relative to itself. Throws InputError
/// naming file, object and key: a scan that cannot be read, a pose that is none, an unknown material.
std::vector<ScanObject> readScanObjects(const std::string& objects_yaml);

}  // namespace mmradartwin
