#include "mmradartwin_attribution/ros/detection_publisher.h"

#include <mmradartwin_msgs/DetectionAgreement.h>

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/detection_agreement.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/point_cloud.h"

namespace mmradartwin {
namespace {

std::vector<Detection> evaluated(const EvaluationField& field, std::vector<Detection> detections) {
  const auto left_out = [&](const Detection& detection) {
    return field.field(detection.range_bin, detection.angle_bin) != Field::kCentral;
  };
  detections.erase(std::remove_if(detections.begin(), detections.end(), left_out), detections.end());
  return detections;
}

}  // namespace

DetectionPublisher::Settings::Settings(StrictParameters& parameters) {
  cfar = readCfarSettings(parameters);
  match_m = parameters.number("cfar_match_m", match_m, 1e-3, 100,
                              "measured and simulated points match where they are at most so far apart, m");
}

DetectionPublisher::DetectionPublisher(ros::NodeHandle& nh, const Settings& settings) : settings_(settings) {
  simulated_ = nh.advertise<sensor_msgs::PointCloud2>("twin/points", 10);
  agreement_ = nh.advertise<mmradartwin_msgs::DetectionAgreement>("attribution/detection_agreement", 10);
}

void DetectionPublisher::setRadar(const RadarConfig& radar) { cfar_ = std::make_unique<Cfar>(settings_.cfar, radar); }

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
