// Level of a rotating metal dihedral against its angle, as CSV on standard output: to be held beside measured curves.

#include <cmath>
#include <complex>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_sim/twin.h"

using namespace mmradartwin;

namespace {

RadarConfig oneElement() {
  RadarConfig radar = paperRadar();
  radar.tx_position_m = {{0, 0, 0}};
  radar.rx_position_m = {{0, 0, 0}};
  return radar;
}

/// Writes the scene of one dihedral and its twin into the folder; returns the twin file.
std::string writeTwin(const std::string& folder, double side_m, double range_m, double turn_deg) {
  std::ofstream obj(folder + "/dihedral.obj");
  obj.precision(12);
  int index = 1;
  for (double start_deg : {135.0, 225.0}) {
    const double t = (start_deg + turn_deg) * M_PI / 180;
    obj << "o plate_" << start_deg << "\nusemtl Metal\n";
    for (const auto& [along, z] : std::vector<std::pair<double, double>>{{0, -0.5}, {1, -0.5}, {1, 0.5}, {0, 0.5}}) {
      obj << "v " << range_m + along * side_m * std::cos(t) << " " << along * side_m * std::sin(t) << " " << z * side_m
          << "\n";
    }
    obj << "f " << index << " " << index + 1 << " " << index + 2 << "\nf " << index << " " << index + 2 << " "
        << index + 3 << "\n";
    index += 4;
  }
  std::ofstream(folder + "/materials.yaml") << "materials: {Metal: {model: conductor}}\n";
  std::ofstream(folder + "/scene.yaml") << "meshes: [{file: dihedral.obj}]\nmaterials: materials.yaml\n";
  std::ofstream(folder + "/twin.yaml")
      << "scene: scene.yaml\nmechanisms:\n  specular: {}\n  corner: {}\n  edge_diffraction: {level: 1}\n";
  return folder + "/twin.yaml";
}

/// |integral of exp(-jk x^2/R) dx|^2 over a strip at range R.
double strip(double width_m, double range_m, double wavelength_m) {
  std::complex<double> sum = 0;
  constexpr int kSteps = 4000;
  for (int i = 0; i < kSteps; ++i) {
    const double x = width_m * ((i + 0.5) / kSteps - 0.5);
    sum += std::polar(width_m / kSteps, -2 * M_PI / wavelength_m * x * x / range_m);
  }
  return std::norm(sum);
}

}  // namespace

int main() {
  std::string pattern = (std::filesystem::temp_directory_path() / "mmradartwin_dihedral_XXXXXX").string();
  if (!mkdtemp(pattern.data())) {
    std::cerr << "error: no temporary folder can be made\n";
    return 1;
  }
  constexpr double kRange_m = 0.9;
  const RadarConfig radar = oneElement();
  // mutual_dbsm: the double reflection whose rays meet both plates, an aperture of twice the narrower plate's width.
  std::puts("side_m,angle_deg,total_dbsm,corner_dbsm,single_plate_dbsm,edges_dbsm,mutual_dbsm");
  for (double side_m : {0.05, 0.07, 0.10, 0.15}) {
    for (double angle = -50; angle <= 50; angle += 1) {
      Twin twin(loadTwin(writeTwin(pattern, side_m, kRange_m, angle), std::nullopt, radar));
      const Simulation s = twin.simulate(Eigen::Isometry3d::Identity());
      std::complex<double> total = 0, part[3] = {0, 0, 0};
      for (const PathRecord& r : s.records) {
        total += r.c[0];
        part[*r.event == "corner" ? 0 : (*r.event == "specular" ? 1 : 2)] += r.c[0];
      }
      // sigma = A^2 (4 pi)^3 R^4/lambda^2, with R to the fold.
      const double lambda = radar.wavelength_m(),
                   scale = std::pow(4 * M_PI, 3) * std::pow(kRange_m, 4) / (lambda * lambda);
      const auto dbsm = [scale](std::complex<double> c) { return 10 * std::log10(std::norm(c) * scale + 1e-12); };
      const double narrow_m = side_m * std::sin(std::max(0.0, 45 - std::abs(angle)) * M_PI / 180);
      const double mutual =
          4 * M_PI / (lambda * lambda) * strip(2 * narrow_m, kRange_m, lambda) * strip(side_m, kRange_m, lambda);
      std::printf("%.2f,%.1f,%.2f,%.2f,%.2f,%.2f,%.2f\n", side_m, angle, dbsm(total), dbsm(part[0]), dbsm(part[1]),
                  dbsm(part[2]), 10 * std::log10(mutual + 1e-12));
    }
  }
  std::filesystem::remove_all(pattern);
  return 0;
}
