// Messages as they come from a bag or a peer: their bytes, what ROS makes of them, and what is made of that.
#include <mmradartwin_msgs/ReceiveGrid.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/serialization.h>
#include <tf2_msgs/TFMessage.h>

#include <filesystem>

#include "hostile_input.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/point_cloud.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/ros/transform_sources.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/session_files.h"
#include "ros/message_lengths.h"

namespace mmradartwin {
namespace {

template <typename Message>
std::string bytesOf(const Message& message) {
  std::string bytes(ros::serialization::serializationLength(message), '\0');
  ros::serialization::OStream stream(reinterpret_cast<std::uint8_t*>(bytes.data()),
                                     static_cast<std::uint32_t>(bytes.size()));
  ros::serialization::serialize(stream, message);
  return bytes;
}

/// Calls `use` with the message that ROS makes of the bytes, where it makes one.
template <typename Message, typename Use>
std::function<void(const std::string&)> message(Use use) {
  return [use](const std::string& bytes) {
    static const MessageLengths lengths(ros::message_traits::datatype<Message>(),
                                        ros::message_traits::definition<Message>());
    const auto* begin = reinterpret_cast<const std::uint8_t*>(bytes.data());
    if (!lengths.hold(begin, bytes.size())) return;
    Message message;
    ros::serialization::IStream stream(const_cast<std::uint8_t*>(begin), static_cast<std::uint32_t>(bytes.size()));
    // Nothing that passed is too long for ROS.
    ros::serialization::deserialize(stream, message);
    refusing([&] { use(message); });
  };
}

void useRadar(const mmradartwin_msgs::RadarConfig& message) {
  const RadarConfig radar = fromMsg(message);
  if (toYaml(fromMsg(toMsg(radar))) != toYaml(radar)) throw std::logic_error("a radar changes on its way");
  radarHash(message);
}

void useCube(const mmradartwin_msgs::AdcCube& message) {
  const AdcCube cube = fromMsg(message);
  if (cube.data.size() != 2ull * cube.chirps * cube.samples * cube.receivers) throw std::logic_error("not its shape");
}

void useSession(const mmradartwin_msgs::Session& message) {
  static int number = 0;
  const std::string folder = inputFolder() + "/" + std::to_string(number++ % 8);
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  refusing([&] { restoreSessionFiles(storedFiles(message), folder); });
  SessionOptions options;
  options.need_captures = false;
  refusing([&] { openSession(folder, options); });
}

void useTransforms(const tf2_msgs::TFMessage& message) {
  TransformRecord record;
  TransformSources sources;
  for (const bool fixed : {false, true}) {
    record.add(message, fixed);
    sources.add(message, fixed, fixed ? "/mount" : "/slam");
  }
  record.chain("map", "radar_link");
  record.keep(60);
  sources.contradictions("map", "radar_link");
  sources.roots();
  for (const geometry_msgs::TransformStamped& T : message.transforms) fromMsg(T.transform);
}

void usePoints(const sensor_msgs::PointCloud2& message) {
  static const RangeAngleAxes axes = SignalChain(paperRadar()).axes();
  for (const Detection& detection : fromCloud(message, axes)) {
    if (detection.range_bin < 0 || detection.range_bin > 63 || detection.angle_bin < 0 || detection.angle_bin > 63) {
      throw std::logic_error("no cell of the map");
    }
  }
}

sensor_msgs::PointCloud2 points() {
  Detection detection;
  detection.range_m = 3;
  detection.radial_speed_m_per_s = 0.5;
  return toCloud({detection, detection}, std_msgs::Header());
}

mmradartwin_msgs::AdcCube cube() {
  AdcCube cube;
  cube.chirps = 2, cube.samples = 4, cube.receivers = 2;
  cube.data.assign(32, 7);
  cube.chirp_valid.assign(2, 1);
  cube.stamp_ns = 1'700'000'000'000'000'000;
  return toMsg(cube, 1);
}

mmradartwin_msgs::ReceiveGrid grid() {
  ReceiveGrid grid;
  grid.x = ComplexGrid::Ones(2, 4);
  grid.full_scale = 32768;
  grid.frames = 1;
  return toMsg(grid, 1);
}

mmradartwin_msgs::Session session(const std::vector<StoredFile>& files) {
  mmradartwin_msgs::Session message;
  message.name = "lab";
  for (const StoredFile& file : files) message.files.push_back(toMsg(file));
  message.capture_sha256 = {"", std::string(64, 'a')};
  return message;
}

tf2_msgs::TFMessage transforms() {
  tf2_msgs::TFMessage message;
  for (const char* child : {"camera_link", "radar_link"}) {
    geometry_msgs::TransformStamped T;
    T.header.stamp = ros::Time(1'700'000'000, 5);
    T.header.frame_id = message.transforms.empty() ? "map" : "camera_link";
    T.child_frame_id = child;
    T.transform.rotation.w = 1;
    message.transforms.push_back(T);
  }
  return message;
}

}  // namespace

std::vector<HostileInput> hostileInputs() {
  const std::string yaml = "format: mmradartwin_session/1\nradar: radar.yaml\nposes: poses.csv\n";
  const std::vector<StoredFile> files = {
      {"session.yaml", yaml},
      {"radar.yaml", toYaml(paperRadar())},
      {"poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\n000,a,1700000000.25,1,2,1.1,0,0,0,1\n"}};
  return {
      {"radar_message", message<mmradartwin_msgs::RadarConfig>(useRadar), {bytesOf(toMsg(paperRadar()))}},
      {"cube_message", message<mmradartwin_msgs::AdcCube>(useCube), {bytesOf(cube())}},
      {"grid_message",
       message<mmradartwin_msgs::ReceiveGrid>([](const mmradartwin_msgs::ReceiveGrid& m) { fromMsg(m); }),
       {bytesOf(grid())}},
      {"session_message",
       message<mmradartwin_msgs::Session>(useSession),
       {bytesOf(session(files)), bytesOf(session({{"session.yaml", yaml}, {"a", "1"}, {"a/b", "2"}})),
        bytesOf(session({{".", ""}})), bytesOf(session({{std::string(5000, 'x'), "1"}, {"../out", "2"}}))}},
      {"points_message", message<sensor_msgs::PointCloud2>(usePoints), {bytesOf(points())}},
      {"tf_message", message<tf2_msgs::TFMessage>(useTransforms), {bytesOf(transforms())}},
  };
}

}  // namespace mmradartwin
