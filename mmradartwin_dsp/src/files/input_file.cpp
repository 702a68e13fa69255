#include "mmradartwin_dsp/input_file.h"

#include <sys/stat.h>

#include <map>
#include <mutex>
#include <string>
#include <utility>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// Names of the files that were read, by device and inode.
struct ReadFiles {
  std::mutex mutex;
  std::map<std::pair<dev_t, ino_t>, std::string> names;
};

ReadFiles& readFiles() {
  static auto* files = new ReadFiles;  // threads may ask while the process ends
  return *files;
}

const char* kindOf(mode_t mode) {
  if (S_ISFIFO(mode)) return "a pipe";
  if (S_ISSOCK(mode)) return "a socket";
  return "a device";
}

}  // namespace

void requireRegularFile(const std::string& file) {
  struct stat status = {};
  if (::stat(file.c_str(), &status) != 0 || S_ISDIR(status.st_mode)) return;
  if (!S_ISREG(status.st_mode)) {
    throw InputError(file + ": is " + kindOf(status.st_mode) + " and no file; give a regular file");
  }
  ReadFiles& read = readFiles();
  const std::lock_guard<std::mutex> lock(read.mutex);
  read.names[{status.st_dev, status.st_ino}] = file;
}

bool wasRead(const std::string& file) {
  struct stat status = {};
  if (::stat(file.c_str(), &status) != 0) return false;
  ReadFiles& read = readFiles();
  const std::lock_guard<std::mutex> lock(read.mutex);
  const auto found = read.names.find({status.st_dev, status.st_ino});
  if (found == read.names.end()) return false;
  // The inode of a file that is gone may be another file's by now.
  struct stat still = {};
  return ::stat(found->second.c_str(), &still) == 0 && still.st_dev == status.st_dev && still.st_ino == status.st_ino;
}

}  // namespace mmradartwin
