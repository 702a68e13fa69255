#include "mmradartwin_dsp/ros/point_cloud.h"

#include <sensor_msgs/point_cloud2_iterator.h>

#include <cmath>
#include <limits>

#include "mmradartwin_dsp/detection_agreement.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

CfarKind cfarKindFrom(const std::string& name) {
  if (name == "ca") return CfarKind::kCellAveraging;
  if (name == "os") return CfarKind::kOrderedStatistic;
  throw InputError("parameter cfar_kind: '" + name + "' is unknown; allowed: ca, os");
}

using ReadField = sensor_msgs::PointCloud2ConstIterator<float>;

ReadField fieldOf(const sensor_msgs::PointCloud2& cloud, const std::string& name) {
  for (const sensor_msgs::PointField& field : cloud.fields) {
    if (field.name != name) continue;
    if (field.datatype == sensor_msgs::PointField::FLOAT32 && cloud.point_step >= sizeof(float) &&
        field.offset <= cloud.point_step - sizeof(float) && cloud.data.size() % cloud.point_step == 0) {
      return ReadField(cloud, name);
    }
    throw InputError("points: field " + name + " is no float32 of each point");
  }
  throw InputError("points: field " + name + " is missing");
}

/// Bin whose centre lies nearest; what is NaN is none's.
int nearestBin(const std::vector<double>& centers, double value) {
  double nearest = std::numeric_limits<double>::infinity();
  int bin = 0;
  for (std::size_t i = 0; i < centers.size(); ++i) {
    const double away = std::abs(centers[i] - value);
    if (away < nearest) nearest = away, bin = static_cast<int>(i);
  }
  return bin;
}

}  // namespace

CfarSettings readCfarSettings(StrictParameters& parameters) {
  CfarSettings cfar;
  cfar.kind = cfarKindFrom(
      parameters.text("cfar_kind", "os",
                      "points are found by cell averaging (ca) or by an ordered statistic (os) of the noise around"));
  cfar.false_alarm_rate = parameters.number("cfar_false_alarm_rate", cfar.false_alarm_rate, 1e-12, 0.5,
                                            "share of cells that hold noise alone and are taken for a target");
  cfar.guard_m =
      parameters.number("cfar_guard_m", cfar.guard_m, 0, 100,
                        "so far to either side of a cell nothing is taken for noise, and two bins at least, m");
  cfar.training_m = parameters.number("cfar_training_m", cfar.training_m, 0.01, 100,
                                      "then so far to either side along range it is, m");
  cfar.guard_beams = parameters.integer("cfar_guard_beams", cfar.guard_beams, 0, kAngleBins,
                                        "the same along the angle, in beams, of which a line has one per element");
  cfar.training_beams = parameters.integer("cfar_training_beams", cfar.training_beams, 0, kAngleBins,
                                           "then so many beams to either side; 0 with no guard: range alone");
  cfar.rank_share =
      parameters.number("cfar_rank_share", cfar.rank_share, 0.01, 1,
                        "os: which of the cells around tells the noise, as a share of them from the weakest");
  cfar.sidelobe_db = parameters.number("cfar_sidelobe_db", cfar.sidelobe_db, 0, 400,
                                       "what is so far below the strongest of its range is its sidelobe, dB");
  check(cfar);
  return cfar;
}

sensor_msgs::PointCloud2 toCloud(const std::vector<Detection>& detections, const std_msgs::Header& header) {
  constexpr int kFloat = sensor_msgs::PointField::FLOAT32;
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.is_dense = true;  // every point has a place
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2Fields(8, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "snr_db", 1, kFloat, "range_m", 1,
                                kFloat, "azimuth_deg", 1, kFloat, "radial_speed_m_s", 1, kFloat, "power_db", 1, kFloat);
  modifier.resize(detections.size());
  sensor_msgs::PointCloud2Iterator<float> out(cloud, "x");
  for (const Detection& detection : detections) {
    const Eigen::Vector2d place_m = position_m(detection);
    const double fields[] = {place_m.x(),
                             place_m.y(),
                             0,
                             detection.snr_db,
                             detection.range_m,
                             detection.azimuth_rad * 180 / M_PI,
                             detection.radial_speed_m_per_s,
                             detection.power_db};
    for (int i = 0; i < 8; ++i) out[i] = static_cast<float>(fields[i]);
    ++out;
  }
  return cloud;
}

std::vector<Detection> fromCloud(const sensor_msgs::PointCloud2& cloud, const RangeAngleAxes& axes) {
  std::vector<Detection> detections;
  if (cloud.data.empty()) return detections;
  ReadField range_m = fieldOf(cloud, "range_m"), azimuth_deg = fieldOf(cloud, "azimuth_deg"),
            snr_db = fieldOf(cloud, "snr_db"), power_db = fieldOf(cloud, "power_db"),
            speed = fieldOf(cloud, "radial_speed_m_s");
  for (; range_m != range_m.end(); ++range_m, ++azimuth_deg, ++snr_db, ++power_db, ++speed) {
    Detection detection;
    detection.range_m = *range_m;
    detection.azimuth_rad = *azimuth_deg * M_PI / 180;
    detection.range_bin = nearestBin(axes.range_m, detection.range_m);
    detection.angle_bin = nearestBin(axes.azimuth_rad, detection.azimuth_rad);
    detection.snr_db = *snr_db;
    detection.power_db = *power_db;
    detection.radial_speed_m_per_s = *speed;
    detections.push_back(detection);
  }
  return detections;
}

}  // namespace mmradartwin
