#include "mmradartwin_sim/ros/conversions.h"

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {

geometry_msgs::Vector3 vectorMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Vector3 msg;
  msg.x = v.x();
  msg.y = v.y();
  msg.z = v.z();
  return msg;
}

geometry_msgs::Point pointMsg(const Eigen::Vector3d& v) {
  geometry_msgs::Point msg;
  msg.x = v.x();
  msg.y = v.y();
  msg.z = v.z();
  return msg;
}

}  // namespace

mmradartwin_msgs::PathRecords toMsg(const Simulation& simulation, const std::vector<PathRecord>& records,
                                    const Scene& scene, std::uint64_t radar_hash) {
  mmradartwin_msgs::PathRecords msg;
  msg.header.stamp = toRosTime(simulation.stamp_ns);
  msg.radar_hash = radar_hash;
  msg.T_map_radar = toMsg(simulation.T_map_radar);
  msg.propagation_only = simulation.propagation_only;
  msg.records.resize(records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PathRecord& r = records[i];
    mmradartwin_msgs::PathRecord& m = msg.records[i];
    m.event = *r.event;
    for (int actor : r.actors) {
      m.actors.push_back(scene.actorOf(actor).name);
      m.materials.push_back(scene.actorOf(actor).material_tag);
    }
    for (const auto& v : r.vertices) m.vertices.push_back(pointMsg(v));
    m.departure = vectorMsg(r.departure);
    m.arrival = vectorMsg(r.arrival);
    m.bounces = static_cast<std::uint32_t>(r.bounces);
    m.range_bin = static_cast<std::uint32_t>(r.range_bin);
    m.amplitude = r.amplitude;
    m.phase_rad = r.phase_rad;
    m.length_m.assign(r.length_m.begin(), r.length_m.end());
    m.c_re.reserve(r.c.size());
    m.c_im.reserve(r.c.size());
    for (const auto& c : r.c) {
      m.c_re.push_back(c.real());
      m.c_im.push_back(c.imag());
    }
  }
  return msg;
}

mmradartwin_msgs::Scene toMsg(const Scene& scene, const std::string& twin_yaml) {
  mmradartwin_msgs::Scene msg;
  msg.scene_file = scene.file;
  msg.twin_yaml = twin_yaml;
  msg.facet_angle_rad = scene.tolerance.angle_deg * kDegree;
  msg.facet_offset_m = scene.tolerance.offset_m;
  for (const Actor& actor : scene.actors) {
    msg.actors.emplace_back();
    mmradartwin_msgs::SceneActor& m = msg.actors.back();
    m.name = actor.name;
    m.material = actor.material_tag;
    for (int i = 0; i < 3; ++i) m.color[i] = static_cast<float>(actor.material.color[i]);
    m.color[3] = 1;
    m.triangles.reserve(3 * actor.triangles.size());
    for (const auto& t : actor.triangles) {
      for (int v : t) m.triangles.push_back(pointMsg(actor.vertices[v]));
    }
  }
  return msg;
}

}  // namespace mmradartwin
