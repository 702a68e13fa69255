#pragma once

#include <ros/node_handle.h>

#include <set>
#include <string>

namespace mmradartwin {

/// A node's private parameters read strictly: wrong types, values out of range and unknown names are InputErrors that
/// name the parameter, its value and what is allowed. Absent ones take the default.
class StrictParameters {
 public:
  explicit StrictParameters(const ros::NodeHandle& private_nh) : nh_(private_nh) {}

  double number(const std::string& name, double default_value, double min, double max);
  int integer(const std::string& name, int default_value, int min, int max);
  bool boolean(const std::string& name, bool default_value);
  /// Not empty unless the default is.
  std::string text(const std::string& name, const std::string& default_value);
  /// A text that must be given; `what` says in the error what to set it to.
  std::string requiredText(const std::string& name, const std::string& what);
  /// Throws for the first parameter below the node's name that was never asked for.
  void rejectUnknown() const;

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& why) const;

  ros::NodeHandle nh_;
  std::set<std::string> known_;
};

}  // namespace mmradartwin
