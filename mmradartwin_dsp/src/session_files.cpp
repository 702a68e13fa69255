#include "mmradartwin_dsp/session_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/text.h"
#include "yaml_document.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

const std::string kPackageScheme = "package://";

std::string readFile(const fs::path& file) {
  requireRegularFile(file.string());
  std::ifstream in(file, std::ios::binary);
  if (!in || fs::is_directory(file))
    throw InputError(file.string() + ": cannot be read; put the file there or correct the name");
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

bool hasBytes(const fs::path& file, const std::string& bytes) {
  std::error_code error;
  return fs::is_regular_file(file, error) && readFile(file) == bytes;
}

/// Where a file of a session belongs, independent of the machine: below the session's folder, a package or "/".
struct Place {
  enum class Root { kSession, kPackage, kAbsolute } root = Root::kSession;
  std::string package;
  fs::path path;  // relative to the root, normalised; may begin with ".."

  bool inside() const { return root == Root::kSession && (path.empty() || *path.begin() != ".."); }

  /// Name in the session message: relative to the session's folder, files from outside below external/.
  std::string storedName() const {
    if (inside()) return path.string();
    fs::path name = fs::path("external") / (root == Root::kSession   ? "session"
                                            : root == Root::kPackage ? "package"
                                                                     : "root");
    if (root == Root::kPackage) name /= package;
    for (const fs::path& part : path) name /= part == ".." ? fs::path("up") : part;
    return name.string();
  }

  fs::path resolve(const fs::path& directory) const {
    if (root == Root::kAbsolute) return fs::path("/") / path;
    if (root == Root::kSession) return (directory / path).lexically_normal();
    return resolvePath(kPackageScheme + package + "/" + path.string(), (directory / "session.yaml").string());
  }

  /// The place that `reference` means where it stands in the file at this place.
  Place follow(const std::string& reference) const {
    Place target;
    if (reference.compare(0, kPackageScheme.size(), kPackageScheme) == 0) {
      const std::string rest = reference.substr(kPackageScheme.size());
      target.root = Root::kPackage;
      target.package = rest.substr(0, rest.find('/'));
      target.path = rest.find('/') == std::string::npos ? "" : fs::path(rest.substr(rest.find('/') + 1));
    } else if (fs::path(reference).is_absolute()) {
      target.root = Root::kAbsolute;
      target.path = fs::path(reference).relative_path();
    } else {
      target = *this;
      target.path = path.parent_path() / reference;
    }
    target.path = target.path.lexically_normal();
    return target;
  }
};

void collectYaml(const YAML::Node& node, std::vector<std::string>& references) {
  static const std::set<std::string> kKeys = {"file", "materials", "mesh", "poses", "radar", "scene", "twin"};
  if (node.IsSequence()) {
    for (const YAML::Node& child : node) collectYaml(child, references);
  } else if (node.IsMap()) {
    for (const auto& entry : node) {
      if (entry.second.IsScalar() && entry.first.IsScalar() && kKeys.count(entry.first.Scalar())) {
        references.push_back(entry.second.Scalar());
      } else {
        collectYaml(entry.second, references);
      }
    }
  }
}

/// Rest of the lines that begin with one of `keywords`, as OBJ and MTL files name others.
void collectLines(const std::string& bytes, const std::vector<std::string>& keywords, bool last_word_only,
                  std::vector<std::string>& references) {
  std::istringstream in(bytes);
  for (std::string line; std::getline(in, line);) {
    line.erase(line.find_last_not_of(" \t\r") + 1);
    const std::size_t begin = line.find_first_not_of(" \t");
    if (begin == std::string::npos) continue;
    const bool named = std::any_of(keywords.begin(), keywords.end(), [&](const std::string& keyword) {
      return line.compare(begin, keyword.size(), keyword) == 0;
    });
    const std::size_t space = last_word_only ? line.find_last_of(" \t") : line.find_first_of(" \t", begin);
    if (named && space != std::string::npos) references.push_back(line.substr(line.find_first_not_of(" \t", space)));
  }
}

const std::string kCapturesInside = "captures/{pose}.bin";

std::string capturesKey(const std::string& session_yaml) {
  try {
    const YAML::Node yaml = parseYamlDocument(session_yaml, "session.yaml");
    if (yaml.IsMap() && yaml["captures"] && yaml["captures"].IsScalar()) return yaml["captures"].Scalar();
  } catch (const InputError&) {  // whoever reads the session says so
  }
  return "";
}

struct References {
  std::vector<std::string> names;
  bool required = false;  // a mesh may name textures that nobody has
  bool yaml = false;
};

References findReferences(const std::string& name, const std::string& bytes) {
  References found;
  std::string extension = fs::path(name).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return static_cast<char>(std::tolower(c)); });
  if (extension == ".yaml" || extension == ".yml") {
    found.required = found.yaml = true;
    collectYaml(parseYamlDocument(bytes, name), found.names);
  } else if (extension == ".obj") {
    collectLines(bytes, {"mtllib "}, false, found.names);
  } else if (extension == ".mtl") {
    collectLines(bytes, {"map_", "bump ", "disp ", "decal ", "refl ", "norm "}, true, found.names);
  } else if (extension == ".gltf") {
    const nlohmann::json gltf = nlohmann::json::parse(bytes, nullptr, false);
    for (const char* list : {"buffers", "images"}) {
      if (!gltf.is_object() || !gltf.contains(list)) continue;
      for (const nlohmann::json& entry : gltf.at(list)) {
        const bool named = entry.is_object() && entry.contains("uri") && entry.at("uri").is_string();
        const std::string uri = named ? entry.at("uri").get<std::string>() : "";
        if (!uri.empty() && uri.compare(0, 5, "data:") != 0) found.names.push_back(uri);
      }
    }
  }
  return found;
}

