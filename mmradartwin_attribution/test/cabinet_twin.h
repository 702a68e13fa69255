#pragma once

#include <Eigen/Geometry>
#include <fstream>
#include <string>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// Files of a scene with one metal cabinet, 1 m wide, its front in the plane x = 3 m.
class CabinetTwin {
 public:
  CabinetTwin() {
    const std::string at = folder_.path();
    std::ofstream(at + "/materials.yaml") << "materials:\n  Metal: {model: conductor}\n";
    std::ofstream(at + "/scene.yaml") << "meshes: [{file: cabinet.obj}]\nmaterials: materials.yaml\n";
    std::ofstream obj(at + "/cabinet.obj");
    obj << "o cabinet\nusemtl Metal\n";
    for (const char* z : {"-2", "2"}) {
      for (const char* xy : {"3 -0.5 ", "4 -0.5 ", "4 0.5 ", "3 0.5 "}) obj << "v " << xy << z << "\n";
    }
    obj << "f 1 2 3 4\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
  }
  /// A twin of the scene with these mechanisms.
  Twin with(const std::vector<NamedParameters>& mechanisms, const RadarConfig& radar = paperRadar()) const {
    return Twin(loadTwin("", folder_.path() + "/scene.yaml", radar)).changed(mechanisms);
  }

 private:
  TemporaryFolder folder_;
};

/// The heading +x at a place 0 m high.
inline Eigen::Isometry3d facingEastAt(double x_m, double y_m) {
  return Eigen::Isometry3d(Eigen::Translation3d(x_m, y_m, 0));
}

/// Poses named "0", "1", ..., each at a location of its own, as a diagnosis has them after reading. Nothing is
/// measured.
inline diagnosis::channels::ChannelData channelsAt(const std::vector<Eigen::Isometry3d>& poses) {
  diagnosis::channels::ChannelData data;
  data.radar = paperRadar();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    diagnosis::channels::PoseChannels pose;
    pose.pose.name = pose.pose.location = std::to_string(i);
    pose.pose.T_map_radar = poses[i];
    pose.location = static_cast<int>(i);
    data.locations.push_back(pose.pose.name);
    data.poses.push_back(pose);
  }
  return data;
}

}  // namespace mmradartwin
