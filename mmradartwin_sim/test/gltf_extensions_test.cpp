// glTF files whose surfaces an extension holds: refused by its name, or read whole.

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "scene_files.h"

namespace mmradartwin {
namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

class GltfExtensions : public SceneFiles {
 protected:
  /// The document of a sheet of 1.0 x 0.8 m, 3 m in front of the radar at (0, 0, 1); y up. Its buffer is sheet.bin.
  static std::string document(const std::string& top, const std::string& node = "", int position_type = 5126) {
    return R"({"asset":{"version":"2.0"},)" + top + R"("scene":0,"scenes":[{"nodes":[0]}],)" +
           R"("nodes":[{"name":"sheet","mesh":0)" + node + R"(}],"materials":[{"name":"Metal"}],)" +
           R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],)" +
           R"("accessors":[{"bufferView":0,"componentType":)" + std::to_string(position_type) +
           R"(,"count":6,"type":"VEC3","min":[3,0.6,-0.5],"max":[3,1.4,0.5]}],)" +
           R"("bufferViews":[{"buffer":0,"byteLength":72}],"buffers":[{"byteLength":72,"uri":"sheet.bin"}]})";
  }
  static std::string buffer() {
    const std::vector<float> corners = {3, 0.6F, 0.5F, 3, 0.6F, -0.5F, 3, 1.4F, -0.5F,
                                        3, 0.6F, 0.5F, 3, 1.4F, -0.5F, 3, 1.4F, 0.5F};
    std::string bytes(sizeof(float) * corners.size(), '\0');
    std::memcpy(bytes.data(), corners.data(), bytes.size());
    return bytes;
  }
  static std::string little(std::uint32_t value) {
    std::string bytes(sizeof value, '\0');
    std::memcpy(bytes.data(), &value, sizeof value);
    return bytes;
  }
  static std::string binary(std::string json) {
    while (json.size() % 4 != 0) json += ' ';
    return "glTF" + little(2) + little(static_cast<std::uint32_t>(20 + json.size())) +
           little(static_cast<std::uint32_t>(json.size())) + "JSON" + json;
  }
  std::string scene(const std::string& mesh, const std::string& content) const {
    write(mesh, content);
    write("sheet.bin", buffer());
    write("scene.yaml", "meshes: [{file: " + mesh + "}]\nmaterials: materials.yaml\n");
    return path("scene.yaml");
  }
  std::string refusal(const std::string& mesh, const std::string& content) const {
    return errorOf([&] { loadScene(scene(mesh, content), 77e9); });
  }
  void expectSheet(const std::string& content) const {
    const std::vector<PathRecord> paths = makeTwin(scene("sheet.gltf", content)).simulate(radarPose(0, 0, 1)).records;
    ASSERT_EQ(paths.size(), 1u);
    EXPECT_NEAR(paths[0].length_m[0], 6, 2e-6);
    EXPECT_NEAR(db(paths[0].amplitude), -86.47, 0.005);
  }
};

TEST_F(GltfExtensions, ReadsWhatConcernsLooksAlone) {
  expectSheet(document(""));
  expectSheet(document(R"("extensionsUsed":["KHR_materials_unlit","KHR_texture_transform","KHR_lights_punctual"],)"
                       R"("extensionsRequired":["KHR_materials_unlit","KHR_texture_transform","EXT_texture_webp"],)"));
}

TEST_F(GltfExtensions, RefusesByNameWhatIsRequired) {
  for (const auto& [name, advice] :
       std::vector<std::pair<std::string, std::string>>{{"KHR_draco_mesh_compression", "Draco"},
                                                        {"EXT_meshopt_compression", "meshopt"},
                                                        {"KHR_mesh_quantization", "dequantize"},
                                                        {"EXT_mesh_gpu_instancing", "Make Instances Real"},
                                                        {"ACME_voxel_surfaces", "export without it"}}) {
    const std::string json =
        document(R"("extensionsUsed":[")" + name + R"("],"extensionsRequired":[")" + name + R"("],)");
    for (const std::string& error : {refusal("sheet.gltf", json), refusal("sheet.glb", binary(json))}) {
      EXPECT_TRUE(contains(error, "requires the glTF extension " + name)) << error;
      EXPECT_TRUE(contains(error, advice)) << error;
      EXPECT_TRUE(contains(error, "sheet.gl")) << error;
    }
  }
}

TEST_F(GltfExtensions, RefusesCopiesThatWouldBeDropped) {
  const std::string error =
      refusal("sheet.gltf", document(R"("extensionsUsed":["EXT_mesh_gpu_instancing"],)",
                                     R"(,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0}}})"));
  EXPECT_TRUE(contains(error, "uses the glTF extension EXT_mesh_gpu_instancing")) << error;
}

TEST_F(GltfExtensions, RefusesPositionsInWholeNumbers) {
  for (const int type : {5120, 5121, 5122, 5123}) {
    const std::string error = refusal("sheet.gltf", document("", "", type));
    EXPECT_TRUE(contains(error, "uses the glTF extension KHR_mesh_quantization")) << error;
  }
}

TEST_F(GltfExtensions, LeavesDamagedFilesToTheirReader) {
  for (const std::string& damaged : {std::string("glTF"), binary("{").substr(0, 22), std::string("[1, 2]"),
                                     document(R"("extensionsRequired":7,)")}) {
    const std::string error = refusal("sheet.glb", damaged);
    EXPECT_TRUE(contains(error, "sheet.glb")) << error;
  }
}

}  // namespace
}  // namespace mmradartwin
