#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> splitPathList(const char* variable, char separator = ':') {
  std::vector<std::string> parts;
  const char* value = std::getenv(variable);
  std::istringstream in(value ? value : "");
  for (std::string part; std::getline(in, part, separator);) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

std::string readAll(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

std::string packageName(const fs::path& folder) {
  static const std::regex name("<name>\\s*([^<\\s]+)\\s*</name>");
  const std::string xml = readAll(folder / "package.xml");
  std::smatch match;
  return std::regex_search(xml, match, name) ? match[1].str() : "";
}

/// Crawls as rospack does: hidden folders and those marked CATKIN_IGNORE are skipped, packages are not descended into,
/// symbolic links are followed once.
std::string findPackage(const fs::path& folder, const std::string& package, std::set<fs::path>& visited, int depth) {
  std::error_code error;
  const fs::path real = fs::canonical(folder, error);
  if (error || depth > 8 || !visited.insert(real).second) return "";
  if (fs::exists(folder / "package.xml", error)) return packageName(folder) == package ? folder.string() : "";
  if (fs::exists(folder / "CATKIN_IGNORE", error)) return "";
  for (fs::directory_iterator it(folder, fs::directory_options::skip_permission_denied, error), end;
       !error && it != end; it.increment(error)) {
    std::error_code ignored;
    if (!it->is_directory(ignored) || it->path().filename().string().front() == '.') continue;
    const std::string found = findPackage(it->path(), package, visited, depth + 1);
    if (!found.empty()) return found;
  }
  return "";
}

/// Folders of a package, sources before install spaces: a package may be split between both.
std::vector<std::string> packageFolders(const std::string& package) {
  std::vector<std::string> folders;
  std::set<fs::path> visited;
  for (const std::string& root : splitPathList("ROS_PACKAGE_PATH")) {
    const std::string found = findPackage(root, package, visited, 0);
    if (!found.empty()) folders.push_back(found);
  }
  std::error_code error;
  for (const std::string& prefix : splitPathList("CMAKE_PREFIX_PATH")) {
    const fs::path share = fs::path(prefix) / "share" / package;
    if (fs::exists(share / "package.xml", error)) folders.push_back(share.string());
    // A devel space names its source spaces in .catkin.
    std::istringstream sources(readAll(fs::path(prefix) / ".catkin"));
    for (std::string source; std::getline(sources, source, ';');) {
      const std::string found = source.empty() ? "" : findPackage(source, package, visited, 0);
      if (!found.empty()) folders.push_back(found);
    }
  }
  return folders;
}

}  // namespace

std::string resolvePath(const std::string& path, const std::string& base_file) {
  static const std::string scheme = "package://";
  if (path.compare(0, scheme.size(), scheme) != 0) {
    return (fs::absolute(base_file).parent_path() / path).lexically_normal().string();
  }
  const std::size_t slash = path.find('/', scheme.size());
  const std::string package = path.substr(scheme.size(), slash - scheme.size());
  const std::string rest = slash == std::string::npos ? "" : path.substr(slash + 1);
  const std::vector<std::string> folders = packageFolders(package);
  if (folders.empty()) {
    throw InputError(base_file + ": " + path + ": package '" + package +
                     "' is in neither ROS_PACKAGE_PATH nor CMAKE_PREFIX_PATH; source the workspace's setup.bash first");
  }
  for (const std::string& folder : folders) {
    std::error_code error;  // a name that is too long, say
    if (fs::exists(fs::path(folder) / rest, error)) return (fs::path(folder) / rest).lexically_normal().string();
  }
  return (fs::path(folders.front()) / rest).lexically_normal().string();
}

}  // namespace mmradartwin
