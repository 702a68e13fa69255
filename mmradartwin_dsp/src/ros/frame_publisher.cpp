#include "mmradartwin_dsp/ros/frame_publisher.h"

#include <exception>
#include <optional>

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/point_cloud.h"

namespace mmradartwin {
namespace {

/// Of the same frame as a range-angle map, whose header and pose it takes.
mmradartwin_msgs::RangeDopplerMap toMsg(const RangeDopplerMap& map, const mmradartwin_msgs::RangeAngleMap& average) {
  mmradartwin_msgs::RangeDopplerMap msg;
  msg.header = average.header;
  msg.radar_hash = average.radar_hash;
  msg.source = average.source;
  msg.range_m = map.range_m;
  msg.radial_speed_m_s = map.radial_speed_m_per_s;
  msg.power_db.assign(map.power_db.data(), map.power_db.data() + map.power_db.size());
  msg.pose_valid = average.pose_valid;
  msg.T_map_radar = average.T_map_radar;
  return msg;
}

}  // namespace

FramePublisher::FramePublisher(ros::NodeHandle& nh, const CfarSettings& cfar)
    : cfar_(cfar),
      points_(nh.advertise<sensor_msgs::PointCloud2>("radar/points", 10)),
      range_doppler_(nh, "radar/range_doppler", 10) {}

void FramePublisher::setRadar(const RadarConfig& radar) {
  detector_ = std::make_unique<PointDetector>(cfar_, radar);
  why_no_speeds_ = mmradartwin::whyNoSpeeds(radar);
  told_ = false;
}

void FramePublisher::publish(const SignalChain& chain, const AdcCube& frame, const ChannelCorrection* correction,
                             const mmradartwin_msgs::RangeAngleMap& average) {
  const bool points_wanted = points_.getNumSubscribers() > 0, range_doppler_wanted = range_doppler_.isWanted();
  if (!detector_ || (!points_wanted && !range_doppler_wanted)) return;
  std::optional<DopplerGrids> speeds;
  const ros::WallTime begin = ros::WallTime::now();
  if (why_no_speeds_.empty()) {
    if (begin < rest_until_) return;
    try {
      speeds = dopplerGrids(chain.radar(), frame, correction);
    } catch (const std::exception& error) {  // the average may have what a single frame lost
      ROS_WARN_THROTTLE(5, "no speeds: %s", error.what());
    }
  } else if (range_doppler_wanted && !told_) {
    told_ = true;
    ROS_WARN("radar/range_doppler is not published: %s", why_no_speeds_.c_str());
  }
  if (points_wanted) {
    const RangeAngleMap map = fromMsg(average);
    points_.publish(toCloud(speeds ? detector_->all(chain, map, *speeds) : detector_->still(map), average.header));
  }
  if (!speeds) return;
  if (range_doppler_wanted) {
    range_doppler_.publish(
        boost::make_shared<mmradartwin_msgs::RangeDopplerMap>(toMsg(rangeDopplerMap(chain, *speeds), average)));
  }
  const ros::WallTime end = ros::WallTime::now();
  rest_until_ = end + (end - begin);
}

}  // namespace mmradartwin
