#include "mmradartwin_sim/plugin.h"

#include <algorithm>
#include <class_loader/class_loader.hpp>
#include <cstdlib>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

/// Libraries stay loaded to the end of the process: mechanisms of theirs may live as long.
std::map<std::string, std::unique_ptr<class_loader::ClassLoader>>& loadedLibraries() {
  static auto* libraries = new std::map<std::string, std::unique_ptr<class_loader::ClassLoader>>;
  return *libraries;
}

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

void load(const std::string& library, const std::string& origin) {
  const std::string file = library.find('/') == std::string::npos ? library : resolvePath(library, "./");
  if (loadedLibraries().count(file)) return;
  std::unique_ptr<class_loader::ClassLoader> loader;
  std::vector<std::string> classes;
  try {
    loader = std::make_unique<class_loader::ClassLoader>(file);
    classes = loader->getAvailableClasses<Mechanism>();
  } catch (const std::exception& e) {
    throw InputError(origin + ": plug-in " + library + " cannot be loaded: " + firstLine(e.what()) +
                     "; give the path of a shared library that was built against this version");
  }
  if (classes.empty()) {
    throw InputError(origin + ": plug-in " + library +
                     " brings no mechanism; it must use MMRADARTWIN_REGISTER_MECHANISM");
  }
  class_loader::ClassLoader* raw = loader.get();
  MechanismRegistry& registry = MechanismRegistry::instance();
  const std::vector<std::string> known = registry.names();
  std::map<std::string, MechanismRegistry::Factory> found;
  for (const std::string& name : classes) {
    const auto create = [raw, name] {
      // Plain ownership: the library is never unloaded, so that no deleter has to tell it of its last object.
      return raw->createUniqueInstance<Mechanism>(name);
    };
    std::string mechanism;
    try {
      mechanism = create()->name();
    } catch (const std::exception& e) {
      throw InputError(origin + ": plug-in " + library + ": class " + name + " cannot be made: " + firstLine(e.what()));
    }
    if (std::find(known.begin(), known.end(), mechanism) != known.end() || found.count(mechanism)) {
      throw InputError(origin + ": plug-in " + library + ": mechanism " + mechanism +
                       " is known already; give it another name");
    }
    found[mechanism] = [create] { return std::unique_ptr<Mechanism>(create().release()); };
  }
  for (auto& [name, factory] : found) registry.add(name, std::move(factory));
  loadedLibraries()[file] = std::move(loader);
}

}  // namespace

void loadMechanismPlugins(const std::string& libraries, const std::string& origin) {
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  // A path holds ':' only in its scheme.
  std::string part;
  std::vector<std::string> parts;
  std::istringstream in(libraries);
  while (std::getline(in, part, ':')) {
    if (!parts.empty() && parts.back() == "package" && part.rfind("//", 0) == 0) {
      parts.back() += ":" + part;
    } else if (!part.empty()) {
      parts.push_back(part);
    }
  }
  for (const std::string& library : parts) load(library, origin);
}

void loadMechanismPluginsOfEnvironment() {
  const char* libraries = std::getenv("MMRADARTWIN_PLUGINS");
  if (libraries) loadMechanismPlugins(libraries, "MMRADARTWIN_PLUGINS");
}

}  // namespace mmradartwin
