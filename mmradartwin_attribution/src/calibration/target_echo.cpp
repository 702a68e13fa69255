#include "target_echo.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

double power(const Eigen::MatrixXcd& x, const RadarConfig& radar, double range_m, Eigen::VectorXcd* channels) {
  const double turn = 2 * M_PI * radar.slope_hz_per_s * 2 * range_m / kSpeedOfLight_m_per_s;
  Eigen::VectorXcd tone(x.cols());
  for (Eigen::Index n = 0; n < x.cols(); ++n) {
    tone(n) = std::polar(1.0, -turn * (radar.sample_time_s(static_cast<int>(n)) - radar.window_center_s()));
  }
  const Eigen::VectorXcd sums = x * tone;
  if (channels) *channels = sums;
  return sums.squaredNorm();
}

std::string metres(double value) {
  std::string text = std::to_string(value);
  return text.substr(0, text.size() - 3) + " m";
}

}  // namespace

std::optional<TargetPaths> targetPaths(const RadarConfig& radar, const CalibrationTarget& target,
                                       const Eigen::Isometry3d& T) {
  TargetPaths paths;
  const Eigen::Vector3d from = T.translation();
  if (target.reflector_map_m) {
    const Eigen::Vector3d& p = *target.reflector_map_m;
    paths.range_m = (p - from).norm();
    paths.direction = T.linear().transpose() * (p - from).normalized();
    for (const auto& tx : radar.tx_position_m) {
      for (const auto& rx : radar.rx_position_m) paths.length_m.push_back((p - T * tx).norm() + (p - T * rx).norm());
    }
    return paths;
  }
  const Facet* wall = nullptr;
  for (const Facet& f : target.wall) {
    const double distance = std::abs(f.planeDistance(from));
    const Eigen::Vector3d foot = from - f.planeDistance(from) * f.normal;
    if (!f.contains(foot) || (foot - from).dot(T.linear().col(0)) <= 0) continue;
    if (!wall || distance < std::abs(wall->planeDistance(from))) wall = &f;
  }
  if (!wall || std::abs(wall->planeDistance(from)) < 1e-6) return std::nullopt;
  const double side = wall->planeDistance(from);
  paths.range_m = std::abs(side);
  paths.direction = T.linear().transpose() * (side > 0 ? Eigen::Vector3d(-wall->normal) : wall->normal);
  for (const auto& tx : radar.tx_position_m) {
    for (const auto& rx : radar.rx_position_m) {
      const Eigen::Vector3d r = T * rx;
      paths.length_m.push_back((T * tx - (r - 2 * wall->planeDistance(r) * wall->normal)).norm());  // rx's mirror image
    }
  }
  return paths;
}

Eigen::VectorXcd steering(const RadarConfig& radar, const TargetPaths& paths) {
  const double reference_s = 2 * paths.range_m / kSpeedOfLight_m_per_s;
  Eigen::VectorXcd v(static_cast<Eigen::Index>(paths.length_m.size()));
  for (std::size_t k = 0; k < paths.length_m.size(); ++k) {
    const double tau = paths.length_m[k] / kSpeedOfLight_m_per_s;
    const double frequency = radar.carrier_hz + radar.slope_hz_per_s * radar.window_center_s();
    const double cycles =
        frequency * (tau - reference_s) - 0.5 * radar.slope_hz_per_s * (tau - reference_s) * (tau + reference_s);
    v(static_cast<Eigen::Index>(k)) = std::polar(1.0, 2 * M_PI * cycles);
  }
  return v;
}

void requireClearEcho(const Twin& twin, const CalibrationTarget& target, const Pose& pose,
                      const MountCalibrationOptions& options) {
  if (target.wall.empty()) return;
  const auto paths = targetPaths(twin.radar(), target, pose.T_map_radar);
  if (!paths) return;  // findEcho says so
  const int wall = target.wall.front().actor;
  const Simulation simulation = twin.simulate(pose.T_map_radar, pose.stamp_ns);
  const auto ofWall = [wall](const PathRecord& record) {
    return std::all_of(record.actors.begin(), record.actors.end(), [wall](int actor) { return actor == wall; });
  };
  const PathRecord* echo = nullptr;
  for (const PathRecord& record : simulation.records) {
    if (*record.event != "specular" || record.bounces != 1 || !ofWall(record)) continue;
    if (!echo || record.amplitude > echo->amplitude) echo = &record;
  }
  const std::string here = "pose '" + pose.name + "': ";
  if (!echo) {
    const auto hit = twin.rays().firstHit(pose.T_map_radar.translation(), pose.T_map_radar.linear() * paths->direction,
                                          paths->range_m + 0.01);
    if (!hit || hit->actor < 0 || hit->actor == wall) {
      throw InputError(here + target.name + " sends no echo back by the scene; is the pose right?");
    }
    throw InputError(here + "'" + twin.scene().actors[static_cast<std::size_t>(hit->actor)].name + "' stands before " +
                     target.name + "; take the pose where nothing does");
  }
  // An echo within the main lobe disturbs the phases; a strong one beside it would be taken for the target's.
  const double lobe_m = 2 * twin.radar().range_bin_m();
  std::map<int, double> power;
  for (const PathRecord& record : simulation.records) {
    if (ofWall(record)) continue;
    const double apart_m = std::abs(record.length_m.front() - echo->length_m.front()) / 2;
    if (apart_m > std::max(lobe_m, options.search_m)) continue;
    const double weight = apart_m <= lobe_m ? 1 : std::pow(10, (options.most_other_db - options.most_beside_db) / 10);
    power[record.actors.empty() ? -1 : record.actors.front()] += weight * record.amplitude * record.amplitude;
  }
  double all = 0;
  auto strongest = power.end();
  for (auto it = power.begin(); it != power.end(); ++it) {
    all += it->second;
    if (strongest == power.end() || it->second > strongest->second) strongest = it;
  }
  const double level_db = 10 * std::log10(std::max(all, 1e-300) / (echo->amplitude * echo->amplitude));
  if (level_db <= options.most_other_db) return;
  throw InputError(here + "echoes of " +
                   (strongest->first < 0
                        ? std::string("something else")
                        : "'" + twin.scene().actors[static_cast<std::size_t>(strongest->first)].name + "'") +
                   " reach the radar at the distance of " + target.name +
                   " and cannot be told from its echo; take the pose elsewhere, or with another heading");
}

