#include "child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace mmradartwin {

ChildProcess::ChildProcess(const std::string& program, const std::vector<std::string>& arguments) {
  if (access(program.c_str(), X_OK) != 0) {
    throw std::runtime_error(program + " cannot be started: " + std::strerror(errno));
  }
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  std::vector<char*> argv{const_cast<char*>(program.c_str())};
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  pid_ = fork();
  if (pid_ < 0) {
    close(ends[0]);
    close(ends[1]);
    throw std::runtime_error(std::string("no process: ") + std::strerror(errno));
  }
  if (pid_ == 0) {
    // Other threads may hold locks: nothing but system calls from here.
    dup2(ends[1], STDOUT_FILENO);
    close_range(STDERR_FILENO + 1, ~0U, 0);  // sockets of the caller are none of the program's
    execv(program.c_str(), argv.data());
    _exit(127);
  }
  close(ends[1]);
  output_ = ends[0];
}

ChildProcess::~ChildProcess() {
  if (!exitStatus()) {
    kill(pid_, SIGTERM);
    for (int i = 0; i < 200 && !exitStatus(); ++i) usleep(10000);
    if (!status_) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  close(output_);
}

std::optional<std::string> ChildProcess::readLine(int timeout_ms) {
  for (;;) {
    const std::size_t end = buffered_.find('\n');
    if (end != std::string::npos) {
      const std::string line = buffered_.substr(0, end);
      buffered_.erase(0, end + 1);
      return line;
    }
    if (output_ended_) {
      poll(nullptr, 0, timeout_ms);
      return std::nullopt;
    }
    pollfd waiting{output_, POLLIN, 0};
    if (poll(&waiting, 1, timeout_ms) <= 0) return std::nullopt;
    char bytes[512];
    const ssize_t size = read(output_, bytes, sizeof bytes);
    if (size > 0) {
      buffered_.append(bytes, static_cast<std::size_t>(size));
    } else {
      output_ended_ = true;
    }
  }
}

std::optional<int> ChildProcess::exitStatus() {
  int status = 0;
  if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) {
    status_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }
  return status_;
}

std::string programBeside(const std::string& name) {
  return (std::filesystem::read_symlink("/proc/self/exe").parent_path() / name).string();
}

}  // namespace mmradartwin