void replaceAll(std::string& text, const std::string& from, const std::string& to) {
  for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
    text.replace(at, from.size(), to);
}

/// Throws InputError for names that are none of files, or of which one would be a folder of another.
void refuseNames(const std::vector<StoredFile>& files) {
  constexpr std::size_t kLongest_bytes = 255;  // of a file system's names
  std::set<fs::path> names;
  for (const StoredFile& file : files) {
    const auto refuse = [&file](const std::string& why) {
      throw InputError("session message: file name '" + shownShort(file.name) + "' " + why + "; it is not written");
    };
    const fs::path name = fs::path(file.name).lexically_normal();
    if (file.name.empty() || name.is_absolute() || *name.begin() == "..") refuse("leaves the session's folder");
    if (name == "." || !name.has_filename()) refuse("is that of a folder");
    if (file.name.find('\0') != std::string::npos) refuse("holds a zero");
    for (const fs::path& part : name) {
      if (part.native().size() > kLongest_bytes) refuse("is too long");
    }
    if (file.name.size() > 8 * kLongest_bytes) refuse("is too long");
    names.insert(name);
  }
  for (const fs::path& name : names) {
    for (fs::path above = name.parent_path(); !above.empty(); above = above.parent_path()) {
      if (names.count(above)) {
        throw InputError("session message: '" + shownShort(above.string()) + "' is a file and the folder of '" +
                         shownShort(name.string()) + "'; nothing is written");
      }
    }
  }
}

}  // namespace

std::string storedCapturePattern(const std::string& session_yaml) {
  Place session;
  session.path = "session.yaml";
  const std::string pattern = capturesKey(session_yaml);
  if (pattern.empty()) return kCapturesInside;
  const Place place = session.follow(pattern);
  return place.inside() ? place.storedName() : kCapturesInside;
}