TargetEcho findEcho(const RadarConfig& radar, const CalibrationTarget& target, const Pose& pose,
                    const ReceiveGrid& grid, const MountCalibrationOptions& options) {
  const auto paths = targetPaths(radar, target, pose.T_map_radar);
  if (!paths) throw InputError("pose '" + pose.name + "': does not face " + target.name);
  const double azimuth = std::atan2(paths->direction.y(), paths->direction.x());
  if (std::abs(azimuth) > options.max_azimuth_rad) {
    throw InputError("pose '" + pose.name + "': holds " + target.name + " " +
                     std::to_string(static_cast<int>(std::lround(azimuth * 180 / M_PI))) +
                     " deg off boresight; turn the radar towards it");
  }
  const double first = std::max(2 * radar.range_bin_m(), paths->range_m - options.search_m);
  const double last = std::min(radar.max_range_m() - 2 * radar.range_bin_m(), paths->range_m + options.search_m);
  if (first >= last) {
    throw InputError("pose '" + pose.name + "': " + target.name + " at " + metres(paths->range_m) +
                     " is outside the ranges that this radar can tell");
  }
  // Every channel's tone is shifted to that of the radar's origin: a channel's own path differs by millimetres.
  const std::vector<double> window = hannWindow(radar.samples_per_chirp);
  Eigen::MatrixXcd x = grid.x;
  for (Eigen::Index k = 0; k < x.rows(); ++k) {
    const double extra_s = (paths->length_m[static_cast<std::size_t>(k)] - 2 * paths->range_m) / kSpeedOfLight_m_per_s;
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      const double t = radar.sample_time_s(static_cast<int>(n)) - radar.window_center_s();
      x(k, n) *= window[static_cast<std::size_t>(n)] * std::polar(1.0, -2 * M_PI * radar.slope_hz_per_s * extra_s * t);
    }
  }
  double best = first, strongest = -1;
  const double step = radar.range_bin_m() / 16;
  for (double r = first; r <= last; r += step) {
    const double p = power(x, radar, r, nullptr);
    if (p > strongest) strongest = p, best = r;
  }
  double low = best - step, high = best + step;
  for (int i = 0; i < 60; ++i) {  // the peak of a window's main lobe is convex
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (power(x, radar, a, nullptr) < power(x, radar, b, nullptr) ? low : high) =
        power(x, radar, a, nullptr) < power(x, radar, b, nullptr) ? a : b;
  }
  TargetEcho echo;
  echo.pose = pose.name;
  echo.T_map_radar = pose.T_map_radar;
  echo.range_m = (low + high) / 2;
  strongest = power(x, radar, echo.range_m, &echo.channels);
  std::vector<double> floor;
  for (int r = 2; r < radar.samples_per_chirp; ++r) floor.push_back(power(x, radar, r * radar.range_bin_m(), nullptr));
  std::nth_element(floor.begin(), floor.begin() + static_cast<long>(floor.size() / 2), floor.end());
  echo.level_db = 10 * std::log10(strongest / std::max(floor[floor.size() / 2], 1e-300));
  const bool at_end = echo.range_m < first + step || echo.range_m > last - step;
  if (!(echo.level_db >= options.min_level_db) || at_end) {
    throw InputError("pose '" + pose.name + "': no echo of " + target.name + " within " + metres(options.search_m) +
                     " of " + metres(paths->range_m) + (at_end ? "; the strongest there is the flank of another" : "") +
                     "; is it in view, and its place right?");
  }
  echo.channels.normalize();
  return echo;
}

}  // namespace mmradartwin
