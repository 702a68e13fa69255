#include "mmradartwin_dsp/ros/tf_warning_count.h"

#include <console_bridge/console.h>
#include <ros/console.h>
#include <ros/time.h>

#include <algorithm>
#include <mutex>
#include <optional>

namespace mmradartwin {
namespace {

thread_local TfWarningCount* innermost = nullptr;

std::string kindOf(const std::string& warning) { return warning.substr(0, warning.find_first_of(" :")); }

}  // namespace

/// Takes tf2's warnings; the handler that was there before gets the rest. Made once and left in place: others may have
/// put themselves above it meanwhile.
class TfWarningHandler : public console_bridge::OutputHandler {
 public:
  static TfWarningHandler& instance() {
    static auto* const handler = new TfWarningHandler();  // lives as long as anyone may log
    return *handler;
  }

  void log(const std::string& text, console_bridge::LogLevel level, const char* file, int line) override {
    const bool of_tf = text.compare(0, 3, "TF_") == 0;
    if (of_tf && innermost) return innermost->take(text);
    if (of_tf && takenForProcess(text)) return;
    if (before_) before_->log(text, level, file, line);
  }

  void countForProcess(double every_s) {
    const std::lock_guard<std::mutex> lock(mutex_);
    every_s_ = every_s;
  }

 private:
  TfWarningHandler() : before_(console_bridge::getOutputHandler()) { console_bridge::useOutputHandler(this); }

  bool takenForProcess(const std::string& text) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!every_s_) return false;
    if (count_++ == 0) first_ = text;
    const ros::WallTime now = ros::WallTime::now();
    if ((now - told_).toSec() < *every_s_) return true;
    ROS_WARN("tf2 left out %lu transform(s); the first: %s", static_cast<unsigned long>(count_), first_.c_str());
    told_ = now;
    count_ = 0;
    return true;
  }

  console_bridge::OutputHandler* const before_;
  std::mutex mutex_;
  std::optional<double> every_s_;
  std::uint64_t count_ = 0;
  std::string first_;
  ros::WallTime told_;
};

TfWarningCount::TfWarningCount() : outer_(innermost) {
  TfWarningHandler::instance();
  innermost = this;
}

TfWarningCount::~TfWarningCount() { innermost = outer_; }

void TfWarningCount::take(const std::string& warning) {
  Kind& kind = kinds_[kindOf(warning)];
  if (kind.count++ == 0) kind.first = warning;
}

std::uint64_t TfWarningCount::count() const {
  std::uint64_t sum = 0;
  for (const auto& [name, kind] : kinds_) sum += kind.count;
  return sum;
}

std::string TfWarningCount::text() const {
  if (kinds_.empty()) return "";
  std::string text = "tf2 left out " + std::to_string(count()) + " transform(s): ";
  std::string separator;
  for (const auto& [name, kind] : kinds_) {
    text += separator + std::to_string(kind.count) + " by " + name + " (first: " +
            kind.first.substr(std::min(kind.first.find_first_not_of(": ", name.size()), kind.first.size())) + ")";
    separator = ", ";
  }
  for (char& c : text) c = c == '\n' ? ' ' : c;
  return text;
}

void countTfWarningsOfProcess(double every_s) { TfWarningHandler::instance().countForProcess(every_s); }

}  // namespace mmradartwin
