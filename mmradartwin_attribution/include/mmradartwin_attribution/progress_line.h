#pragma once

#include <unistd.h>

#include <chrono>
#include <iomanip>
#include <iostream>
#include <sstream>
#include <string>

namespace mmradartwin {

/// One line on stderr that changes, gone when this goes; where nobody watches, a line now and then that stays.
class ProgressLine {
 public:
  ProgressLine() = default;
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;
  ~ProgressLine() { clear(); }

  /// `share` of the work that is done, 0 to 1, and what is done now.
  void show(double share, const std::string& stage) {
    const int percent = static_cast<int>(100 * share);
    if (!terminal_) {
      const auto now = std::chrono::steady_clock::now();
      if (now - shown_ < std::chrono::seconds(5)) return;
      shown_ = now;
      std::cerr << stage << ", " << percent << " %" << std::endl;
      return;
    }
    std::ostringstream line;
    line << std::setw(3) << percent << " % " << stage;
    std::string text = line.str();
    const std::size_t length = text.size();
    if (length < width_) text.append(width_ - length, ' ');
    width_ = length;
    std::cerr << '\r' << text << std::flush;
  }

  void clear() {
    if (terminal_ && width_ > 0) std::cerr << '\r' << std::string(width_, ' ') << '\r' << std::flush;
    width_ = 0;
  }

 private:
  const bool terminal_ = isatty(STDERR_FILENO) == 1;
  std::size_t width_ = 0;
  std::chrono::steady_clock::time_point shown_{};
};

}  // namespace mmradartwin
