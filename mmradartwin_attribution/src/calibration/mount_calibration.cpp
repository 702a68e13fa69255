#include "mmradartwin_attribution/mount_calibration.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/csv_reader.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/units.h"
#include "target_echo.h"

namespace mmradartwin {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

enum Index { kYaw, kForward, kLeft, kRange, kFirstPhase };
// Largest standard deviations of a value that is of use for a mount; 95 % intervals may be twice as wide to each side.
constexpr double kMostYaw_rad = 1 * kDegree, kMostOffset_m = 0.02, kMostPhase_rad = 15 * kDegree;
// Least scatter that few poses can show.
constexpr double kLeastRange_m = 3e-4, kLeastHeading_rad = 0.02 * kDegree, kLeastChannel = 2e-3;

/// Standard deviations of one pose's own errors.
struct Scatter {
  double range_m = 0.005;  ///< of the radar's range beside the laser's
  double pose_m = 0.005;   ///< of the pose's distance
  double heading_rad = 0.3 * kDegree;
  double channel = 0.05;  ///< of a channel's real or imaginary part, rms 1
};

struct Observation {
  TargetEcho echo;
  std::optional<double> laser_m;
};

std::string format(const char* text, double a, double b = 0) {
  char line[256];
  std::snprintf(line, sizeof line, text, a, b);
  return line;
}

Eigen::Isometry3d placed(const Eigen::Isometry3d& T, double yaw, double forward, double left) {
  return T * Eigen::Translation3d(forward, left, 0) * Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
}

/// Residuals of all poses over their scatter, for Eigen's Levenberg-Marquardt. Parameters: yaw [rad], forward, left,
/// range [m], phases of channels 1.. [rad], logarithms of their gains.
struct Residuals {
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = MatrixXd;
  enum { InputsAtCompileTime = Eigen::Dynamic, ValuesAtCompileTime = Eigen::Dynamic };

  const RadarConfig& radar;
  const CalibrationTarget& target;
  const std::vector<Observation>& observations;
  Scatter scatter;
  std::vector<int> free;     ///< parameters that are fitted; the others are 0
  bool level_slope = false;  ///< a linear phase over the channels cannot be told from yaw: held at 0

  int channels() const { return radar.channels(); }
  int parameters() const { return kFirstPhase + 2 * (channels() - 1); }
  int rows() const { return 2 + 2 * channels(); }  // per pose
  int inputs() const { return static_cast<int>(free.size()); }
  int values() const { return rows() * static_cast<int>(observations.size()) + 1; }

  VectorXd full(const VectorXd& x) const {
    VectorXd all = VectorXd::Zero(parameters());
    for (std::size_t i = 0; i < free.size(); ++i) all(free[i]) = x(static_cast<Eigen::Index>(i));
    return all;
  }

  /// [2M] measured minus expected channels, the common complex level fitted, times sqrt(M).
  VectorXd channelError(const Observation& o, const VectorXd& p, double turn) const {
    const auto paths = targetPaths(radar, target, placed(o.echo.T_map_radar, p(kYaw) + turn, p(kForward), p(kLeft)));
    const int M = channels();
    VectorXd error = VectorXd::Zero(2 * M);
    if (!paths) return error;
    Eigen::VectorXcd expected = steering(radar, *paths);
    for (int k = 1; k < M; ++k) {
      expected(k) *= std::polar(std::exp(p(kFirstPhase + M - 1 + k - 1)), p(kFirstPhase + k - 1));
    }
    const std::complex<double> level = expected.dot(o.echo.channels) / expected.squaredNorm();
    const Eigen::VectorXcd e = std::sqrt(static_cast<double>(M)) * (o.echo.channels - level * expected);
    error.head(M) = e.real();
    error.tail(M) = e.imag();
    return error;
  }
  VectorXd perTurn(const Observation& o, const VectorXd& p) const {
    constexpr double h = 1e-4;
    return (channelError(o, p, h) - channelError(o, p, -h)) / (2 * h);
  }
  double distance(const Observation& o, const VectorXd& p) const {
    const auto paths = targetPaths(radar, target, placed(o.echo.T_map_radar, p(kYaw), p(kForward), p(kLeft)));
    return paths ? paths->range_m : o.echo.range_m;
  }

