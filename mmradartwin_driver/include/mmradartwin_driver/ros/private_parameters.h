#pragma once

#include <ros/node_handle.h>

#include <limits>
#include <set>
#include <string>

namespace mmradartwin {

/// A node's private parameters, read strictly: of the right type, in range, and none that the node does not know.
/// Errors are InputErrors that name parameter, value and what is allowed.
class PrivateParameters {
 public:
  explicit PrivateParameters(const ros::NodeHandle& nh);

  std::string text(const std::string& name, const std::string& otherwise);
  std::string requiredText(const std::string& name, const std::string& what);
  bool boolean(const std::string& name, bool otherwise);
  int integer(const std::string& name, int otherwise, int min, int max);
  double number(const std::string& name, double otherwise, double min, double max);
  /// Call after everything has been read.
  void rejectUnknown() const;

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& why) const;
  ros::NodeHandle nh_;
  std::set<std::string> known_;
};

}  // namespace mmradartwin
