#pragma once

#include <fstream>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/hypothesis_fitter.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/likelihood/clutter_field.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis {

/// A box of a made room; it reaches from 1.5 m below the radar to 1.5 m above it.
struct MadeBox {
  std::string name, material;
  double x0_m, y0_m, x1_m, y1_m;
};

/// Three long cupboards around the radar: fronts at x = 4 m, y = 3 m and y = -3 m.
inline std::vector<MadeBox> threeCupboards() {
  return {{"east", "Metal", 4, -2.5, 4.3, 2.5},
          {"north", "Plate", -2.5, 3, 2.5, 3.3},
          {"south", "Metal", -2.5, -3.3, 2.5, -3}};
}

/// A mechanism with some of its numbers set.
inline NamedParameters mechanismWith(const std::string& name,
                                     const std::vector<std::pair<std::string, double>>& numbers) {
  NamedParameters mechanism = defaultMechanism(name);
  for (const auto& [key, value] : numbers) mechanism.values.set(key, value);
  return mechanism;
}

/// Specular reflections of first order: one echo of each front that the radar stands square before.
inline std::vector<NamedParameters> firstOrder() { return {mechanismWith("specular", {{"max_bounces", 1.0}})}; }

/// A small room, a radar at several places in it, and channels that are made by the simulator with noise of their own.
class MadeRoom {
 public:
  explicit MadeRoom(int poses = 12, const std::vector<MadeBox>& boxes = threeCupboards(),
                    const RadarConfig& radar = paperRadar()) {
    data.radar = radar;
    std::ofstream(folder_.path() + "/materials.yaml")
        << "materials:\n  Metal: {model: conductor}\n  Plate: {model: conductor}\n";
    std::ofstream(folder_.path() + "/scene.yaml") << "meshes: [{file: room.obj}]\nmaterials: materials.yaml\n";
    writeMesh(boxes);
    const double headings_deg[] = {0, 40, -40, 25, -25, 60, -60};
    for (int i = 0; i < poses; ++i) {
      PoseChannels& p = data.poses.emplace_back();
      p.pose.name = "pose" + std::to_string(i);
      p.pose.location = p.pose.name;
      p.pose.stamp_ns = std::int64_t{60} * i * 1000000000;
      p.location = i;
      data.locations.push_back(p.pose.location);
      const Eigen::Vector3d place(1.2 * std::sin(2.1 * i), 1.1 * std::cos(1.7 * i), 0);
      p.pose.T_map_radar =
          Eigen::Translation3d(place) *
          Eigen::AngleAxisd(headings_deg[static_cast<std::size_t>(i) % std::size(headings_deg)] * M_PI / 180,
                            Eigen::Vector3d::UnitZ());
    }
    twin.emplace(loadTwin("", folder_.path() + "/scene.yaml", data.radar));
    std::vector<Pose> session;
    for (const PoseChannels& p : data.poses) session.push_back(p.pose);
    twin->setSession(session);
    expectClutter(twin->scene(), data);
  }

  /// Windowed range spectra of what the simulator makes of a pose, a tone's own amplitude.
  Eigen::MatrixXcd spectraOf(const std::vector<NamedParameters>& truth, std::size_t pose) const {
    const Pose& at = data.poses[pose].pose;
    const ComplexGrid x = twin->changed(truth).simulate(at.T_map_radar, at.stamp_ns).grid.x;
    return SignalChain(data.radar).rangeSpectra(x) / (0.5 * static_cast<double>(x.cols()));
  }

  /// Fills the channels with what the simulator makes of these mechanisms. Each channel of a pose has an error of its
  /// own, and each cell has white noise.
  void measure(const std::vector<NamedParameters>& truth, double channel_error = 0.01, double noise = 2e-7) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal(0, 1);
    const auto draw = [&] { return std::complex<double>(normal(random), normal(random)) / std::sqrt(2.0); };
    for (std::size_t i = 0; i < data.poses.size(); ++i) {
      PoseChannels& p = data.poses[i];
      p.range_spectra = spectraOf(truth, i);
      for (Eigen::Index k = 0; k < p.range_spectra.rows(); ++k) p.range_spectra.row(k) *= 1.0 + channel_error * draw();
      for (std::complex<double>& y : p.range_spectra.reshaped()) y += noise * draw();
      p.noise_power = 0.5 * noise * noise;  // the clutter's floor has the other half
    }
  }

  ChannelData data;
  std::optional<Twin> twin;

 private:
  void writeMesh(const std::vector<MadeBox>& boxes) const {
    std::ofstream mesh(folder_.path() + "/room.obj");
    int first = 1;
    for (const MadeBox& b : boxes) {
      mesh << "o " << b.name << "\nusemtl " << b.material << "\n";
      for (double z : {-1.5, 1.5}) {
        mesh << "v " << b.x0_m << " " << b.y0_m << " " << z << "\nv " << b.x1_m << " " << b.y0_m << " " << z << "\n";
        mesh << "v " << b.x1_m << " " << b.y1_m << " " << z << "\nv " << b.x0_m << " " << b.y1_m << " " << z << "\n";
      }
      const int faces[][4] = {{0, 1, 2, 3}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
      for (const auto& face : faces) {
        mesh << "f";
        for (int corner : face) mesh << " " << first + corner;
        mesh << "\n";
      }
      first += 8;
    }
  }

  TemporaryFolder folder_;
};

/// The likelihood of a measured room and the state of a twin with some mechanisms.
struct FittedRoom {
  FittedRoom(MadeRoom& room, const std::vector<NamedParameters>& mechanisms)
      : source(*room.twin, room.data, PoseAccuracy()),
        model(room.data, static_cast<int>(room.twin->scene().actors.size()), PoseAccuracy()),
        fitter(source, model, 3) {
    source.pointBeams(room.data, mechanisms, model.firstBin());
    null = fitter.state(mechanisms, nullptr);
    source.setBaseline(mechanisms);
  }
  std::vector<int> everyPose() const { return fit::everyPose(null); }

  ExpectedEchoes source;
  ChannelLikelihood model;
  HypothesisFitter fitter;
  ModelState null;
};

/// The hypothesis of one number of a mechanism about a subject.
inline Hypothesis hypothesisOf(const std::string& mechanism, const std::vector<Coordinate>& coordinates,
                               const std::string& subject_key = "", const std::string& subject = "") {
  Hypothesis hypothesis;
  hypothesis.mechanism = defaultMechanism(mechanism);
  if (!subject_key.empty()) hypothesis.mechanism.values.set(subject_key, subject);
  hypothesis.subject = subject;
  hypothesis.coordinates = coordinates;
  return hypothesis;
}

/// Levels of one material, or of one actor.
inline Hypothesis reflectivityOf(const std::string& material) {
  return hypothesisOf("material_reflectivity", {{"delta_db", "dB", -1, 0, -3, -200, 60, {}}}, "material", material);
}

}  // namespace mmradartwin::diagnosis