  int operator()(const VectorXd& x, VectorXd& r) const {
    const VectorXd p = full(x);
    r = VectorXd::Zero(values());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const Observation& o = observations[i];
      const Eigen::Index at = static_cast<Eigen::Index>(i) * rows();
      const double d = distance(o, p);
      if (o.laser_m) {
        r(at) = (o.echo.range_m - *o.laser_m - p(kRange)) / scatter.range_m;
        r(at + 1) = (*o.laser_m - d) / scatter.pose_m;
      } else {
        r(at) = (o.echo.range_m - p(kRange) - d) / std::hypot(scatter.range_m, scatter.pose_m);
      }
      // White noise of the channels, and a heading error of this pose alone, which turns them together.
      VectorXd e = channelError(o, p, 0);
      const VectorXd a = perTurn(o, p);
      const double norm = a.norm();
      if (norm > 1e-9) {
        const VectorXd unit = a / norm;
        const double shrink = scatter.channel / std::hypot(scatter.channel, scatter.heading_rad * norm);
        e -= (1 - shrink) * unit.dot(e) * unit;
      }
      r.segment(at + 2, 2 * channels()) = e / scatter.channel;
    }
    if (level_slope) {
      double slope = 0, mean_m = 0;
      for (int k = 0; k < channels(); ++k) mean_m += radar.virtual_element_m(k).y() / channels();
      for (int k = 1; k < channels(); ++k) {
        slope += (radar.virtual_element_m(k).y() - mean_m) / radar.virtual_pitch_m() * p(kFirstPhase + k - 1);
      }
      r(values() - 1) = slope / 1e-3;
    }
    return 0;
  }
};

struct Fit {
  VectorXd p;          ///< all parameters
  MatrixXd inverse;    ///< covariance of the free ones
  VectorXd deviation;  ///< of all; infinite where not observable, 0 where held
};

Fit solve(const Residuals& residuals, const VectorXd& start) {
  Eigen::NumericalDiff<Residuals, Eigen::Central> differentiated(residuals);
  VectorXd x(residuals.inputs());
  for (int i = 0; i < residuals.inputs(); ++i) x(i) = start(residuals.free[static_cast<std::size_t>(i)]);
  Eigen::LevenbergMarquardt<Eigen::NumericalDiff<Residuals, Eigen::Central>> solver(differentiated);
  solver.parameters.maxfev = 400;
  solver.minimize(x);
  MatrixXd J(residuals.values(), residuals.inputs());
  differentiated.df(x, J);
  const Eigen::SelfAdjointEigenSolver<MatrixXd> spectrum(J.transpose() * J);
  // A direction that is not seen at all gets a large variance instead of a division by zero.
  const VectorXd variance = spectrum.eigenvalues().cwiseMax(1e-4).cwiseInverse();
  Fit fit;
  fit.p = residuals.full(x);
  fit.inverse = spectrum.eigenvectors() * variance.asDiagonal() * spectrum.eigenvectors().transpose();
  fit.deviation = VectorXd::Zero(residuals.parameters());
  for (int i = 0; i < residuals.inputs(); ++i) {
    fit.deviation(residuals.free[static_cast<std::size_t>(i)]) = std::sqrt(fit.inverse(i, i));
  }
  return fit;
}

