#pragma once

#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/session.h"
#include "test_radar.h"

namespace mmradartwin {

inline std::string readBytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

inline void writeBytes(const std::filesystem::path& file, const std::string& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << bytes;
}

/// Every file below a folder with its bytes.
inline std::map<std::string, std::string> contentsOf(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[std::filesystem::relative(entry, folder).string()] = readBytes(entry);
  }
  return files;
}

inline std::string randomCapture(const RadarConfig& radar, int frames, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(radar.bytes_per_frame() * static_cast<std::size_t>(frames), 0);
  for (char& byte : bytes) byte = static_cast<char>(random());
  return bytes;
}

/// A session as a user writes it by hand, with comments and odd spacing that a converter must keep.
inline void writeSession(const std::filesystem::path& folder, const std::string& extra_rows = "", int frames = 4) {
  writeBytes(folder / "session.yaml",
             "# recorded on a Tuesday\nformat: mmradartwin_session/1\nradar: radar.yaml\nscene:   model/scene.yaml\n"
             "twin: twin.yaml\nposes: poses.csv\ncaptures: captures/{pose}.bin\n");
  writeBytes(folder / "radar.yaml", std::string("# AWR2243\n") + paperRadarYaml());
  writeBytes(folder / "model/scene.yaml",
             "meshes:\n  - {file: room.obj}\n  - {file: parts/desk.gltf}\nmaterials: ../materials.yaml\n");
  writeBytes(folder / "model/room.obj", "mtllib room.mtl\no wall\nv 0 0 0\n");
  writeBytes(folder / "model/room.mtl", "newmtl Concrete\nmap_Kd missing.png\n");
  writeBytes(folder / "model/parts/desk.gltf",
             "{\"asset\": {\"version\": \"2.0\"}, \"buffers\": [{\"uri\": \"desk.bin\"}]}");
  writeBytes(folder / "model/parts/desk.bin", std::string("\0\1\2\xff", 4));
  writeBytes(folder / "materials.yaml", "materials:\n  Concrete: {model: conductor}\n");
  writeBytes(folder / "twin.yaml", "mechanisms:\n  specular: {max_bounces: 3}\n");
  writeBytes(folder / "poses.csv",
             "pose,location,stamp,x,y,z,qx,qy,qz,qw\n"
             "000,A,1700000000.25,1,2,1.1,0,0,0,1\n"
             "001,A,1700000001.25,1,2,1.1,0,0,0.25881904510252074,0.96592582628906831\n"
             "002,B,1700000002.5,3,2,1.1,0,0,0,1\n" +
                 extra_rows);
  const RadarConfig radar = paperRadar();
  for (unsigned pose = 0; pose < 3; ++pose) {
    writeBytes(folder / ("captures/00" + std::to_string(pose) + ".bin"), randomCapture(radar, frames, pose));
  }
}

inline std::vector<AdcCube> framesOf(const Recording& recording, const Pose& pose) {
  std::vector<AdcCube> cubes;
  recording.forEachFrame(pose, [&cubes](const AdcCube& cube) { cubes.push_back(cube); });
  return cubes;
}

}  // namespace mmradartwin
