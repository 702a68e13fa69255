#include "mmradartwin_dsp/output.h"

#include <fcntl.h>
#include <stdio.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// The names under which outputs are written, and those that users know.
struct WrittenNames {
  std::mutex mutex;
  std::map<std::string, std::string> shown;
};

WrittenNames& writtenNames() {
  static auto* names = new WrittenNames;
  return *names;
}

bool same(const fs::path& a, const fs::path& b) {
  std::error_code none;
  return fs::equivalent(a, b, none) && !none;
}

/// Whether a path is a folder's, or lies below it; links are followed.
bool liesIn(const fs::path& path, const fs::path& folder) {
  std::error_code none;
  for (fs::path at = fs::weakly_canonical(fs::absolute(path), none); !at.empty(); at = at.parent_path()) {
    if (same(at, folder)) return true;
    if (at == at.parent_path()) break;
  }
  return false;
}

/// A file at or below a path that this process has read, or ""; what lies in `own` is its own work.
std::string readBelow(const fs::path& path, const fs::path& own) {
  if (wasRead(path.string())) return path.string();
  std::error_code none;
  if (!fs::is_directory(path, none)) return "";
  for (fs::recursive_directory_iterator it(path, none), end; !none && it != end; it.increment(none)) {
    std::error_code ignored;
    if (it->path() == own) {
      it.disable_recursion_pending();
    } else if (it->is_regular_file(ignored) && wasRead(it->path().string())) {
      return it->path().string();
    }
  }
  return "";
}

/// Empty but for what an earlier run may have left in it.
bool isEmptyFolder(const fs::path& folder, const std::string& hidden) {
  std::error_code none;
  for (fs::directory_iterator it(folder, none), end; !none && it != end; it.increment(none)) {
    if (it->path().filename().string().compare(0, hidden.size(), hidden) != 0) return false;
  }
  return !none;
}

/// A folder that cannot be taken away from under its name: another file system begins there, or a shell stands in it.
bool isFixed(const fs::path& folder) {
  struct stat own = {}, above = {};
  if (::stat(folder.c_str(), &own) != 0 || ::stat((folder / "..").c_str(), &above) != 0) return false;
  return own.st_dev != above.st_dev || same(folder, ".") || ::access((folder / "..").c_str(), W_OK) != 0;
}

/// mkdtemp makes folders for their owner alone.
void openAsUsual(const std::string& folder) {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  ::chmod(folder.c_str(), (S_IRWXU | S_IRWXG | S_IRWXO) & ~mask);
}

std::string hiddenName(const fs::path& target) { return "." + target.filename().string() + ".unfinished_"; }

}  // namespace

Output Output::file(const OutputArguments& arguments, const std::vector<std::string>& inputs) {
  return Output(arguments, inputs, "");
}

Output Output::folder(const OutputArguments& arguments, const std::vector<std::string>& inputs,
                      const std::string& mark) {
  return Output(arguments, inputs, mark);
}

Output::Output(const OutputArguments& arguments, const std::vector<std::string>& inputs, const std::string& mark)
    : name_(arguments.path), is_folder_(!mark.empty()), force_(arguments.force) {
  if (name_.empty())
    throw InputError(std::string("the output has no name; give ") + (is_folder_ ? "a folder" : "a file"));
  std::error_code error;
  fs::path target = fs::weakly_canonical(fs::absolute(name_), error);
  if (error) throw InputError(name_ + ": cannot be written (" + error.message() + "); choose another output");
  if (fs::is_symlink(fs::symlink_status(target, error))) {
    throw InputError(name_ + ": is a link that leads nowhere; remove it, or choose another output");
  }
  if (!target.has_filename()) target = target.parent_path();  // as "out/" is written
  target_ = target.string();
  refuseInputs(inputs);
  refuseExisting(force_, mark);
  makeStage();
}

void Output::refuseInputs(const std::vector<std::string>& inputs) const {
  std::error_code none;
  if (!fs::exists(target_, none)) return;
  for (const std::string& input : inputs) {
    if (input.empty() || !fs::exists(input, none)) continue;
    if (same(target_, input)) throw InputError(name_ + ": the output is the input " + input + "; choose another");
    if (liesIn(input, target_)) {
      throw InputError(name_ + ": the output holds the input " + input + "; choose another");
    }
  }
}