/// The poses' own errors from what the fit leaves.
Scatter scatterOf(const Residuals& residuals, const VectorXd& p, bool lasers) {
  const double poses = static_cast<double>(residuals.observations.size());
  double range2 = 0, pose2 = 0, heading2 = 0, channel2 = 0;
  int with_laser = 0;
  for (const Observation& o : residuals.observations) {
    const double d = residuals.distance(o, p);
    if (o.laser_m) {
      range2 += std::pow(o.echo.range_m - *o.laser_m - p(kRange), 2);
      pose2 += std::pow(*o.laser_m - d, 2);
      ++with_laser;
    } else {
      pose2 += std::pow(o.echo.range_m - p(kRange) - d, 2);
    }
    VectorXd e = residuals.channelError(o, p, 0);
    const VectorXd a = residuals.perTurn(o, p);
    const double turn = a.squaredNorm() > 0 ? a.dot(e) / a.squaredNorm() : 0;
    heading2 += turn * turn;
    channel2 += (e - turn * a).squaredNorm();
  }
  const int geometry = lasers ? 2 : 3;  // forward and left, and the range bias where no laser gives it
  const double phases = 2 * residuals.channels() - 2;
  Scatter scatter;
  scatter.pose_m = std::max(kLeastRange_m, std::sqrt(pose2 / std::max(1.0, poses - geometry)));
  scatter.range_m = with_laser > 1 ? std::max(kLeastRange_m, std::sqrt(range2 / (with_laser - 1))) : kLeastRange_m;
  scatter.heading_rad = std::max(kLeastHeading_rad, std::sqrt(heading2 / std::max(1.0, poses - 1)));
  // A pose has 2M numbers; its complex level takes two of them and its heading one.
  scatter.channel = std::max(kLeastChannel, std::sqrt(channel2 / std::max(1.0, poses * (phases - 1) - phases)));
  return scatter;
}

double coarseYaw(const Residuals& residuals, const MountCalibrationOptions& options) {
  double best = 0, score = -1;
  for (double yaw = -options.search_rad; yaw <= options.search_rad + 1e-9; yaw += 0.5 * kDegree) {
    double sum = 0;
    for (const Observation& o : residuals.observations) {
      const auto paths = targetPaths(residuals.radar, residuals.target, placed(o.echo.T_map_radar, yaw, 0, 0));
      if (paths) sum += std::norm(steering(residuals.radar, *paths).dot(o.echo.channels));
    }
    if (sum > score) score = sum, best = yaw;
  }
  return best;
}

/// Throws InputError where one pose contradicts its laser distance. The part of the differences that all poses share is
/// the mount's offset and no contradiction.
void checkLasers(const Residuals& residuals, const MountCalibrationOptions& options) {
  std::vector<const Observation*> with;
  for (const Observation& o : residuals.observations) {
    if (o.laser_m) with.push_back(&o);
  }
  if (with.empty()) return;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();  // forward, left: least absolute differences, by reweighting
  const auto difference = [&](const Observation& o) {
    VectorXd p = VectorXd::Zero(residuals.parameters());
    p(kForward) = offset.x(), p(kLeft) = offset.y();
    return *o.laser_m - residuals.distance(o, p);
  };
  if (with.size() >= 4) {
    for (int i = 0; i < 40; ++i) {
      Eigen::Matrix2d H = 1e-3 * Eigen::Matrix2d::Identity();
      Eigen::Vector2d g = Eigen::Vector2d::Zero();
      for (const Observation* o : with) {
        const auto paths =
            targetPaths(residuals.radar, residuals.target, placed(o->echo.T_map_radar, 0, offset.x(), offset.y()));
        if (!paths) continue;
        const Eigen::Vector2d J = -paths->direction.head<2>();
        const double r = difference(*o), weight = 1 / std::max(std::abs(r), 1e-3);
        H += weight * J * J.transpose();
        g += weight * r * J;
      }
      offset.head<2>() += H.ldlt().solve(g);
    }
  }
  const double limit_m = with.size() >= 4 ? options.max_laser_error_m : 0.1 + options.max_laser_error_m;
  const Observation* worst = *std::max_element(with.begin(), with.end(), [&](const auto* a, const auto* b) {
    return std::abs(difference(*a)) < std::abs(difference(*b));
  });
  if (std::abs(difference(*worst)) <= limit_m) return;
  std::ostringstream text;
  text.precision(3);
  text << std::fixed << "pose '" << worst->echo.pose << "': the laser says " << *worst->laser_m << " m to "
       << residuals.target.name << ", the pose " << *worst->laser_m - difference(*worst)
       << " m; measure again, or correct the pose or the target's place";
  throw InputError(text.str());
}

