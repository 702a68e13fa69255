#include "mmradartwin_attribution/ros/left_behind_folder.h"

#include <cstdlib>
#include <ctime>

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// Where ROS keeps what nodes leave behind.
fs::path rosHome() {
  if (const char* home = std::getenv("ROS_HOME")) return home;
  if (const char* home = std::getenv("HOME")) return fs::path(home) / ".ros";
  return fs::temp_directory_path();
}

}  // namespace

fs::path leftBehindFolder() { return rosHome() / "mmradartwin"; }

std::string nameWithTime(const std::string& what) {
  const std::time_t now = std::time(nullptr);
  char text[40];
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::strftime(text, sizeof text, "_%Y%m%d_%H%M%S", &utc);
  return what + text;
}

}  // namespace mmradartwin
