#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// A folder of its own below `parent` ("": the system's temporary folder) that goes with this object. A process that is
/// killed leaves its folders behind: they are locked while it lives, and the next one that makes a folder of the same
/// name in the same place removes those that nobody holds.
class TemporaryFolder {
 public:
  /// The folder's name begins with `name`. Throws InputError where it cannot be made.
  explicit TemporaryFolder(const std::string& parent = "", const std::string& name = "mmradartwin_tmp_");
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::string& path() const { return path_; }
  /// Calls `move`, which takes the folder away or into use, while no signal can end the process; then nothing is
  /// removed by name any more but what `move` left at path().
  template <typename Move>
  void giveAway(const Move& move) {
    const Held held;
    move();
  }

  /// True for a path below a temporary folder of this process: what it names is gone when the process ends.
  static bool holds(const std::string& path);

 private:
  /// No folder is removed by a signal while one of these exists.
  struct Held {
    Held();
    ~Held();
  };

  std::string path_;
  int lock_ = -1;
};

/// The folders above a path that are missing: made, and removed again with this object where they are still empty.
class MissingParents {
 public:
  /// Throws InputError, which names `path`.
  explicit MissingParents(const std::string& path);
  ~MissingParents();
  MissingParents(const MissingParents&) = delete;
  MissingParents& operator=(const MissingParents&) = delete;

 private:
  std::vector<std::string> made_;
};

/// From now on SIGINT, SIGTERM and SIGHUP, where they end the process, remove its temporary folders first.
void removeTemporaryFoldersOnSignals();

/// Does not return where a signal is ending the process: what goes wrong then is no news.
void waitWhereInterrupted();

}  // namespace mmradartwin