std::vector<StoredFile> gatherSessionFiles(const std::string& session_file) {
  const fs::path file =
      fs::is_directory(session_file) ? fs::path(session_file) / "session.yaml" : fs::path(session_file);
  const fs::path directory = fs::absolute(file).parent_path();
  std::vector<StoredFile> files;
  std::set<std::string> seen;
  // Breadth first, so that session.yaml, radar.yaml and poses.csv stand in front.
  std::vector<Place> queue(1);
  queue.front().path = "session.yaml";
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Place place = queue[i];
    if (!seen.insert(place.storedName()).second) continue;
    const fs::path from = i == 0 ? file : place.resolve(directory);
    files.push_back({place.storedName(), readFile(from)});
    const References references = findReferences(from.string(), files.back().bytes);
    for (const std::string& reference : references.names) {
      const Place target = place.follow(reference);
      std::error_code error;  // a name that is too long is none
      if (!fs::is_regular_file(target.resolve(directory), error)) {
        if (!references.required) continue;
        throw InputError(from.string() + ": names '" + reference +
                         "', which does not exist; correct the name or put the file there");
      }
      queue.push_back(target);
    }
  }
  return files;
}

std::optional<std::string> absolutePathOf(const StoredFile& file) {
  Place root;
  root.root = Place::Root::kAbsolute;
  const std::string below = root.storedName();
  if (file.name.compare(0, below.size() + 1, below + "/") != 0) return std::nullopt;
  return file.name.substr(below.size());
}

void restoreSessionFiles(const std::vector<StoredFile>& files, const std::string& directory) {
  std::map<std::string, const StoredFile*> stored;
  refuseNames(files);
  for (const StoredFile& file : files) stored[file.name] = &file;
  struct Entry {
    Place place;
    bool moved;  // written below external/ instead of where it came from
  };
  std::vector<Entry> queue(1);
  queue.front() = {Place(), false};
  queue.front().place.path = "session.yaml";
  std::set<std::string> written;
  std::vector<StoredFile> output;
  const auto keep = [&](const std::string& name, const std::string& bytes) {
    output.push_back({name, bytes});
    written.insert(name);
  };
  const auto write = [&](const std::string& name, const std::string& bytes) {
    const fs::path target = fs::path(directory) / name;
    fs::create_directories(target.parent_path());
    std::ofstream out(target, std::ios::binary | std::ios::trunc);
    out << bytes;
    out.close();
    if (!out) throw std::runtime_error(target.string() + ": cannot be written; check folder, rights and free space");
  };
  for (std::size_t i = 0; i < queue.size(); ++i) {
    const Entry entry = queue[i];
    const std::string name = entry.place.storedName();
    if (!stored.count(name) || written.count(name)) continue;
    std::string bytes = stored.at(name)->bytes;
    const References references = findReferences((fs::path(directory) / name).string(), bytes);
    for (const std::string& reference : references.names) {
      const Place target = entry.place.follow(reference);
      const auto found = stored.find(target.storedName());
      if (found == stored.end()) continue;
      if (target.inside()) {
        queue.push_back({target, false});
        continue;
      }
      bool here = false;  // the same file already stands on this machine
      try {
        here = !entry.moved && hasBytes(target.resolve(directory), found->second->bytes);
      } catch (const InputError&) {  // its package is not here
      }
      if (here) continue;
      queue.push_back({target, true});
      const std::string relative =
          fs::path(target.storedName()).lexically_relative(fs::path(name).parent_path()).string();
      if (references.yaml && relative != reference) replaceAll(bytes, reference, relative);
    }
    if (i == 0) {
      const std::string pattern = capturesKey(bytes), inside = storedCapturePattern(bytes);
      if (!pattern.empty() && !entry.place.follow(pattern).inside()) replaceAll(bytes, pattern, inside);
    }
    keep(name, bytes);
  }
  // What no reference leads to (captures that are no whole frames, say) belongs where its name says.
  for (const auto& [name, file] : stored) {
    if (!written.count(name) && name.compare(0, 9, "external/") != 0) keep(name, file->bytes);
  }
  // session.yaml last: a folder without it is recognisably unfinished.
  for (auto file = output.rbegin(); file != output.rend(); ++file) {
    if (file->name != "session.yaml") write(file->name, file->bytes);
  }
  for (const StoredFile& file : output) {
    if (file.name == "session.yaml") write(file.name, file.bytes);
  }
}

}  // namespace mmradartwin
