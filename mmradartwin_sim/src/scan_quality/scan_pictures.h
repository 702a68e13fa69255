#pragma once

#include <string>

#include "mmradartwin_sim/scan_to_scene.h"

namespace mmradartwin {

/// Plan of the room with names: samples grey, planes as lines, things as outlines. Throws std::runtime_error where the
/// file cannot be written; so do the others.
void drawTopView(const ScanScene& scene, const std::string& png);
/// Each upright plane's residuals, largest plane first, on one sheet.
void drawResiduals(const ScanScene& scene, const std::string& png);
/// The scan's samples and the scene made of them from one place above the room; nearer walls and the ceiling are left
/// out. What the scene leaves out of the scan is red.
void drawBeforeAfter(const ScanScene& scene, const std::string& png);

}  // namespace mmradartwin
