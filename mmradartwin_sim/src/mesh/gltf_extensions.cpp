#include "mesh/gltf_extensions.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using nlohmann::json;

constexpr int kFloat = 5126;  ///< glTF's componentType
constexpr char kQuantized[] = "KHR_mesh_quantization", kInstanced[] = "EXT_mesh_gpu_instancing";

struct Refused {
  const char* extension;
  const char* advice;
};
/// Extensions that hold surfaces, and how to do without them.
constexpr std::array<Refused, 5> kRefused = {
    {{kInstanced, "export every copy as a node of its own (in Blender: Object, Apply, Make Instances Real)"},
     {kQuantized, "run gltf-transform dequantize IN.glb OUT.glb, or gltfpack with -noq"},
     {"EXT_meshopt_compression", "export without meshopt compression (gltfpack without -c and -cc, and with -noq)"},
     {"KHR_meshopt_compression", "export without meshopt compression (gltfpack without -c and -cc, and with -noq)"},
     {"KHR_draco_mesh_compression",
      "export without Draco compression (in Blender: glTF export, Data, untick Compression)"}}};
/// Beginnings of the names of extensions that concern looks, sound and notes alone.
constexpr std::array<const char*, 11> kLooks = {{"KHR_materials_", "KHR_texture_", "KHR_lights_", "KHR_xmp",
                                                 "KHR_audio", "KHR_techniques_webgl", "KHR_animation_pointer",
                                                 "EXT_texture_", "EXT_lights_", "ADOBE_materials_", "MSFT_texture_"}};

/// The JSON of a .gltf file, or of a .glb file's first chunk.
json documentOf(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  constexpr std::size_t kHeader = 20;  // magic, version, length; length and type of the first chunk
  if (bytes.compare(0, 4, "glTF") != 0) return json::parse(bytes, nullptr, false);
  std::uint32_t length = 0;
  if (bytes.size() < kHeader) return json();
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return json::parse(bytes.substr(kHeader, length), nullptr, false);
}

/// Entries of a list of the document that are objects.
std::vector<json> objects(const json& document, const char* list) {
  std::vector<json> found;
  if (!document.is_object() || !document.contains(list) || !document.at(list).is_array()) return found;
  for (const json& entry : document.at(list)) {
    if (entry.is_object()) found.push_back(entry);
  }
  return found;
}

bool holds(const json& object, const char* extension) {
  return object.contains("extensions") && object.at("extensions").is_object() &&
         object.at("extensions").contains(extension);
}

/// True where positions are whole numbers, which are read as if they were single precision.
bool quantizes(const json& document) {
  const std::vector<json> accessors = objects(document, "accessors");
  for (const json& mesh : objects(document, "meshes")) {
    for (const json& primitive : objects(mesh, "primitives")) {
      if (!primitive.contains("attributes") || !primitive.at("attributes").is_object()) continue;
      const json position = primitive.at("attributes").value("POSITION", json());
      if (!position.is_number_unsigned() || position.get<std::size_t>() >= accessors.size()) continue;
      const json type = accessors[position.get<std::size_t>()].value("componentType", json());
      if (type.is_number_integer() && type.get<int>() != kFloat) return true;
    }
  }
  return false;
}

[[noreturn]] void refuse(const std::string& file, const std::string& extension, const std::string& verb) {
  const auto known = std::find_if(kRefused.begin(), kRefused.end(),
                                  [&extension](const Refused& r) { return extension == r.extension; });
  throw InputError(file + ": " + verb + " the glTF extension " + extension + ", which is not read; " +
                   (known == kRefused.end() ? "export without it" : known->advice));
}

}  // namespace

void refuseUnreadExtensions(const std::string& file) {
  const json document = documentOf(file);
  if (!document.is_object()) return;
  const json required = document.value("extensionsRequired", json::array());
  for (const json& entry : required) {
    if (!entry.is_string()) continue;
    const std::string name = entry.get<std::string>();
    const bool looks = std::any_of(kLooks.begin(), kLooks.end(),
                                   [&name](const char* beginning) { return name.rfind(beginning, 0) == 0; });
    if (!looks) refuse(file, name, "requires");
  }
  const std::vector<json> nodes = objects(document, "nodes");
  if (std::any_of(nodes.begin(), nodes.end(), [](const json& node) { return holds(node, kInstanced); })) {
    refuse(file, kInstanced, "uses");
  }
  if (quantizes(document)) refuse(file, kQuantized, "uses");
}

}  // namespace mmradartwin