void Output::refuseExisting(bool force, const std::string& mark) const {
  std::error_code none;
  const fs::file_status status = fs::status(target_, none);
  if (!fs::exists(status)) return;
  if (!is_folder_) {
    if (fs::is_directory(status)) throw InputError(name_ + ": is a folder; give a file to write");
    if (!fs::is_regular_file(status)) throw InputError(name_ + ": is no regular file; give another file to write");
    if (!force) throw InputError(name_ + ": exists already; give a new name, or --force to replace it");
    return;
  }
  if (!fs::is_directory(status)) throw InputError(name_ + ": is a file; give a folder to write");
  if (isEmptyFolder(target_, hiddenName(target_))) return;
  if (!force) {
    throw InputError(name_ + ": exists already and is not empty; give a new folder, or --force to replace it whole");
  }
  if (!fs::exists(fs::path(target_) / mark, none)) {
    throw InputError(name_ + ": holds no " + mark +
                     " and so is no older result; --force does not replace such a folder");
  }
  if (!same(target_, ".") && liesIn(".", target_)) {
    throw InputError(name_ + ": holds the folder that you are in, and is not replaced; choose another output");
  }
}

void Output::makeStage() {
  const fs::path target(target_);
  std::error_code error;
  if (is_folder_) parents_ = std::make_unique<MissingParents>(target_);
  in_place_ = is_folder_ && fs::is_directory(target, error) && isFixed(target);
  const std::string parent = in_place_ ? target_ : target.parent_path().string();
  try {
    stage_ = std::make_unique<TemporaryFolder>(parent, hiddenName(target));
  } catch (const InputError&) {
    const std::string why = std::strerror(errno);
    throw InputError(name_ + ": cannot be written (" + why + "); give " +
                     (is_folder_ ? "a folder" : "a file in a folder") + " that can be written");
  }
  path_ = is_folder_ ? stage_->path() : (fs::path(stage_->path()) / target.filename()).string();
  if (is_folder_) openAsUsual(stage_->path());
  showAs(path_, name_);
}

void Output::complete() {
  const std::string input = readBelow(target_, stage_->path());
  if (!input.empty()) {
    throw InputError(name_ + ": the output is, or holds, the input " + input + "; choose another");
  }
  stage_->giveAway([this] { in_place_ ? refillFolder() : replaceFolder(); });
  stage_.reset();
}

void Output::replaceFolder() const {
  const char* const from = path_.c_str();
  const char* const to = target_.c_str();
  const auto refuse = [this](int error) {
    throw InputError(name_ + ": cannot be put in its place (" + std::strerror(error) + ")");
  };
  // A folder changes its name with the older one, which goes with the stage; so does a file, which may be newer than
  // the check that there was none.
  if (force_ && ::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_EXCHANGE) == 0) return;
  const int exchange = force_ ? errno : 0;
  if (exchange != 0 && exchange != ENOENT) {
    std::error_code ignored;
    fs::remove_all(target_, ignored);
  }
  if (is_folder_ ? ::rename(from, to) == 0 : ::renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return;
  if (is_folder_ || (errno != EINVAL && errno != ENOSYS)) refuse(errno);
  if (::rename(from, to) != 0) refuse(errno);
}

void Output::refillFolder() const {
  std::error_code error;
  const std::string hidden = hiddenName(target_);
  for (const auto& old : fs::directory_iterator(target_)) {
    if (old.path().filename().string().compare(0, hidden.size(), hidden) == 0) continue;
    if (!force_) throw InputError(name_ + ": has been filled meanwhile; nothing was written");
    fs::remove_all(old.path(), error);
  }
  for (const auto& entry : fs::directory_iterator(path_)) {
    fs::rename(entry.path(), fs::path(target_) / entry.path().filename());
  }
}

void Output::showAs(const std::string& path, const std::string& name) {
  WrittenNames& names = writtenNames();
  const std::lock_guard<std::mutex> lock(names.mutex);
  names.shown.emplace(path, name);  // an output keeps its own name where a bag is unpacked into it
}

std::string Output::namedIn(std::string text) {
  WrittenNames& names = writtenNames();
  const std::lock_guard<std::mutex> lock(names.mutex);
  // A folder within another comes first.
  for (auto it = names.shown.rbegin(); it != names.shown.rend(); ++it) {
    const auto& [written, shown] = *it;
    for (std::size_t at = 0; (at = text.find(written, at)) != std::string::npos; at += shown.size()) {
      text.replace(at, written.size(), shown);
    }
  }
  return text;
}

}  // namespace mmradartwin
