#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

namespace mmradartwin {

/// A file of the folder with real measurements: MMRADARTWIN_DATA, or shared/data beside the repository.
inline std::string realData(const std::string& name) {
  const char* folder = std::getenv("MMRADARTWIN_DATA");
  const std::filesystem::path base =
      folder ? std::filesystem::path(folder)
             : std::filesystem::canonical(MMRADARTWIN_DRIVER_SOURCE).parent_path().parent_path() / "shared/data";
  return (base / name).string();
}

}  // namespace mmradartwin

#define SKIP_WITHOUT(file)                                                                   \
  if (!std::filesystem::exists(file)) {                                                      \
    GTEST_SKIP() << file << " is missing: set MMRADARTWIN_DATA to the folder that holds it"; \
  }
