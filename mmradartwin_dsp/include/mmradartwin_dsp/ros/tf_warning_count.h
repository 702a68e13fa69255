#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

namespace mmradartwin {

/// As long as one is there, what tf2 says on its thread of transforms that it leaves out (one line each, by the hundred
/// where two publishers or a bag repeat themselves) is counted instead of printed. What others say goes on as before.
class TfWarningCount {
 public:
  TfWarningCount();
  ~TfWarningCount();
  TfWarningCount(const TfWarningCount&) = delete;
  TfWarningCount& operator=(const TfWarningCount&) = delete;

  std::uint64_t count() const;
  /// All of it in one line: "tf2 left out 241 transforms: 240 by TF_REPEATED_DATA (first: ...)"; "" where it said
  /// nothing.
  std::string text() const;

 private:
  friend class TfWarningHandler;
  void take(const std::string& warning);

  struct Kind {
    std::uint64_t count = 0;
    std::string first;
  };
  std::map<std::string, Kind> kinds_;
  TfWarningCount* outer_;
};

/// What tf2 says on threads without a TfWarningCount, such as those of a tf2_ros::TransformListener, is from now on
/// counted too and told by one line of ROS_WARN, at most once in this time.
void countTfWarningsOfProcess(double every_s = 60);

}  // namespace mmradartwin
