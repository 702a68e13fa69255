#pragma once

#include <sys/types.h>

#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// A program started by this one, whose standard output is read line by line. Ended with SIGTERM, and after 2 s
/// SIGKILL, when the object goes.
class ChildProcess {
 public:
  /// Throws std::runtime_error where it cannot be started.
  ChildProcess(const std::string& program, const std::vector<std::string>& arguments);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Next whole line, without its end; nothing after timeout_ms or at the end of the output.
  std::optional<std::string> readLine(int timeout_ms);
  /// Exit status once it has ended; 128 + signal where a signal ended it.
  std::optional<int> exitStatus();

 private:
  pid_t pid_ = -1;
  int output_ = -1;
  std::string buffered_;
  bool output_ended_ = false;
  std::optional<int> status_;
};

/// Path of a program that is installed beside the running one.
std::string programBeside(const std::string& name);

}  // namespace mmradartwin
