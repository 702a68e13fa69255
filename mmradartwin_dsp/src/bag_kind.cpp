#include "mmradartwin_dsp/bag_kind.h"

#include <array>
#include <filesystem>
#include <fstream>

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

const char* const kConvert = "; make a ROS 1 bag of it (rosbags-convert)";

bool begins(const std::string& file, const std::string& bytes) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return false;
  std::string found(bytes.size(), '\0');
  std::ifstream in(file, std::ios::binary);
  return in.read(found.data(), static_cast<std::streamsize>(found.size())) && found == bytes;
}

}  // namespace

bool isBag(const std::string& file) { return begins(file, "#ROSBAG V2"); }

std::string whyNoBag(const std::string& path) {
  if (begins(path, "#ROSBAG V1") || begins(path, "#ROSRECORD")) {
    return "is a bag of format 1; convert it with rosbag fix";
  }
  if (begins(path, "\x89MCAP0\r\n")) return std::string("is a recording of ROS 2 (MCAP)") + kConvert;
  if (begins(path, std::string("SQLite format 3\0", 16))) {
    return std::string("is a database, as ROS 2 records (SQLite)") + kConvert;
  }
  std::error_code ignored;
  const fs::path folder(path);
  if (fs::exists(folder / "metadata.yaml", ignored) && !fs::exists(folder / "session.yaml", ignored)) {
    return std::string("looks like the folder of a recording of ROS 2 (it holds a metadata.yaml)") + kConvert;
  }
  return "";
}

}  // namespace mmradartwin
