#include "mesh/ply_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <vector>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kLongestHeader = 1 << 16;

struct Property {
  std::string name, type, count_type;  ///< count_type: of a list's length, else empty
};
struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

/// Bytes of a type, 0 for one that the format does not know.
std::size_t bytesOf(const std::string& type) {
  static const std::map<std::string, std::size_t> kSizes = {
      {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
      {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
      {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
  const auto found = kSizes.find(type);
  return found == kSizes.end() ? 0 : found->second;
}

struct PlyLimits {
  bool cloud = false;  ///< the file may have no faces
  std::uint64_t vertices = UINT64_MAX, faces = UINT64_MAX;
};

class PlyReader {
 public:
  PlyReader(const std::string& file, const PlyLimits& limits) : file_(file), limits_(limits) {
    requireRegularFile(file);
    std::ifstream in(file, std::ios::binary);
    bytes_.assign(std::istreambuf_iterator<char>(in), {});
  }

  PlyMesh run() {
    readHeader();
    const Element* vertices = element("vertex");
    const Element* faces = element("face");
    if (!vertices || vertices->count == 0) refuse("has no vertices");
    if (!limits_.cloud && (!faces || faces->count == 0)) {
      refuse("has no faces; export the surfaces as a triangle mesh");
    }
    refuseMore(vertices, limits_.vertices, "points");
    refuseMore(faces, limits_.faces, "triangles");
    for (const Property& p : vertices->properties) colored_ = colored_ || p.name == "red";
    for (const char* axis : {"x", "y", "z"}) {
      const auto& properties = vertices->properties;
      if (std::none_of(properties.begin(), properties.end(), [&](const Property& p) { return p.name == axis; })) {
        refuse(std::string("its vertices have no ") + axis);
      }
    }
    mesh_.vertices.reserve(vertices->count);
    for (const Element& e : elements_) {
      if (e.properties.empty() && e.count > 0) refuse("element " + e.name + " has no properties");
      current_ = &e;
      for (item_ = 0; item_ < e.count; ++item_) {
        if (&e == vertices) mesh_.vertices.emplace_back();
        if (&e == vertices && colored_) mesh_.colors.push_back({0, 0, 0});
        for (const Property& property : e.properties) walk(e, property);
      }
    }
    for (const std::vector<int>& face : mesh_.faces) {
      for (int vertex : face) {
        if (static_cast<std::size_t>(vertex) >= mesh_.vertices.size()) {
          refuse("face " + std::to_string(&face - mesh_.faces.data()) + " of " + std::to_string(mesh_.faces.size()) +
                 " names a vertex that is not there");
        }
      }
    }
    return std::move(mesh_);
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const {
    throw InputError(file_ + ": cannot be read as a mesh: " + why);
  }
  void refuseMore(const Element* e, std::uint64_t most, const char* what) const {
    if (!e || e->count <= most) return;
    throw InputError(file_ + ": holds " + std::to_string(e->count) + " " + what + ", more than the " +
                     std::to_string(most) + " that fit into memory; thin it to 1 cm and give it again");
  }
  std::string where() const {
    return current_->name + " " + std::to_string(item_) + " of " + std::to_string(current_->count);
  }
  const Element* element(const std::string& name) const {
    const auto found =
        std::find_if(elements_.begin(), elements_.end(), [&](const Element& e) { return e.name == name; });
    return found == elements_.end() ? nullptr : &*found;
  }

  void readHeader() {
    if (bytes_.compare(0, 3, "ply") != 0) refuse("does not begin with 'ply'");
    bool ended = false;
    while (!ended) {
      const std::size_t end = bytes_.find('\n', at_);
      if (end == std::string::npos || end > kLongestHeader) refuse("its header has no end_header");
      std::istringstream line(bytes_.substr(at_, end - at_));
      at_ = end + 1;
      std::string word;
      line >> word;
      if (word == "end_header") {
        ended = true;
      } else if (word == "format") {
        line >> format_;
      } else if (word == "element") {
        Element e;
        line >> e.name >> e.count;
        // Every item takes a byte at least.
        if (!line || e.count > bytes_.size()) refuse("its header says element " + e.name + " wrongly");
        if (element(e.name)) refuse("has element " + e.name + " twice");
        elements_.push_back(e);
      } else if (word == "property") {
        Property property;
        line >> property.type;
        if (property.type == "list") line >> property.count_type >> property.type;
        line >> property.name;
        const bool known = bytesOf(property.type) && (property.count_type.empty() || bytesOf(property.count_type));
        if (!line || !known || elements_.empty()) refuse("its header has a property that is not known");
        elements_.back().properties.push_back(property);
      } else if (word != "ply" && word != "comment" && word != "obj_info" && !word.empty()) {
        refuse("its header has a line that begins with '" + word.substr(0, 20) + "'");
      }
    }
    if (format_ != "ascii" && format_ != "binary_little_endian" && format_ != "binary_big_endian") {
      refuse("its header names no format");
    }
  }

  double next(const std::string& type) {
    if (format_ == "ascii") {
      const char* begin = bytes_.c_str() + at_;
      char* end = nullptr;
      const double value = std::strtod(begin, &end);
      if (end == begin) refuse("its data end, or are no numbers, at " + where());
      at_ += static_cast<std::size_t>(end - begin);
      return value;
    }
    const std::size_t size = bytesOf(type);
    if (bytes_.size() - at_ < size) refuse("its data end at " + where());
    char raw[8];
    std::memcpy(raw, bytes_.data() + at_, size);
    at_ += size;
    if (format_ == "binary_big_endian") std::reverse(raw, raw + size);
    if (type == "float" || type == "float32") return as<float>(raw);
    if (type == "double" || type == "float64") return as<double>(raw);
    const bool sign = type[0] != 'u';
    if (size == 1) return sign ? as<std::int8_t>(raw) : as<std::uint8_t>(raw);
    if (size == 2) return sign ? as<std::int16_t>(raw) : as<std::uint16_t>(raw);
    return sign ? static_cast<double>(as<std::int32_t>(raw)) : static_cast<double>(as<std::uint32_t>(raw));
  }
  template <typename T>
  static T as(const char* raw) {
    T value;
    std::memcpy(&value, raw, sizeof value);
    return value;
  }

  void walk(const Element& e, const Property& property) {
    if (property.count_type.empty()) {
      const double value = next(property.type);
      if (e.name == "vertex" && property.name.size() == 1 && property.name[0] >= 'x' && property.name[0] <= 'z') {
        mesh_.vertices.back()[property.name[0] - 'x'] = value;
      } else if (colored_ && e.name == "vertex") {
        setColor(property, value);
      }
      return;
    }
    const bool corners = e.name == "face" && (property.name == "vertex_indices" || property.name == "vertex_index");
    const double count = next(property.count_type);
    if (!(count >= (corners ? 3 : 0)) || count != std::floor(count) || count > static_cast<double>(bytes_.size())) {
      refuse("a list of " + std::to_string(count) + " at " + where());
    }
    if (corners) mesh_.faces.emplace_back();
    for (double i = 0; i < count; ++i) {
      const double vertex = next(property.type);
      if (!corners) continue;
      if (!(vertex >= 0 && vertex < 2147483648.0)) refuse(where() + " names a vertex that is not there");
      mesh_.faces.back().push_back(static_cast<int>(vertex));
    }
  }

  void setColor(const Property& property, double value) {
    const bool real = property.type[0] == 'f' || property.type[0] == 'd';
    const double level = std::clamp(real ? 255 * value : value, 0.0, 255.0);
    int channel = -1;
    if (property.name == "red") channel = 0;
    if (property.name == "green") channel = 1;
    if (property.name == "blue") channel = 2;
    if (channel >= 0) mesh_.colors.back()[static_cast<std::size_t>(channel)] = static_cast<unsigned char>(level);
  }

  const std::string file_;
  const PlyLimits limits_;
  bool colored_ = false;
  std::string bytes_, format_;
  std::size_t at_ = 0;
  std::uint64_t item_ = 0;
  PlyMesh mesh_;
  const Element* current_ = nullptr;
  std::vector<Element> elements_;
};

}  // namespace

std::string PlyMesh::toObj() const {
  std::string text;
  char line[128];
  for (const Eigen::Vector3d& v : vertices) {
    std::snprintf(line, sizeof line, "v %.9g %.9g %.9g\n", v.x(), v.y(), v.z());
    text += line;
  }
  for (const std::vector<int>& face : faces) {
    text += 'f';
    for (int vertex : face) text += ' ' + std::to_string(vertex + 1);
    text += '\n';
  }
  return text;
}

PlyMesh readPly(const std::string& file) { return PlyReader(file, {}).run(); }

PlyMesh readPlyScan(const std::string& file, std::uint64_t most_vertices, std::uint64_t most_faces) {
  return PlyReader(file, {true, most_vertices, most_faces}).run();
}

}  // namespace mmradartwin
