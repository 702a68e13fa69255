#include "mmradartwin_attribution/ros/detection_publisher.h"

#include <mmradartwin_msgs/DetectionAgreement.h>
#include <sensor_msgs/point_cloud2_iterator.h>

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/detection_agreement.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"

namespace mmradartwin {
namespace {

CfarKind cfarKindFrom(const std::string& name) {
  if (name == "ca") return CfarKind::kCellAveraging;
  if (name == "os") return CfarKind::kOrderedStatistic;
  throw InputError("parameter cfar_kind: '" + name + "' is unknown; allowed: ca, os");
}

std::vector<Detection> evaluated(const EvaluationField& field, std::vector<Detection> detections) {
  const auto left_out = [&](const Detection& detection) {
    return field.field(detection.range_bin, detection.angle_bin) != Field::kCentral;
  };
  detections.erase(std::remove_if(detections.begin(), detections.end(), left_out), detections.end());
  return detections;
}

}  // namespace

sensor_msgs::PointCloud2 toCloud(const std::vector<Detection>& detections, const std_msgs::Header& header) {
  constexpr int kFloat = sensor_msgs::PointField::FLOAT32;
  sensor_msgs::PointCloud2 cloud;
  cloud.header = header;
  cloud.is_dense = true;
  sensor_msgs::PointCloud2Modifier modifier(cloud);
  modifier.setPointCloud2Fields(6, "x", 1, kFloat, "y", 1, kFloat, "z", 1, kFloat, "snr_db", 1, kFloat, "range_m", 1,
                                kFloat, "azimuth_deg", 1, kFloat);
  modifier.resize(detections.size());
  sensor_msgs::PointCloud2Iterator<float> out(cloud, "x");
  for (const Detection& detection : detections) {
    const Eigen::Vector2d place_m = position_m(detection);
    const double fields[] = {place_m.x(),      place_m.y(),       0,
                             detection.snr_db, detection.range_m, detection.azimuth_rad * 180 / M_PI};
    for (int i = 0; i < 6; ++i) out[i] = static_cast<float>(fields[i]);
    ++out;
  }
  return cloud;
}

DetectionPublisher::Settings::Settings(StrictParameters& parameters) {
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
  match_m = parameters.number("cfar_match_m", match_m, 1e-3, 100,
                              "measured and simulated points match where they are at most so far apart, m");
}

DetectionPublisher::DetectionPublisher(ros::NodeHandle& nh, const Settings& settings) : settings_(settings) {
  check(settings.cfar);
  measured_ = nh.advertise<sensor_msgs::PointCloud2>("radar/points", 10);
  simulated_ = nh.advertise<sensor_msgs::PointCloud2>("twin/points", 10);
  agreement_ = nh.advertise<mmradartwin_msgs::DetectionAgreement>("attribution/detection_agreement", 10);
}

void DetectionPublisher::setRadar(const RadarConfig& radar) { cfar_ = std::make_unique<Cfar>(settings_.cfar, radar); }

void DetectionPublisher::publishMeasured(const mmradartwin_msgs::RangeAngleMap& measured) {
  if (!cfar_ || measured_.getNumSubscribers() == 0) return;
  measured_.publish(toCloud(cfar_->detect(fromMsg(measured)), measured.header));
}

void DetectionPublisher::publishPair(const EvaluationField& field, const mmradartwin_msgs::RangeAngleMap& measured_msg,
                                     const mmradartwin_msgs::RangeAngleMap& simulated_msg) {
  const bool agreement_wanted = agreement_.getNumSubscribers() > 0;
  if (!cfar_ || (simulated_.getNumSubscribers() == 0 && !agreement_wanted)) return;
  const RangeAngleMap measured = fromMsg(measured_msg), simulated = fromMsg(simulated_msg);
  const double floor_db = cfar_->noiseFloor_db(measured.power_db);
  // One gain lies between the branches, which the peaks tell as they do for residuals.
  const double gain_db = field.normalise(simulated).peak_db - field.normalise(measured).peak_db;
  const std::vector<Detection> simulated_detections = cfar_->detect(simulated, floor_db + gain_db);
  simulated_.publish(toCloud(simulated_detections, simulated_msg.header));
  if (!agreement_wanted) return;
  const DetectionAgreement found =
      agreement(evaluated(field, cfar_->detect(measured)), evaluated(field, simulated_detections), settings_.match_m);
  mmradartwin_msgs::DetectionAgreement msg;
  msg.header = measured_msg.header;
  msg.measured = static_cast<std::uint32_t>(found.measured);
  msg.simulated = static_cast<std::uint32_t>(found.simulated);
  msg.matched = static_cast<std::uint32_t>(found.matched);
  msg.radius_m = settings_.match_m;
  msg.precision = found.precision;
  msg.recall = found.recall;
  msg.chamfer_m = found.chamfer_m;
  msg.noise_floor_db = floor_db;
  agreement_.publish(msg);
}

}  // namespace mmradartwin
