#include "hostile_input.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_sim/material.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

const char kObj[] =
    "mtllib a.mtl\no wall\nusemtl Concrete\nv 3 -2 0\nv 3 2 0\nv 3 2 3\nv 3 -2 3\nvn 1 0 0\nf 1 2 3\nf 1//1 3//1 4//1\n"
    "g box\nusemtl Metal\nf -4 -3 -2 -1\n";
const char kPly[] =
    "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n3 -2 0\n3 2 0\n3 2 3\n3 -2 3\n3 0 1 2\n"
    "3 0 2 3\n";
const char kAsciiStl[] =
    "solid a\nfacet normal 1 0 0\nouter loop\nvertex 3 -2 0\nvertex 3 2 0\nvertex 3 2 3\nendloop\nendfacet\nendsolid "
    "a\n";
const char kGltf[] = R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
 "nodes": [{"mesh": 0, "name": "wall"}], "materials": [{"name": "Concrete"}],
 "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]}],
 "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
  "max": [1, 1, 1]}],
 "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri":
 "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
const char kMaterials[] =
    "materials:\n  Metal: {model: conductor}\n"
    "  Concrete: {model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38}\n"
    "  Wood: {model: scalar, base_rcs_db: -14.0, back_exp: 2.5, mix: 0.0, diff_back_db: -99.0, norm_exp: 1.0}\n";
const char kScene[] =
    "meshes:\n  - {file: mesh.obj, xyz_m: [0, 0, 0], rpy_deg: [0, 0, 90], scale: 1.0}\nmaterials: materials.yaml\n"
    "actors: {box: {material: Metal}}\n";
const char kTwin[] =
    "mechanisms:\n  specular: {max_bounces: 2}\n  corner: {}\n  diffuse: {}\n  range_bias: {range_m: 0.03}\n"
    "  element_pattern: {cos_exponent: 2.1}\n";

std::string little(std::uint32_t value) {
  std::string bytes;
  for (int i = 0; i < 4; ++i) bytes += static_cast<char>(value >> 8 * i);
  return bytes;
}

std::string binaryStl() {
  std::string bytes = std::string(80, ' ') + little(2);
  for (int facet = 0; facet < 2; ++facet) {
    for (int i = 0; i < 12; ++i)
      bytes += little(i % 3 == 0 ? 0x3f800000 : 0x40000000u + static_cast<unsigned>(i) * 7777);
    bytes += std::string(2, '\0');
  }
  return bytes;
}

std::string binaryPly() {
  std::string bytes = kPly;
  bytes.replace(bytes.find("ascii"), 5, "binary_little_endian");
  bytes.erase(bytes.find("end_header\n") + 11);
  for (int i = 0; i < 12; ++i) bytes += little(0x3f800000u + static_cast<unsigned>(i * i) * 99999);
  for (const auto& face : {std::vector<std::uint32_t>{0, 1, 2}, {0, 2, 3}}) {
    bytes += '\3';
    for (const std::uint32_t vertex : face) bytes += little(vertex);
  }
  return bytes;
}

std::string glb() {
  std::string json = kGltf;
  while (json.size() % 4) json += ' ';
  return "glTF" + little(2) + little(static_cast<std::uint32_t>(20 + json.size())) +
         little(static_cast<std::uint32_t>(json.size())) + "JSON" + json;
}

std::function<void(const std::string&)> mesh(const std::string& extension) {
  return [extension](const std::string& bytes) {
    const std::string file = inputFolder() + "/input" + extension;
    writeInput(file, bytes);
    refusing([&] { loadMesh(file); });
  };
}

void readMaterials(const std::string& bytes) {
  const std::string file = inputFolder() + "/input_materials.yaml";
  writeInput(file, bytes);
  refusing([&] { loadMaterials(file); });
}

std::string sceneFile(const std::string& bytes) {
  const std::string folder = inputFolder();
  writeInput(folder + "/mesh.obj", kObj);
  writeInput(folder + "/materials.yaml", kMaterials);
  writeInput(folder + "/scene.yaml", bytes);
  return folder + "/scene.yaml";
}

void readScene(const std::string& bytes) {
  refusing([&] { loadScene(sceneFile(bytes), 77.93e9); });
}

void readTwin(const std::string& bytes) {
  RadarConfig radar = paperRadar();
  radar.tx_position_m = {{0, 0, 0}};
  radar.rx_position_m = {{0, 0, 0}, {0, 0.0019, 0}};
  const std::string scene = sceneFile(kScene), file = inputFolder() + "/twin.yaml";
  writeInput(file, bytes);
  refusing([&] { loadTwin(file, scene, radar).toYaml(); });
}

}  // namespace

std::vector<HostileInput> hostileInputs() {
  const std::string ply = kPly;
  return {
      {"mesh_obj", mesh(".obj"), {kObj}},
      {"mesh_ply",
       mesh(".ply"),
       {ply, binaryPly(), ply.substr(0, ply.find("end_header")),
        std::string(ply).replace(ply.find("3 0 1 2"), 7, "0")}},
      {"mesh_stl", mesh(".stl"), {kAsciiStl, binaryStl()}},
      {"mesh_gltf", mesh(".gltf"), {kGltf}},
      {"mesh_glb", mesh(".glb"), {glb()}},
      {"materials_yaml", readMaterials, {kMaterials}},
      {"scene_yaml", readScene, {kScene, "meshes: []\nmaterials: materials.yaml\n"}},
      {"twin_yaml", readTwin, {kTwin, "mechanisms: {}\n"}},
  };
}

}  // namespace mmradartwin
