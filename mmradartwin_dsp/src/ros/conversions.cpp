#include "mmradartwin_dsp/ros/conversions.h"

#include <ros/serialization.h>

#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/sha256.h"

namespace mmradartwin {
namespace {

std::vector<geometry_msgs::Point> toPoints(const std::vector<Eigen::Vector3d>& positions) {
  std::vector<geometry_msgs::Point> points(positions.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    points[i].x = positions[i].x();
    points[i].y = positions[i].y();
    points[i].z = positions[i].z();
  }
  return points;
}

std::vector<Eigen::Vector3d> fromPoints(const std::vector<geometry_msgs::Point>& points) {
  std::vector<Eigen::Vector3d> positions;
  for (const geometry_msgs::Point& point : points) positions.emplace_back(point.x, point.y, point.z);
  return positions;
}

void requireSize(const char* message, const char* field, std::size_t found, std::uint64_t expected) {
  if (found == expected) return;
  throw InputError(std::string(message) + ": field " + field + " has " + std::to_string(found) +
                   " entries; its shape says " + std::to_string(expected));
}

/// Sizes multiply without overflow below this, and no radar comes near.
void requirePlausible(const char* message, std::uint32_t a, std::uint32_t b, std::uint32_t c = 1) {
  if (a <= 1u << 20 && b <= 1u << 20 && c <= 1u << 10) return;
  throw InputError(std::string(message) + ": its shape is implausibly large");
}

Branch toBranch(const char* message, std::uint8_t source) {
  if (source > mmradartwin_msgs::ReceiveGrid::SIMULATED) {
    throw InputError(std::string(message) + ": field source is " + std::to_string(source) +
                     "; allowed: 0 (measured), 1 (simulated)");
  }
  return static_cast<Branch>(source);
}

}  // namespace

ros::Time toRosTime(std::int64_t stamp_ns) {
  ros::Time time;
  time.fromNSec(static_cast<std::uint64_t>(stamp_ns));
  return time;
}

bool usableStamp(const ros::Time& stamp) { return stamp.sec < (1u << 31); }

std::int64_t toNanoseconds(const ros::Time& stamp) { return static_cast<std::int64_t>(stamp.toNSec()); }

geometry_msgs::Pose toMsg(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  geometry_msgs::Pose pose;
  pose.position.x = T.translation().x();
  pose.position.y = T.translation().y();
  pose.position.z = T.translation().z();
  pose.orientation.x = q.x();
  pose.orientation.y = q.y();
  pose.orientation.z = q.z();
  pose.orientation.w = q.w();
  return pose;
}

Eigen::Isometry3d fromMsg(const geometry_msgs::Pose& pose) {
  const Eigen::Vector3d p(pose.position.x, pose.position.y, pose.position.z);
  const Eigen::Quaterniond q(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z);
  if (!p.allFinite() || !(std::abs(q.norm() - 1) < 1e-3)) {
    throw InputError("pose: position is not finite or the quaternion's norm is not 1");
  }
  return Eigen::Translation3d(p) * q.normalized();
}

Eigen::Isometry3d fromMsg(const geometry_msgs::Transform& transform) {
  const auto& p = transform.translation;
  const auto& q = transform.rotation;
  return Eigen::Translation3d(p.x, p.y, p.z) * Eigen::Quaterniond(q.w, q.x, q.y, q.z).normalized();
}

mmradartwin_msgs::RadarConfig toMsg(const RadarConfig& radar) {
  mmradartwin_msgs::RadarConfig msg;
  msg.device = radar.device;
  msg.carrier_hz = radar.carrier_hz;
  msg.slope_hz_per_s = radar.slope_hz_per_s;
  msg.samples_per_chirp = static_cast<std::uint32_t>(radar.samples_per_chirp);
  msg.sample_rate_hz = radar.sample_rate_hz;
  msg.adc_start_s = radar.adc_start_s;
  msg.loops_per_frame = static_cast<std::uint32_t>(radar.loops_per_frame);
  msg.frame_period_s = radar.frame_period_s;
  msg.tx_position_m = toPoints(radar.tx_position_m);
  msg.rx_position_m = toPoints(radar.rx_position_m);
  msg.layout = radar.layout == CaptureLayout::kTwoLane ? "2lane" : "4lane";
  msg.iq_order = radar.iq_order == IqOrder::kQi ? "qi" : "iq";
  // One NaN, bit for bit, or equal configurations would hash differently.
  const auto canonical = [](double value) {
    return std::isnan(value) ? std::numeric_limits<double>::quiet_NaN() : value;
  };
  msg.idle_s = canonical(radar.idle_s);
  msg.ramp_end_s = canonical(radar.ramp_end_s);
  msg.rx_gain_db = canonical(radar.rx_gain_db);
  msg.tx_backoff_db = canonical(radar.tx_backoff_db);
  msg.if_highpass_hz = radar.if_highpass_hz;
  for (const std::vector<int>& slot : radar.tx_enable) {
    std::uint32_t mask = 0;
    for (const int tx : slot) mask |= 1u << tx;
    msg.tx_enable.push_back(mask);
  }
  msg.rx_enable.assign(radar.rx_enable.begin(), radar.rx_enable.end());
  return msg;
}

RadarConfig fromMsg(const mmradartwin_msgs::RadarConfig& msg) {
  requirePlausible("radar/config", msg.samples_per_chirp, msg.loops_per_frame);
  if (msg.layout != "4lane" && msg.layout != "2lane") {
    throw InputError("radar/config: field layout is '" + msg.layout + "'; allowed: 4lane, 2lane");
  }
  if (msg.iq_order != "iq" && msg.iq_order != "qi") {
    throw InputError("radar/config: field iq_order is '" + msg.iq_order + "'; allowed: iq, qi");
  }
  RadarConfig radar;
  radar.device = msg.device;
  radar.carrier_hz = msg.carrier_hz;
  radar.slope_hz_per_s = msg.slope_hz_per_s;
  radar.samples_per_chirp = static_cast<int>(msg.samples_per_chirp);
  radar.sample_rate_hz = msg.sample_rate_hz;
  radar.adc_start_s = msg.adc_start_s;
  radar.loops_per_frame = static_cast<int>(msg.loops_per_frame);
  radar.frame_period_s = msg.frame_period_s;
  radar.tx_position_m = fromPoints(msg.tx_position_m);
  radar.rx_position_m = fromPoints(msg.rx_position_m);
  radar.layout = msg.layout == "2lane" ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  radar.iq_order = msg.iq_order == "qi" ? IqOrder::kQi : IqOrder::kIq;
  radar.idle_s = msg.idle_s;
  radar.ramp_end_s = msg.ramp_end_s;
  radar.rx_gain_db = msg.rx_gain_db;
  radar.tx_backoff_db = msg.tx_backoff_db;
  radar.if_highpass_hz = msg.if_highpass_hz;
  for (const std::uint32_t mask : msg.tx_enable) {
    radar.tx_enable.emplace_back();
    for (int tx = 0; tx < 32; ++tx) {
      if (mask >> tx & 1u) radar.tx_enable.back().push_back(tx);
    }
  }
  radar.rx_enable.assign(msg.rx_enable.begin(), msg.rx_enable.end());
  // The message has no field for angle_slots: where not all slots are on a line, those that make the longest are taken.
  if (radar.slots() > 1) {
    const std::vector<int> line = radar.slotsOnALine();
    if (static_cast<int>(line.size()) < radar.slots()) radar.angle_slots = line;
  }
  // A message is held to the same ranges as the file.
  return parseRadarConfig(toYaml(radar), "radar/config");
}

std::uint64_t radarHash(const mmradartwin_msgs::RadarConfig& msg) {
  mmradartwin_msgs::RadarConfig bare = msg;
  bare.header = std_msgs::Header();
  std::vector<std::uint8_t> bytes(ros::serialization::serializationLength(bare));
  ros::serialization::OStream stream(bytes.data(), static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, bare);
  Sha256 sha256;
  sha256.add(bytes.data(), bytes.size());
  const Sha256::Digest digest = sha256.digest();
  std::uint64_t hash = 0;
  for (int i = 7; i >= 0; --i) hash = hash << 8 | digest[i];
  return hash;
}

std::uint64_t radarHash(const RadarConfig& radar) { return radarHash(toMsg(radar)); }

mmradartwin_msgs::AdcCube toMsg(const AdcCube& cube, std::uint64_t radar_hash) {
  mmradartwin_msgs::AdcCube msg;
  msg.header.stamp = toRosTime(cube.stamp_ns);
  msg.radar_hash = radar_hash;
  msg.sequence = cube.sequence;
  msg.chirps = static_cast<std::uint32_t>(cube.chirps);
  msg.samples_per_chirp = static_cast<std::uint32_t>(cube.samples);
  msg.receivers = static_cast<std::uint32_t>(cube.receivers);
  msg.samples = cube.data;
  msg.chirp_valid = cube.chirp_valid;
  msg.lost_bytes = cube.lost_bytes;
  return msg;
}

AdcCube fromMsg(const mmradartwin_msgs::AdcCube& msg) {
  requirePlausible("AdcCube", msg.chirps, msg.samples_per_chirp, msg.receivers);
  requireSize("AdcCube", "samples", msg.samples.size(), 2ull * msg.chirps * msg.samples_per_chirp * msg.receivers);
  requireSize("AdcCube", "chirp_valid", msg.chirp_valid.size(), msg.chirps);
  AdcCube cube;
  cube.stamp_ns = toNanoseconds(msg.header.stamp);
  cube.sequence = msg.sequence;
  cube.chirps = static_cast<int>(msg.chirps);
  cube.samples = static_cast<int>(msg.samples_per_chirp);
  cube.receivers = static_cast<int>(msg.receivers);
  cube.data = msg.samples;
  cube.chirp_valid = msg.chirp_valid;
  cube.lost_bytes = msg.lost_bytes;
  return cube;
}

mmradartwin_msgs::ReceiveGrid toMsg(const ReceiveGrid& grid, std::uint64_t radar_hash) {
  mmradartwin_msgs::ReceiveGrid msg;
  msg.header.stamp = toRosTime(grid.stamp_ns);
  msg.radar_hash = radar_hash;
  msg.source = static_cast<std::uint8_t>(grid.source);
  msg.channels = static_cast<std::uint32_t>(grid.x.rows());
  msg.samples = static_cast<std::uint32_t>(grid.x.cols());
  const double* values = reinterpret_cast<const double*>(grid.x.data());
  msg.data.assign(values, values + 2 * grid.x.size());
  msg.full_scale = grid.full_scale;
  msg.frames = static_cast<std::uint32_t>(grid.frames);
  msg.pose_valid = grid.pose_valid;
  msg.T_map_radar = toMsg(grid.T_map_radar);
  return msg;
}

ReceiveGrid fromMsg(const mmradartwin_msgs::ReceiveGrid& msg) {
  requirePlausible("ReceiveGrid", msg.channels, msg.samples);
  requireSize("ReceiveGrid", "data", msg.data.size(), 2ull * msg.channels * msg.samples);
  if (!(std::isfinite(msg.full_scale) && msg.full_scale > 0)) {
    throw InputError("ReceiveGrid: field full_scale is " + std::to_string(msg.full_scale) + "; it must be positive");
  }
  ReceiveGrid grid;
  grid.stamp_ns = toNanoseconds(msg.header.stamp);
  grid.source = toBranch("ReceiveGrid", msg.source);
  grid.x = Eigen::Map<const ComplexGrid>(reinterpret_cast<const std::complex<double>*>(msg.data.data()), msg.channels,
                                         msg.samples);
  if (!grid.x.allFinite()) throw InputError("ReceiveGrid: field data holds values that are not finite");
  grid.full_scale = msg.full_scale;
  grid.frames = static_cast<int>(msg.frames);
  grid.pose_valid = msg.pose_valid;
  if (msg.pose_valid) grid.T_map_radar = fromMsg(msg.T_map_radar);
  return grid;
}

mmradartwin_msgs::RangeAngleMap toMsg(const RangeAngleMap& map, std::uint64_t radar_hash) {
  mmradartwin_msgs::RangeAngleMap msg;
  msg.header.stamp = toRosTime(map.stamp_ns);
  msg.radar_hash = radar_hash;
  msg.source = static_cast<std::uint8_t>(map.source);
  msg.range_m = map.axes.range_m;
  msg.azimuth_rad = map.axes.azimuth_rad;
  msg.power_db.assign(map.power_db.data(), map.power_db.data() + map.power_db.size());
  msg.frames = static_cast<std::uint32_t>(map.frames);
  msg.pose_valid = map.pose_valid;
  msg.T_map_radar = toMsg(map.T_map_radar);
  return msg;
}

RangeAngleMap fromMsg(const mmradartwin_msgs::RangeAngleMap& msg) {
  requireSize("RangeAngleMap", "power_db", msg.power_db.size(), msg.range_m.size() * msg.azimuth_rad.size());
  RangeAngleMap map;
  map.stamp_ns = toNanoseconds(msg.header.stamp);
  map.source = toBranch("RangeAngleMap", msg.source);
  map.axes.range_m = msg.range_m;
  map.axes.azimuth_rad = msg.azimuth_rad;
  using FloatGrid = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  map.power_db = Eigen::Map<const FloatGrid>(msg.power_db.data(), static_cast<Eigen::Index>(msg.range_m.size()),
                                             static_cast<Eigen::Index>(msg.azimuth_rad.size()))
                     .cast<double>();
  map.frames = static_cast<int>(msg.frames);
  map.pose_valid = msg.pose_valid;
  if (msg.pose_valid) map.T_map_radar = fromMsg(msg.T_map_radar);
  return map;
}

mmradartwin_msgs::SessionFile toMsg(const StoredFile& file) {
  mmradartwin_msgs::SessionFile msg;
  msg.name = file.name;
  msg.data.assign(file.bytes.begin(), file.bytes.end());
  return msg;
}

std::vector<StoredFile> storedFiles(const mmradartwin_msgs::Session& session) {
  std::vector<StoredFile> files;
  for (const mmradartwin_msgs::SessionFile& f : session.files) {
    files.push_back({f.name, std::string(f.data.begin(), f.data.end())});
  }
  return files;
}

}  // namespace mmradartwin
