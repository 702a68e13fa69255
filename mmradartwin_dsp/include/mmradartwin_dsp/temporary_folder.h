#pragma once

#include <string>

namespace mmradartwin {

/// A folder of its own below `parent` ("": the system's temporary folder) that goes with this object.
class TemporaryFolder {
 public:
  /// Throws InputError where it cannot be made.
  explicit TemporaryFolder(const std::string& parent = "");
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

}  // namespace mmradartwin
