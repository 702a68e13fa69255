#include "mmradartwin_dsp/progress_line.h"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <iomanip>
#include <iostream>
#include <sstream>

namespace mmradartwin {
namespace {

/// Shorter stages are no news in a log.
constexpr std::chrono::seconds kLong(5);

std::atomic<bool> silent{false};

}  // namespace

ProgressLine::ProgressLine() : terminal_(::isatty(STDERR_FILENO) == 1), begun_(std::chrono::steady_clock::now()) {}

ProgressLine::~ProgressLine() { clear(); }

void ProgressLine::silence() { silent = true; }

void ProgressLine::show(double share, const std::string& stage) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (silent) return;
  if (stage != stage_) {
    endStage();
    stage_ = stage;
    percent_ = -1;
    begun_ = std::chrono::steady_clock::now();
  }
  const int percent = static_cast<int>(100 * std::min(1.0, std::max(0.0, share)));
  if (percent <= percent_) return;
  percent_ = percent;
  if (terminal_) say(percent, stage);
}

void ProgressLine::count(std::size_t done, std::size_t total, const std::string& things) {
  show(total == 0 ? 1 : static_cast<double>(done) / static_cast<double>(total), std::to_string(total) + " " + things);
}

void ProgressLine::say(int percent, const std::string& text) {
  std::ostringstream line;
  line << text << ": " << std::setw(3) << percent << " %";
  std::string shown = line.str();
  const std::size_t length = shown.size();
  if (length < width_) shown.append(width_ - length, ' ');
  width_ = length;
  std::cerr << '\r' << shown << std::flush;
}

void ProgressLine::endStage() {
  if (terminal_ || stage_.empty() || std::chrono::steady_clock::now() - begun_ < kLong) return;
  std::cerr << stage_ << ": done" << std::endl;
}

void ProgressLine::clear() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!silent) endStage();
  stage_.clear();
  percent_ = -1;
  if (terminal_ && width_ > 0) std::cerr << '\r' << std::string(width_, ' ') << '\r' << std::flush;
  width_ = 0;
}

}  // namespace mmradartwin
