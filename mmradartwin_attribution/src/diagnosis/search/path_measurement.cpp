#include "diagnosis/search/path_measurement.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>

#include "diagnosis/echoes/echo_field.h"

namespace mmradartwin::diagnosis::search {
namespace {

const std::string kTotalPower = "total_power_db";
constexpr double kDominant = 0.5;       ///< share of a path in the power expected in its direction
constexpr double kAlone = 0.7;          ///< share in the power of all channels, for comparisons of channels
constexpr double kLeastPower = 1e-5;    ///< power of a path over that of the pose's strongest one
constexpr double kFarthest_bins = 2.2;  ///< distance from its expected bin within which a path is searched

/// Groups of channels that may share an error: those of one transmitter (except the first), or of one receiver.
std::vector<std::vector<double>> channelGroups(const RadarConfig& radar) {
  const int receivers = static_cast<int>(radar.rx_position_m.size());
  std::vector<std::vector<double>> groups;
  const auto add = [&](auto belongs) {
    std::vector<double> group;
    for (int k = 0; k < radar.channels(); ++k) {
      if (belongs(k)) group.push_back(k);
    }
    if (static_cast<int>(group.size()) < radar.channels()) groups.push_back(std::move(group));
  };
  for (int t = 1; t * receivers < radar.channels(); ++t) {
    add([=](int k) { return k / receivers == t; });
  }
  for (int r = 0; r < receivers; ++r) {
    add([=](int k) { return k % receivers == r; });
  }
  return groups;
}

/// Mean of these channels over that of the others.
std::complex<double> ratioOf(const std::vector<double>& of, const Eigen::VectorXcd& channel) {
  std::complex<double> those = 0, others = 0;
  for (Eigen::Index k = 0; k < channel.size(); ++k) {
    (std::count(of.begin(), of.end(), k) > 0 ? those : others) += channel[k];
  }
  const double count = static_cast<double>(of.size()), share = count / (static_cast<double>(channel.size()) - count);
  return those * std::conj(others) / (share * std::norm(others) + 1e-300);
}

}  // namespace

std::vector<Observable> observables(const RadarConfig& radar) {
  using Kind = Observable::Kind;
  const std::vector<std::string> of_pose = {"time_s", "heading_deg", "height_m"};  // equal for all paths of a pose
  std::vector<std::string> any, of_path;
  for (const std::string& name : LawVariable::names()) {
    if (name == "standing_m" || name == kTotalPower || LawVariable::isAboutPlace(name)) continue;
    any.push_back(name);
    if (std::find(of_pose.begin(), of_pose.end(), name) == of_pose.end()) of_path.push_back(name);
  }
  std::vector<std::string> of_gain = any;
  of_gain.push_back(kTotalPower);  // what follows it is a level: of an amplifier that gives way, or is controlled
  std::vector<Observable> all = {{Kind::kGain, "gain_db", "dB", 2.0, 60, 10, 0.5, false, of_gain},
                                 {Kind::kDelay, "delay_m", "m", 0.02, 1, 0.2, 0.003, true, any},
                                 {Kind::kAngle, "angle_deg", "deg", 1.0, 45, 10, 0.2, true, of_path},
                                 {Kind::kAngleOfPose, "angle_deg", "deg", 1.0, 45, 10, 0.1, true, of_pose}};
  const std::vector<std::string> of_channels = {"range_m", "azimuth_deg", "time_s", "amplitude_db"};
  for (const std::vector<double>& group : channelGroups(radar)) {
    all.push_back({Kind::kChannelGain, "gain_db", "dB", 2.0, 60, 10, 0.2, true, of_channels, group});
    all.push_back({Kind::kChannelPhase, "phase_deg", "deg", 10, 360, 60, 1, true, of_channels, group});
  }
  return all;
}

MeasuredPose measurePaths(const Twin& twin, const ChannelLikelihood& model, const ModelState& state, int pose,
                          double session_s, const std::vector<Observable>& of) {
  const PoseChannels& data = model.data().poses[static_cast<std::size_t>(pose)];
  const RadarConfig& radar = twin.radar();
  const Eigen::Isometry3d& T = data.pose.T_map_radar;
  std::vector<PathRecord> records = twin.receivedPaths(T, twin.trace(T, data.pose.stamp_ns), data.pose.stamp_ns);
  double most = 0, power = 0;
  for (const PathRecord& r : records) {
    most = std::max(most, r.amplitude);
    power += r.amplitude * r.amplitude;
  }
  MeasuredPose result{data.location, {twin.tracedScene(), T, session_s, most, power}, {}};
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const double gain = std::exp(state.latents.log_gain), wave = 2 * M_PI / radar.wavelength_m();
  std::map<int, Eigen::MatrixXcd> expected;  // by bin
  for (PathRecord& record : records) {
    if (record.bounces == 0 || record.amplitude * record.amplitude < kLeastPower * most * most) continue;
    const double place = 0.5 * meanLength_m(record) / radar.range_bin_m();
    const int bin = static_cast<int>(std::lround(place));
    if (bin < model.firstBin() || bin >= samples) continue;
    const Eigen::VectorXcd a = Eigen::Map<const Eigen::VectorXcd>(record.c.data(), channels).normalized();
    Eigen::MatrixXcd& sigma = expected[bin];
    if (sigma.size() == 0) {
      sigma = model.whitened(state.echoes[static_cast<std::size_t>(pose)], state.latents, pose, bin).inverse.inverse();
    }
    double latent = 0;  // gains of the path's actors in the state; a law is fitted with these free
    for (int actor : record.actors) latent += state.latents.actor_gain[errorOf(actor, state.latents.actor_gain.size())];
    const double response = hannResponse(bin - place), all = a.dot(sigma * a).real();
    const double own = gain * std::exp(latent) * channels * record.amplitude * record.amplitude * response * response;
    MeasuredPath path;
    path.share = std::min(1.0, own / all);
    if (path.share < kDominant) continue;
    path.alone = own >= kAlone * sigma.trace().real();
    const double gain_db =
        10 / std::log(10.0) * (std::log(std::norm(a.dot(data.range_spectra.col(bin))) / all) + path.share * latent);
    // The peak's position follows from the ratio of a Hann window's two highest bins.
    const auto height = [&](int k) { return k < 0 || k >= samples ? 0.0 : std::abs(a.dot(data.range_spectra.col(k))); };
    int peak = bin;
    for (int k = bin - 2; k <= bin + 2; ++k) peak = height(k) > height(peak) ? k : peak;
    const int side = height(peak + 1) > height(peak - 1) ? 1 : -1;
    const double ratio = height(peak + side) / std::max(1e-30, height(peak));
    const double apart = peak + side * std::clamp((2 * ratio - 1) / (1 + ratio), -0.5, 0.5) - place;
    if (std::abs(apart) > kFarthest_bins) continue;
    // The direction follows from phases between neighbouring elements, relative to the expected ones.
    double turn = 0, information = 0;
    for (int k = 0; k + 1 < channels; ++k) {
      const double span = wave * (radar.virtual_element_m(k + 1).y() - radar.virtual_element_m(k).y());
      const std::complex<double> step =
          data.range_spectra(k + 1, peak) * std::conj(a[k + 1]) * std::conj(data.range_spectra(k, peak)) * a[k];
      turn -= span * std::abs(step) * std::arg(step);
      information += span * span * std::abs(step);
    }
    const double cosine = std::max(0.2, std::hypot(record.departure.x(), record.departure.z()));
    const double angle_deg = information > 0 ? turn / information / cosine * 180 / M_PI : 0;
    const Eigen::VectorXcd against = data.range_spectra.col(peak).cwiseProduct(a.conjugate());  // with phase errors
    for (const Observable& o : of) {
      const std::complex<double> to_others = o.isOfChannels() ? ratioOf(o.channels, against) : 0;
      switch (o.kind) {
        case Observable::Kind::kGain:
          path.off.push_back(gain_db);
          break;
        case Observable::Kind::kDelay:
          path.off.push_back(apart * radar.range_bin_m());
          break;
        case Observable::Kind::kAngle:
          path.off.push_back(angle_deg);
          break;
        case Observable::Kind::kAngleOfPose:
          path.off.push_back(-state.latents.yaw_rad[static_cast<std::size_t>(pose)] * 180 / M_PI);
          break;
        case Observable::Kind::kChannelGain:
          path.off.push_back(20 * std::log10(std::abs(to_others) + 1e-300));
          break;
        case Observable::Kind::kChannelPhase:
          path.off.push_back(std::arg(to_others) * 180 / M_PI);
          break;
      }
    }
    path.record = std::move(record);
    result.paths.push_back(std::move(path));
  }
  return result;
}

}  // namespace mmradartwin::diagnosis::search