std::map<std::string, double> laserByPose(const Recording& recording, const std::vector<LaserDistance>& lasers) {
  std::map<std::string, double> laser_of;
  for (const LaserDistance& laser : lasers) {
    if (std::find(recording.pose_names.begin(), recording.pose_names.end(), laser.pose) == recording.pose_names.end()) {
      throw InputError("the laser's distances name pose '" + laser.pose + "', which " + recording.source + " has not");
    }
    laser_of[laser.pose] = laser.distance_m;
  }
  return laser_of;
}

void requireEnough(const Recording& recording, const CalibrationTarget& target,
                   const std::vector<Observation>& observations, const std::vector<PoseProblem>& problems) {
  if (observations.size() >= 3) return;
  throw InputError(recording.source + ": " + std::to_string(observations.size()) + " of " +
                   std::to_string(recording.poses.size()) + " poses show " + target.name +
                   "; a calibration needs three or more, at several angles" +
                   (problems.empty() ? "" : ". First problem: " + problems.front().message));
}

/// Fit of all that the poses fix; what they do not fix is held at 0, with a note.
struct MountFit {
  MountFit(const RadarConfig& radar, const CalibrationTarget& target, const std::vector<Observation>& observations)
      : residuals{radar, target, observations, {}, {}, false} {
    for (int i = 0; i < residuals.parameters(); ++i) residuals.free.push_back(i);
    lasers = std::any_of(observations.begin(), observations.end(), [](const auto& o) { return o.laser_m.has_value(); });
  }

  void run(const MountCalibrationOptions& options) {
    VectorXd start = VectorXd::Zero(residuals.parameters());
    start(kYaw) = coarseYaw(residuals, options);
    fit = solve(residuals, start);
    refine();
    if (fit.deviation(kForward) > kMostOffset_m || fit.deviation(kRange) > kMostOffset_m) {
      forward_held = true;
      hold(kForward,
           "forward_m cannot be told from range_bias with these poses and is held at 0: take poses that hold the "
           "target up to 40 deg off boresight on both sides, or laser distances");
    }
    if (fit.deviation(kLeft) > kMostOffset_m) {
      left_held = true;
      hold(kLeft, "left_m is not fixed by these poses and is held at 0: take poses that hold the target off boresight");
    }
    const int M = residuals.channels();
    if (fit.deviation(kYaw) > kMostYaw_rad || fit.deviation.segment(kFirstPhase, M - 1).maxCoeff() > kMostPhase_rad) {
      notes.push_back(
          "a phase that grows evenly over the channels cannot be told from yaw with these poses and "
          "counts as yaw: take poses that hold the target off boresight on both sides");
      residuals.level_slope = true;
      fit = solve(residuals, fit.p);
      refine();
    }
    notes.push_back("height, pitch and roll of the mount are not observable with an array along one line");
  }

  Residuals residuals;
  bool lasers = false, forward_held = false, left_held = false;
  Fit fit;
  std::vector<std::string> notes;

 private:
  /// Fits again and again with the scatter that the last fit left.
  void refine() {
    for (int i = 0; i < 4; ++i) {
      residuals.scatter = scatterOf(residuals, fit.p, lasers);
      fit = solve(residuals, fit.p);
    }
  }
  void hold(int parameter, const std::string& why) {
    residuals.free.erase(std::remove(residuals.free.begin(), residuals.free.end(), parameter), residuals.free.end());
    notes.push_back(why);
    VectorXd start = fit.p;
    start(parameter) = 0;
    fit = solve(residuals, start);
    refine();
  }
};

