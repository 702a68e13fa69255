#include "diagnosis/likelihood/clutter_field.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <cmath>

#include "diagnosis/echoes/echo_field.h"
#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin::diagnosis::likelihood {
namespace {

constexpr double kGrid_m = 0.2;                              ///< spacing of the things in the floor plan
constexpr double kHeights_m[] = {-0.6, 0.0, 0.6};            ///< heights of the things relative to the radar
constexpr double kNearest_m = 0.3;                           ///< least distance of the things from the radar
constexpr double kElsewhereShare = 0.05;                     ///< share of the power at kReference_m that has no place
constexpr double kReference_m = 3, kReferenceWidth_m = 0.5;  ///< range where the mean power is 1, and half its width

}  // namespace

void expectClutter(const Scene& scene, ChannelData& data) {
  Eigen::AlignedBox3d room;
  for (const Actor& a : scene.actors) room.extend(a.bounds);
  const RadarConfig& radar = data.radar;
  const int channels = radar.channels(), bins = radar.samples_per_chirp;
  const std::size_t size = static_cast<std::size_t>(channels) * (channels + 1) / 2;
  const double wave = 2 * M_PI / radar.wavelength_m();
  tbb::parallel_for(std::size_t{0}, data.poses.size(), [&](std::size_t i) {
    PoseChannels& pose = data.poses[i];
    BinCovariance& field = pose.clutter;
    field.first = 0;
    field.bins = bins;
    field.packed.assign(static_cast<std::size_t>(bins) * size, {});
    const Eigen::Isometry3d T_radar_map = pose.pose.T_map_radar.inverse();
    std::vector<std::complex<double>> steering(static_cast<std::size_t>(channels));
    for (double x = room.min().x() + 0.5 * kGrid_m; x < room.max().x(); x += kGrid_m) {
      for (double y = room.min().y() + 0.5 * kGrid_m; y < room.max().y(); y += kGrid_m) {
        for (double height_m : kHeights_m) {
          Eigen::Vector3d p(x, y, pose.pose.T_map_radar.translation().z() + height_m);
          p = T_radar_map * p;
          const double r = p.norm();
          if (r < kNearest_m || !inFieldOfView(p)) continue;
          const double place = r / radar.range_bin_m(), power = std::pow(r / kReference_m, -4);
          for (int k = 0; k < channels; ++k) {
            steering[static_cast<std::size_t>(k)] = std::polar(1.0, -wave * radar.virtual_element_m(k).y() * p.y() / r);
          }
          const int middle = static_cast<int>(std::lround(place));
          for (int b = std::max(0, middle - 2); b <= std::min(bins - 1, middle + 2); ++b) {
            const double w = hannResponse(b - place);
            std::complex<float>* to = field.at(b, size);
            for (int k = 0; k < channels; ++k) {
              for (int l = 0; l <= k; ++l) {
                *to++ += std::complex<float>(power * w * w * steering[static_cast<std::size_t>(k)] *
                                             std::conj(steering[static_cast<std::size_t>(l)]));
              }
            }
          }
        }
      }
    }
  });
  // Mean power over the session by bin, equal for all channels.
  std::vector<double> mean(static_cast<std::size_t>(bins), 0.0);
  for (const PoseChannels& p : data.poses) {
    for (int b = 0; b < bins; ++b) {
      mean[static_cast<std::size_t>(b)] += p.clutter.at(b, size)[0].real() / static_cast<double>(data.poses.size());
    }
  }
  double reference = 0, count = 0, all = 0;
  for (int b = 0; b < bins; ++b) {
    all += mean[static_cast<std::size_t>(b)] / bins;
    if (std::abs(b * radar.range_bin_m() - kReference_m) > kReferenceWidth_m) continue;
    reference += mean[static_cast<std::size_t>(b)];
    ++count;
  }
  reference = count > 0 && reference > 0 ? reference / count : all;
  if (!(reference > 0)) reference = 1;
  for (PoseChannels& p : data.poses) {
    for (int b = 0; b < bins; ++b) {
      std::complex<float>* packed = p.clutter.at(b, size);
      for (std::size_t j = 0; j < size; ++j) packed[j] *= static_cast<float>(1 / reference);
      const double range_m = std::max(kNearest_m, b * radar.range_bin_m());
      const double elsewhere = kElsewhereShare * std::pow(range_m / kReference_m, -3);
      for (int k = 0; k < channels; ++k) {
        packed[static_cast<std::size_t>(k) * (k + 3) / 2] += static_cast<float>(elsewhere);
      }
    }
  }
}

}  // namespace mmradartwin::diagnosis::likelihood
