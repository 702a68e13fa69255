#pragma once

#include <string>

namespace mmradartwin {

/// Name and level of paths that a mechanism adds. The name lives as long as their records; the level is a factor of
/// amplitude.
struct PathEvent {
  const std::string& name;
  double level = 1;
};

}  // namespace mmradartwin
