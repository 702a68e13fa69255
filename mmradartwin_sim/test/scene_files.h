#pragma once

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// The paper's radar with one element and its window centred on 77 GHz, for closed forms given at that frequency.
inline RadarConfig radarAt77GHz() {
  RadarConfig radar = paperRadar();
  radar.carrier_hz = 77e9 - radar.slope_hz_per_s * radar.window_center_s();
  radar.tx_position_m = {{0, 0, 0}};
  radar.rx_position_m = {{0, 0, 0}};
  return radar;
}

inline Eigen::Isometry3d radarPose(double x, double y, double z, double yaw_deg = 0) {
  return Eigen::Translation3d(x, y, z) * Eigen::AngleAxisd(yaw_deg * M_PI / 180, Eigen::Vector3d::UnitZ());
}

/// Writes scenes into a temporary folder of its own.
class SceneFiles : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_test_XXXXXX").string();
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    write("materials.yaml",
          "materials:\n"
          "  Metal: {model: conductor}\n"
          "  RoughMetal: {model: conductor, scattering_coefficient: 0.6}\n"
          "  Concrete: {model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38}\n"
          "  RoughConcrete: {model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38, "
          "scattering_coefficient: 0.5}\n"
          "  Lossless: {model: dielectric, relative_permittivity: 4}\n");
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string path(const std::string& name) const { return folder_ + "/" + name; }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path(name)) << text; }

  /// Adds a rectangle corner + [0,1] a + [0,1] b of n x n cells, two triangles each.
  void addRectangle(const std::string& actor, const std::string& material, const Eigen::Vector3d& corner,
                    const Eigen::Vector3d& a, const Eigen::Vector3d& b, int n = 1) {
    obj_ << "o " << actor << "\nusemtl " << material << "\n" << std::setprecision(12);
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) {
        obj_ << "v " << (corner + a * i / n + b * j / n).transpose() << "\n";
      }
    }
    const auto index = [this, n](int i, int j) { return vertices_ + 1 + i * (n + 1) + j; };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        obj_ << "f " << index(i, j) << " " << index(i + 1, j) << " " << index(i + 1, j + 1) << "\n";
        obj_ << "f " << index(i, j) << " " << index(i + 1, j + 1) << " " << index(i, j + 1) << "\n";
      }
    }
    vertices_ += (n + 1) * (n + 1);
  }

  /// Polygons of one object: vertices, and per polygon its vertices' places in that list.
  void addPolygons(const std::string& actor, const std::string& material, const std::vector<Eigen::Vector3d>& vertices,
                   const std::vector<std::vector<int>>& polygons) {
    obj_ << "o " << actor << "\nusemtl " << material << "\n" << std::setprecision(12);
    for (const auto& v : vertices) obj_ << "v " << v.transpose() << "\n";
    for (const auto& polygon : polygons) {
      obj_ << "f";
      for (int i : polygon) obj_ << " " << vertices_ + 1 + i;
      obj_ << "\n";
    }
    vertices_ += static_cast<int>(vertices.size());
  }

  /// Sphere of rings x sectors quadrangles, its poles upright.
  void addSphere(const std::string& actor, const std::string& material, const Eigen::Vector3d& center, double radius,
                 int rings, int sectors) {
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::vector<int>> polygons;
    for (int i = 1; i < rings; ++i) {
      for (int j = 0; j < sectors; ++j) {
        const double t = M_PI * i / rings, p = 2 * M_PI * j / sectors;
        vertices.push_back(center +
                           radius * Eigen::Vector3d(std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)));
        const int a = (i - 1) * sectors + j, b = (i - 1) * sectors + (j + 1) % sectors;
        if (i > 1) polygons.push_back({a - sectors, a, b, b - sectors});
      }
    }
    const int north = static_cast<int>(vertices.size()), last = north - sectors;
    vertices.push_back(center + Eigen::Vector3d(0, 0, radius));
    vertices.push_back(center - Eigen::Vector3d(0, 0, radius));
    for (int j = 0; j < sectors; ++j) {
      polygons.push_back({north, j, (j + 1) % sectors});
      polygons.push_back({north + 1, last + (j + 1) % sectors, last + j});
    }
    addPolygons(actor, material, vertices, polygons);
  }

  /// Closed cylinder from one end of its axis to the other.
  void addCylinder(const std::string& actor, const std::string& material, const Eigen::Vector3d& from,
                   const Eigen::Vector3d& to, double radius, int sides) {
    const Eigen::Vector3d axis = (to - from).normalized(), u = axis.unitOrthogonal(), v = axis.cross(u);
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::vector<int>> polygons(2);
    for (int j = 0; j < sides; ++j) {
      const double p = 2 * M_PI * j / sides;
      for (const Eigen::Vector3d& end : {from, to}) {
        vertices.push_back(end + radius * (std::cos(p) * u + std::sin(p) * v));
      }
      const int next = (j + 1) % sides;
      polygons.push_back({2 * j, 2 * next, 2 * next + 1, 2 * j + 1});
      polygons[0].push_back(2 * j);
      polygons[1].push_back(2 * j + 1);
    }
    addPolygons(actor, material, vertices, polygons);
  }

  /// Closed box.
  void addBox(const std::string& actor, const std::string& material, const Eigen::Vector3d& low,
              const Eigen::Vector3d& high) {
    obj_ << "o " << actor << "\nusemtl " << material << "\n" << std::setprecision(12);
    for (int i = 0; i < 8; ++i) {
      obj_ << "v " << (i & 1 ? high : low).x() << " " << (i & 2 ? high : low).y() << " " << (i & 4 ? high : low).z()
           << "\n";
    }
    for (const auto& q : std::vector<std::array<int, 4>>{
             {0, 1, 3, 2}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 3, 7, 5}}) {
      obj_ << "f " << vertices_ + 1 + q[0] << " " << vertices_ + 1 + q[1] << " " << vertices_ + 1 + q[2] << "\n";
      obj_ << "f " << vertices_ + 1 + q[0] << " " << vertices_ + 1 + q[2] << " " << vertices_ + 1 + q[3] << "\n";
    }
    vertices_ += 8;
  }

  /// Vertical rectangle from a to b in the floor plane, z from low to high.
  void addWall(const std::string& actor, const std::string& material, const Eigen::Vector2d& a,
               const Eigen::Vector2d& b, double low = -2, double high = 2, int n = 1) {
    addRectangle(actor, material, {a.x(), a.y(), low}, {b.x() - a.x(), b.y() - a.y(), 0}, {0, 0, high - low}, n);
  }

  /// Writes what was added as NAME.obj and NAME.yaml; returns the scene file.
  std::string writeScene(const std::string& name = "scene", const std::string& placement = "",
                         const std::string& more = "") {
    write(name + ".obj", obj_.str());
    write(name + ".yaml", "meshes:\n  - {file: " + name + ".obj" + placement + "}\nmaterials: materials.yaml\n" + more);
    obj_.str("");
    vertices_ = 0;
    return path(name + ".yaml");
  }

  Twin makeTwin(const std::string& scene, const std::string& mechanisms = "",
                const RadarConfig& radar = paperRadar()) const {
    if (mechanisms.empty()) return Twin(loadTwin("", scene, radar));
    write("twin.yaml", "mechanisms:\n" + mechanisms);
    return Twin(loadTwin(path("twin.yaml"), scene, radar));
  }

  /// Records of one mechanism.
  static std::vector<PathRecord> of(const Simulation& s, const std::string& event, int bounces = -1) {
    std::vector<PathRecord> found;
    for (const PathRecord& r : s.records) {
      if (*r.event == event && (bounces < 0 || r.bounces == bounces)) found.push_back(r);
    }
    return found;
  }

  /// The message of the InputError that f throws; "" where it throws none.
  template <typename F>
  static std::string errorOf(F f) {
    try {
      f();
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }

  std::string folder_;

 private:
  std::ostringstream obj_;
  int vertices_ = 0;
};

inline double db(double amplitude) { return 20 * std::log10(amplitude); }

}  // namespace mmradartwin