/// Why yaw or channels are not fixed, and what would fix them.
std::string undeterminedBecause(const MountFit& mount, bool yaw, bool channels) {
  const Residuals& residuals = mount.residuals;
  const std::string what = yaw ? "channel errors" : channels ? "yaw" : "neither yaw nor channel errors";
  return residuals.target.name + (yaw || channels ? " does not determine " : " determines ") + what +
         format(
             ": from pose to pose its echo's direction scatters by %.1f deg and its channels by "
             "%.0f %%, ",
             residuals.scatter.heading_rad / kDegree, 100 * residuals.scatter.channel) +
         "and there are " + std::to_string(residuals.observations.size()) + " poses of it" +
         (residuals.target.wall.empty() ? "; take more poses, of a larger or nearer reflector"
                                        : "; rough walls (concrete, plaster) do that: hold the radar before a "
                                          "metal board or a corner reflector, or take many more poses");
}

/// Fills the values with their intervals (Student's t) and `undetermined`. Returns the parameters that correct the
/// poses: those that are not fixed are 0.
VectorXd fillValues(const MountFit& mount, MountCalibration& result) {
  const Fit& fit = mount.fit;
  const int M = mount.residuals.channels();
  const double freedom = std::max(1.0, static_cast<double>(mount.residuals.observations.size()) - 3);
  const double t = boost::math::quantile(boost::math::students_t(freedom), 0.975);
  const auto fixed = [&](int parameter, double most) { return t * fit.deviation(parameter) <= 2 * most; };
  const bool yaw = fixed(kYaw, kMostYaw_rad);
  bool channels = true;
  for (int k = 1; k < M; ++k) channels = channels && fixed(kFirstPhase + k - 1, kMostPhase_rad);
  VectorXd used = fit.p;
  const auto value = [&](const char* name, const char* unit, int parameter, double factor, bool held, bool observable) {
    CalibratedValue v;
    v.name = name, v.unit = unit, v.observable = observable && !held;
    v.value = factor * fit.p(parameter);
    const double half = t * factor * fit.deviation(parameter);
    v.ci95 = {v.value - half, v.value + half};
    if (v.observable) return v;
    v.note =
        held ? "not observable with these poses, held at 0"
             : "not fixed by these poses, 95 %: " + format("%.3g to %.3g ", v.ci95[0], v.ci95[1]) + unit + "; not used";
    used(parameter) = v.value = 0;
    return v;
  };
  result.yaw_deg = value("yaw_deg", "deg", kYaw, 1 / kDegree, false, yaw);
  result.forward_m = value("forward_m", "m", kForward, 1, mount.forward_held, fixed(kForward, kMostOffset_m));
  result.left_m = value("left_m", "m", kLeft, 1, mount.left_held, fixed(kLeft, kMostOffset_m));
  result.range_m = value("range_m", "m", kRange, 1, false, fixed(kRange, kMostOffset_m));
  CalibratedValue zero;
  zero.name = "phase_deg", zero.unit = "deg", zero.note = "the reference";
  result.phase_deg.push_back(zero);
  zero.name = "gain_db", zero.unit = "dB";
  result.gain_db.push_back(zero);
  for (int k = 1; k < M; ++k) {
    result.phase_deg.push_back(value("phase_deg", "deg", kFirstPhase + k - 1, 1 / kDegree, false, channels));
    result.gain_db.push_back(value("gain_db", "dB", kFirstPhase + M - 1 + k - 1, 20 / std::log(10.0), false, channels));
  }
  if (!yaw || !channels) result.undetermined = undeterminedBecause(mount, yaw, channels);
  return used;
}

