#include "mmradartwin_dsp/temporary_folder.h"

#include <stdlib.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder(const std::string& parent) {
  path_ = ((parent.empty() ? fs::temp_directory_path() : fs::path(parent)) / "mmradartwin_XXXXXX").string();
  if (!mkdtemp(path_.data())) {
    throw InputError(path_ + ": temporary folder cannot be made (" + std::strerror(errno) +
                     "); give a folder that exists, can be written and has space");
  }
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

}  // namespace mmradartwin
