#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace mmradartwin {

/// One line on stderr that changes and is gone when this goes. Within a stage it never goes back. Where nobody watches
/// it says nothing but a stage's name when a long one is over, and in a quiet program nothing at all.
class ProgressLine {
 public:
  ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine();

  /// `share` of a stage that is done, 0 to 1, from any thread.
  void show(double share, const std::string& stage);
  /// Likewise, for `done` of `total` things of one kind.
  void count(std::size_t done, std::size_t total, const std::string& things);
  void clear();

  /// No line is shown from now on.
  static void silence();

 private:
  void say(int percent, const std::string& text);
  void endStage();

  std::mutex mutex_;
  const bool terminal_;
  std::size_t width_ = 0;
  int percent_ = -1;
  std::string stage_;
  std::chrono::steady_clock::time_point begun_;
};

}  // namespace mmradartwin
