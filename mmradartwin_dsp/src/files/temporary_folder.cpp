#include "mmradartwin_dsp/temporary_folder.h"

#include <fcntl.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// A folder this young may belong to a process that has not locked it yet.
constexpr std::time_t kYoung_s = 60;
constexpr int kSignals[] = {SIGINT, SIGTERM, SIGHUP};

/// The folders of this process, and what a signal does with them.
struct Sweeper {
  std::mutex mutex;
  std::set<std::string> folders;
  std::set<std::string> made_parents;
  bool on_signals = false, watching = false;
  std::atomic<bool> interrupted{false};
};

/// Lives as long as any thread.
Sweeper& sweeper() {
  static auto* one = new Sweeper;
  return *one;
}

int signal_pipe[2] = {-1, -1};

void passOn(int signal) {
  const int before = errno;
  const auto number = static_cast<unsigned char>(signal);
  if (::write(signal_pipe[1], &number, 1) < 0) _exit(128 + signal);
  errno = before;
}

/// Removes a folder that other threads still write into. A file takes its place, so that nobody makes it again.
void removeForGood(const std::string& folder) {
  constexpr int kMostTimes = 100;
  std::error_code ignored;
  for (int i = 0; i < kMostTimes && fs::exists(folder, ignored); ++i) fs::remove_all(folder, ignored);
  const int file = ::open(folder.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (file >= 0) ::close(file);
}

[[noreturn]] void endBy(int signal) {
  Sweeper& s = sweeper();
  s.interrupted = true;
  s.mutex.lock();  // for good: nobody takes a folder into use any more
  for (const std::string& folder : s.folders) removeForGood(folder);
  if (::isatty(STDERR_FILENO) == 1 && ::write(STDERR_FILENO, "\n", 1) < 0) _exit(128 + signal);
  for (const std::string& folder : s.folders) ::unlink(folder.c_str());
  for (auto parent = s.made_parents.rbegin(); parent != s.made_parents.rend(); ++parent) ::rmdir(parent->c_str());
  std::signal(signal, SIG_DFL);
  ::kill(::getpid(), signal);
  for (;;) ::pause();
}

/// With the lock held. Signals that do something else already are left alone.
void watchSignals(Sweeper& s) {
  if (!s.on_signals || s.watching) return;
  if (::pipe2(signal_pipe, O_CLOEXEC) != 0) return;
  s.watching = true;
  std::thread([] {
    unsigned char signal = 0;
    while (::read(signal_pipe[0], &signal, 1) != 1) continue;
    endBy(signal);
  }).detach();
  for (const int signal : kSignals) {
    struct sigaction action = {};
    if (::sigaction(signal, nullptr, &action) != 0 || action.sa_handler != SIG_DFL) continue;
    action.sa_handler = passOn;
    action.sa_flags = SA_RESTART;
    ::sigaction(signal, &action, nullptr);
  }
}

int lockFolder(const std::string& folder) {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (descriptor < 0 || ::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

/// Removes folders of processes that were killed.
void removeAbandoned(const fs::path& parent, const std::string& name) {
  std::error_code error;
  for (fs::directory_iterator it(parent, fs::directory_options::skip_permission_denied, error), end;
       !error && it != end; it.increment(error)) {
    const std::string folder = it->path().string();
    if (it->path().filename().string().compare(0, name.size(), name) != 0) continue;
    struct stat status = {};
    if (::lstat(folder.c_str(), &status) != 0 || !S_ISDIR(status.st_mode) || status.st_uid != ::geteuid()) continue;
    // One of tomorrow was made before the clock was set back.
    if (std::abs(std::time(nullptr) - status.st_mtime) < kYoung_s) continue;
    const int lock = lockFolder(folder);
    if (lock < 0) continue;
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    ::close(lock);
  }
}

}  // namespace

TemporaryFolder::TemporaryFolder(const std::string& parent, const std::string& name) {
  std::error_code error;
  const fs::path place = parent.empty() ? fs::temp_directory_path(error) : fs::path(parent);
  if (error) throw InputError("the system's temporary folder (TMPDIR) is none that can be used: " + error.message());
  removeAbandoned(place, name);
  path_ = (place / (name + "XXXXXX")).string();
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  watchSignals(s);
  if (!mkdtemp(path_.data())) {
    const int why = errno;
    const InputError refusal(path_ + ": temporary folder cannot be made (" + std::strerror(why) +
                             "); give a folder that exists, can be written and has space");
    errno = why;
    throw refusal;
  }
  lock_ = lockFolder(path_);
  s.folders.insert(path_);
}

TemporaryFolder::~TemporaryFolder() {
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  s.folders.erase(path_);
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

TemporaryFolder::Held::Held() { sweeper().mutex.lock(); }
TemporaryFolder::Held::~Held() { sweeper().mutex.unlock(); }

bool TemporaryFolder::holds(const std::string& path) {
  const std::string file = fs::path(path).lexically_normal().string();
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  for (const std::string& folder : s.folders) {
    const std::string begin = fs::path(folder).lexically_normal().string() + "/";
    if (file.compare(0, begin.size(), begin) == 0) return true;
  }
  return false;
}

MissingParents::MissingParents(const std::string& path) {
  std::error_code error;
  std::vector<std::string> missing;
  for (fs::path at = fs::path(path).parent_path(); !at.empty() && !fs::exists(at, error); at = at.parent_path()) {
    missing.push_back(at.string());
  }
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  watchSignals(s);
  for (auto at = missing.rbegin(); at != missing.rend(); ++at) {
    fs::create_directory(*at, error);
    if (error) {
      for (auto made = made_.rbegin(); made != made_.rend(); ++made) ::rmdir(made->c_str());
      throw InputError(path + ": folder cannot be made (" + error.message() + "); give one that can be written");
    }
    made_.push_back(*at);
    s.made_parents.insert(*at);
  }
}

MissingParents::~MissingParents() {
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  for (auto at = made_.rbegin(); at != made_.rend(); ++at) {
    s.made_parents.erase(*at);
    ::rmdir(at->c_str());
  }
}

void removeTemporaryFoldersOnSignals() {
  Sweeper& s = sweeper();
  const std::lock_guard<std::mutex> lock(s.mutex);
  s.on_signals = true;
}

void waitWhereInterrupted() {
  if (!sweeper().interrupted) return;
  for (;;) ::pause();
}

}  // namespace mmradartwin