void fillErrors(const Residuals& residuals, const VectorXd& p, int after, const Observation& o, CalibratedPose& pose) {
  const auto paths =
      targetPaths(residuals.radar, residuals.target, placed(o.echo.T_map_radar, p(kYaw), p(kForward), p(kLeft)));
  if (!paths) return;
  pose.azimuth_deg = std::atan2(paths->direction.y(), paths->direction.x()) / kDegree;
  pose.range_error_m[after] = o.echo.range_m - p(kRange) - paths->range_m;
  // The heading that would explain the channels, best by the array's answer alone.
  double best = 0, score = -1;
  for (double turn = -15; turn <= 15; turn += 0.02) {
    const double error = residuals.channelError(o, p, turn * kDegree).squaredNorm();
    if (score < 0 || error < score) score = error, best = turn;
  }
  pose.azimuth_error_deg[after] = -best;  // a radar turned to the left sees the target further to the right
  Eigen::VectorXcd against = o.echo.channels.cwiseProduct(steering(residuals.radar, *paths).conjugate());
  const int M = residuals.channels();
  for (int k = 1; k < M; ++k) against(k) *= std::polar(1.0, -p(kFirstPhase + k - 1));
  const std::complex<double> mean = against.sum();
  pose.channel_error_deg[after].clear();
  for (int k = 0; k < M; ++k) pose.channel_error_deg[after].push_back(std::arg(against(k) * std::conj(mean)) / kDegree);
}

}  // namespace

std::vector<LaserDistance> readLaserDistances(const std::string& file) {
  requireRegularFile(file);
  std::ifstream in(file);
  if (!in) throw InputError(file + ": cannot be read; give a CSV file pose,distance_m");
  std::ostringstream text;
  text << in.rdbuf();
  CsvReader reader(text.str(), file);
  reader.requireColumns("pose,distance_m");
  std::vector<LaserDistance> distances;
  std::set<std::string> seen;
  while (reader.next()) {
    const std::string& pose = reader.fields()[0];
    const double distance_m = reader.number(1);
    if (!(distance_m > 0 && distance_m < 1000)) {
      throw reader.error("distance_m " + reader.fields()[1] + " is no distance of 0 to 1000 m");
    }
    if (!seen.insert(pose).second) throw reader.error("pose '" + pose + "' stands twice");
    distances.push_back({pose, distance_m});
  }
  return distances;
}

MountCalibration calibrateMount(const Recording& recording, const CalibrationTarget& target,
                                const std::vector<LaserDistance>& lasers, const MountCalibrationOptions& options,
                                const Twin* twin, const std::function<void(int)>& progress) {
  MountCalibration result;
  const std::map<std::string, double> laser_of = laserByPose(recording, lasers);
  result.problems = recording.problems;
  std::vector<Observation> observations;
  int done = 0;
  for (const Pose& pose : recording.poses) {
    CalibratedPose entry;
    entry.name = pose.name;
    try {
      if (twin) requireClearEcho(*twin, target, pose, options);
      Observation o{findEcho(recording.radar, target, pose, averagePose(recording, pose), options), {}};
      if (const auto it = laser_of.find(pose.name); it != laser_of.end()) o.laser_m = it->second;
      entry.used = true;
      entry.range_m = o.echo.range_m;
      entry.level_db = o.echo.level_db;
      observations.push_back(o);
    } catch (const InputError& error) {
      entry.why_not = error.what();
      result.problems.push_back({pose.name, error.what()});
    }
    result.poses.push_back(entry);
    if (progress) progress(++done);
  }
  requireEnough(recording, target, observations, result.problems);
  MountFit mount(recording.radar, target, observations);
  checkLasers(mount.residuals, options);
  mount.run(options);
  result.lasers = mount.lasers;
  result.notes = mount.notes;
  const VectorXd corrected = fillValues(mount, result);
  const VectorXd uncorrected = VectorXd::Zero(mount.residuals.parameters());
  std::size_t next = 0;
  for (CalibratedPose& pose : result.poses) {
    if (!pose.used) continue;
    fillErrors(mount.residuals, uncorrected, 0, observations[next], pose);
    fillErrors(mount.residuals, corrected, 1, observations[next], pose);
    ++next;
  }
  return result;
}

Eigen::Isometry3d correctedMount(const MountCalibration& c, const Eigen::Isometry3d& T_camera_radar) {
  return placed(T_camera_radar, c.yaw_deg.value * kDegree, c.forward_m.value, c.left_m.value);
}

}  // namespace mmradartwin
