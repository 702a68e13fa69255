#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin {

/// Mechanisms are found by name. A user's package registers one from its own plug-in library.
class MechanismRegistry {
 public:
  using Factory = std::function<std::unique_ptr<Mechanism>()>;
  static MechanismRegistry& instance();
  void add(const std::string& name, Factory factory);
  /// A mechanism as its maker leaves it, not configured. Throws InputError naming the known mechanisms.
  std::unique_ptr<Mechanism> create(const std::string& name) const;
  std::vector<std::string> names() const;

 private:
  std::map<std::string, Factory> factories_;
};

}  // namespace mmradartwin
