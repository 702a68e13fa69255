#pragma once

#include <ros/node_handle.h>

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace mmradartwin {

/// What a node's --help says of a parameter.
struct ParameterDescription {
  std::string name;
  std::string type;           ///< number, whole number, true or false, text, path
  std::string default_value;  ///< "" where it must be given
  std::string range;          ///< "" where every value of the type is allowed
  std::string meaning;
};

/// A node's private parameters read strictly: wrong types, values out of range and unknown names are InputErrors that
/// name the parameter, its value and what is allowed. Absent ones take the default. Each call that reads a parameter
/// also describes it.
class StrictParameters {
 public:
  explicit StrictParameters(const ros::NodeHandle& private_nh) : nh_(private_nh) {}
  /// Asks no parameter server: everything has its default, and what must be given is empty. For descriptions().
  StrictParameters() = default;

  double number(const std::string& name, double default_value, double min, double max, const std::string& meaning);
  int integer(const std::string& name, int default_value, int min, int max, const std::string& meaning);
  bool boolean(const std::string& name, bool default_value, const std::string& meaning);
  /// Not empty unless the default is.
  std::string text(const std::string& name, const std::string& default_value, const std::string& meaning);
  /// A text that must be given; `meaning` says in the error what to set it to.
  std::string requiredText(const std::string& name, const std::string& meaning);
  /// A path as its user means it: absolute, package://PACKAGE/PATH, or relative to the parameter base_folder, and where
  /// that is empty to the folder in which this process runs. "" where there is none.
  std::string path(const std::string& name, const std::string& meaning);
  /// The same of something that must be there.
  std::string existingPath(const std::string& name, const std::string& meaning);
  std::string requiredPath(const std::string& name, const std::string& meaning);
  /// The folder from which relative paths are seen, absolute.
  std::string baseFolder();
  /// Those that a diagnostic_updater::Updater reads by itself.
  void ofDiagnosticUpdater();
  /// Throws for the first parameter below the node's name that was never asked for.
  void rejectUnknown() const;

  const std::vector<ParameterDescription>& descriptions() const { return descriptions_; }

 private:
  [[noreturn]] void fail(const std::string& name, const std::string& why) const;
  /// False where the default is to be taken.
  bool read(const ParameterDescription& description, XmlRpc::XmlRpcValue& value);
  double readNumber(const ParameterDescription& description, double default_value, double min, double max);
  std::string readText(const ParameterDescription& description);
  std::string readPath(const std::string& name, bool required, const std::string& meaning);

  std::optional<ros::NodeHandle> nh_;
  std::vector<ParameterDescription> descriptions_;
  std::set<std::string> known_;
  std::optional<std::string> base_folder_;
};

/// What a node is set to: `Settings` is made of the parameters, and those that it does not ask for are refused.
template <typename Settings>
Settings readSettings(const ros::NodeHandle& private_nh) {
  StrictParameters parameters(private_nh);
  Settings settings(parameters);
  parameters.rejectUnknown();
  return settings;
}

}  // namespace mmradartwin
