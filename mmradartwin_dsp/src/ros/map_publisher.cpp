#include "mmradartwin_dsp/ros/map_publisher.h"

#include <sensor_msgs/image_encodings.h>

#include <cstring>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

sensor_msgs::Image pictureOf(const std_msgs::Header& header, std::size_t rows, std::size_t columns,
                             const std::vector<float>& levels_db) {
  if (levels_db.size() != rows * columns) throw InputError("map: power_db is no value per cell");
  sensor_msgs::Image image;
  image.header = header;
  image.height = static_cast<std::uint32_t>(rows);
  image.width = static_cast<std::uint32_t>(columns);
  image.encoding = sensor_msgs::image_encodings::TYPE_32FC1;
  image.step = static_cast<std::uint32_t>(columns * sizeof(float));
  image.data.resize(levels_db.size() * sizeof(float));
  std::memcpy(image.data.data(), levels_db.data(), image.data.size());
  return image;
}

}  // namespace

sensor_msgs::Image toImage(const mmradartwin_msgs::RangeAngleMap& map) {
  return pictureOf(map.header, map.range_m.size(), map.azimuth_rad.size(), map.power_db);
}

sensor_msgs::Image toImage(const mmradartwin_msgs::RangeDopplerMap& map) {
  return pictureOf(map.header, map.range_m.size(), map.radial_speed_m_s.size(), map.power_db);
}

}  // namespace mmradartwin
