#include <mmradartwin_msgs/Session.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_eigen/tf2_eigen.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_dsp/ros/bag_writer.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/sha256.h"
#include "ros/bag/bag_set.h"
#include "ros/message_lengths.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

std::string captureOf(const std::string& pattern, const std::string& pose) {
  std::string file = pattern;
  return file.replace(file.find("{pose}"), 6, pose);
}

std::string readBytes(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  return bytes.str();
}

/// Writes a message that `rosbag play` publishes latched.
template <typename Message>
void writeLatched(rosbag::Bag& bag, const std::string& topic, const ros::Time& time, const Message& message) {
  const auto header = boost::make_shared<ros::M_string>();
  (*header)["callerid"] = "/session_to_bag";
  (*header)["latching"] = "1";
  (*header)["md5sum"] = ros::message_traits::md5sum(message);
  (*header)["message_definition"] = ros::message_traits::definition(message);
  (*header)["topic"] = topic;
  (*header)["type"] = ros::message_traits::datatype(message);
  bag.write(topic, time, message, header);
}

ros::Time recordTime(std::int64_t stamp_ns) { return toRosTime(std::max<std::int64_t>(1, stamp_ns)); }

/// True where cubes give back the capture bit for bit.
bool survivesCubes(const RadarConfig& radar, const CaptureReader& reader) {
  std::vector<std::int16_t> samples;
  for (int i = 0; i < reader.frames(); ++i) {
    const std::vector<std::uint8_t> bytes = reader.bytes(i);
    decodeFrame(radar, bytes.data(), samples);
    if (encodeFrame(radar, samples) != bytes) return false;
  }
  return true;
}

class SessionBagWriter {
 public:
  SessionBagWriter(const Recording& recording, rosbag::Bag& bag)
      : recording_(recording), bag_(bag), hash_(radarHash(recording.radar)) {}

  /// Returns true where the pose's capture went into the bag as cubes; `problem` says what is wrong with it.
  bool add(const Pose& pose, std::string& problem) {
    try {
      const CaptureReader reader(recording_.radar, captureOf(recording_.capture_pattern, pose.name));
      if (!reader.plain() || !survivesCubes(recording_.radar, reader)) return false;
      const std::int64_t quarter = recording_.radar.frame_offset_ns(1) / 4;
      writePose(pose, pose.stamp_ns - quarter);
      for (int i = 0; i < reader.frames(); ++i) {
        mmradartwin_msgs::AdcCube cube = toMsg(reader.frame(i, pose.stamp_ns), hash_);
        cube.header.frame_id = "radar_link";
        bag_.write("/radar/adc", recordTime(pose.stamp_ns + recording_.radar.frame_offset_ns(i)), cube);
        writePose(pose, pose.stamp_ns + recording_.radar.frame_offset_ns(i) + quarter);
      }
      return true;
    } catch (const InputError& error) {  // reading the bag will say so too
      problem = error.what();
      return false;
    }
  }

 private:
  void writePose(const Pose& pose, std::int64_t stamp_ns) {
    tf2_msgs::TFMessage tf;
    tf.transforms.resize(1);
    geometry_msgs::TransformStamped& T = tf.transforms.front();
    T = tf2::eigenToTransform(pose.T_map_radar);
    T.header.stamp = recordTime(stamp_ns);
    T.header.frame_id = "map";
    T.child_frame_id = "radar_link";
    bag_.write("/tf", T.header.stamp, tf);
  }

  const Recording& recording_;
  rosbag::Bag& bag_;
  std::uint64_t hash_;
};

}  // namespace

namespace {

boost::shared_ptr<mmradartwin_msgs::Session> readSessionMessage(const BagSet& bags) {
  const auto view = bags.view();
  std::vector<std::string> topics;
  for (const rosbag::ConnectionInfo* connection : view->getConnections()) {
    if (connection->datatype == "mmradartwin_msgs/Session") topics.push_back(connection->topic);
  }
  boost::shared_ptr<mmradartwin_msgs::Session> session;
  if (topics.empty()) return session;
  const auto messages = bags.view(topics);
  for (const rosbag::MessageInstance& message : *messages) session = instanceOf<mmradartwin_msgs::Session>(message);
  return session;
}

/// Writes the frames of a pose back to back; returns the SHA-256 of what was written.
std::string writeFrames(const Recording& recording, const Pose& pose, const std::string& file) {
  fs::create_directories(fs::path(file).parent_path());
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  Sha256 hash;
  recording.forEachFrame(pose, [&](const AdcCube& cube) {
    const std::vector<std::uint8_t> bytes = encodeFrame(recording.radar, cube.data);
    hash.add(bytes.data(), bytes.size());
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  });
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
  return hash.hex();
}

std::vector<PoseProblem> restoreSession(const mmradartwin_msgs::Session& message, const std::string& bag,
                                        const std::string& directory, const PoseProgress& progress,
                                        BagOptions options) {
  const std::vector<StoredFile> files = storedFiles(message);
  const auto has_file = [&files](const std::string& name) {
    return std::any_of(files.begin(), files.end(), [&](const StoredFile& file) { return file.name == name; });
  };
  if (!has_file("session.yaml")) throw InputError(bag + ": its session message holds no session.yaml; record it anew");
  const auto session_yaml =
      std::find_if(files.begin(), files.end(), [](const StoredFile& f) { return f.name == "session.yaml"; });
  const std::string pattern = storedCapturePattern(session_yaml->bytes);
  options.exclude_duplicates = false;
  const Recording recording = openBag(bag, options);
  const std::size_t total = recording.pose_names.size();
  std::vector<PoseProblem> different;
  for (std::size_t i = 0; i < total; ++i) {
    const std::string& name = recording.pose_names[i];
    const std::string expected = i < message.capture_sha256.size() ? message.capture_sha256[i] : "";
    const auto pose =
        std::find_if(recording.poses.begin(), recording.poses.end(), [&](const Pose& p) { return p.name == name; });
    if (!expected.empty() && !has_file(captureOf(pattern, name))) {
      std::string found;
      try {
        if (pose != recording.poses.end()) {
          found = writeFrames(recording, *pose, (fs::path(directory) / captureOf(pattern, name)).string());
        }
      } catch (const InputError&) {  // no frames: counted below, as any other difference
        fs::remove(fs::path(directory) / captureOf(pattern, name));
      }
      if (found != expected) {
        different.push_back({name, bag + ": pose '" + name +
                                       "': the bag's frames are not the whole capture (lost on the way, or cut out)"});
      }
    }
    if (progress) progress(static_cast<int>(i) + 1, static_cast<int>(total));
  }
  restoreSessionFiles(files, directory);
  return different;
}

void writeFoundSession(const std::string& bag, const std::string& directory, const PoseProgress& progress,
                       BagOptions options) {
  options.exclude_duplicates = false;
  options.unpack_to = directory;
  const Recording recording = openBag(bag, options);
  SessionWriter::Files files;
  files.radar_yaml = toYaml(recording.radar);
  files.scene = recording.scene_file;
  if (recording.twin_file) files.twin = fs::path(*recording.twin_file).filename().string();
  SessionWriter writer(directory, recording.radar, files);
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    std::vector<AdcCube> cubes;
    recording.forEachFrame(recording.poses[i], [&cubes](const AdcCube& cube) { cubes.push_back(cube); });
    writer.add(recording.poses[i], cubes);
    if (progress) progress(static_cast<int>(i) + 1, static_cast<int>(recording.poses.size()));
  }
  writer.finish();
}

}  // namespace

std::vector<PoseProblem> bagToSession(const std::string& bag, const std::string& directory,
                                      const PoseProgress& progress, const BagOptions& options) try {
  if (fs::exists(fs::path(directory) / "session.yaml")) {
    throw InputError(directory + ": holds a session already; give a new folder");
  }
  std::vector<std::string> files = {bag};
  files.insert(files.end(), options.further.begin(), options.further.end());
  const auto message = readSessionMessage(BagSet(files));
  std::error_code error;
  fs::create_directories(directory, error);
  if (error)
    throw InputError(directory + ": folder cannot be made (" + error.message() + "); give one that can be written");
  if (message) return restoreSession(*message, bag, directory, progress, options);
  writeFoundSession(bag, directory, progress, options);
  return {};
} catch (const ros::Exception& error) {
  throw damagedBag(bag, error);
}

std::vector<PoseProblem> sessionToBag(const std::string& session, const std::string& bag_file,
                                      const PoseProgress& progress) try {
  SessionOptions options;
  options.exclude_duplicates = false;
  const Recording recording = openSession(session, options);
  mmradartwin_msgs::RadarConfig config = toMsg(recording.radar);
  fromMsg(config);  // what nobody could read is not written
  mmradartwin_msgs::Session message;
  message.header.frame_id = "map";
  message.name = recording.name;
  const std::vector<StoredFile> files = gatherSessionFiles(session);
  const std::string stored_pattern = storedCapturePattern(files.front().bytes);
  for (const StoredFile& file : files) message.files.push_back(toMsg(file));

  BagWriter bag_writer(bag_file);
  rosbag::Bag& bag = bag_writer.bag();
  std::int64_t start_ns = std::numeric_limits<std::int64_t>::max();
  for (const Pose& pose : recording.poses) start_ns = std::min(start_ns, pose.stamp_ns);
  if (recording.poses.empty()) start_ns = 0;
  const ros::Time start = recordTime(start_ns - recording.radar.frame_offset_ns(1));
  message.header.stamp = start;

  SessionBagWriter writer(recording, bag);
  std::map<std::string, const Pose*> poses;
  for (const Pose& pose : recording.poses) poses[pose.name] = &pose;
  std::vector<PoseProblem> problems = recording.problems;
  const int total = static_cast<int>(recording.pose_names.size());
  for (int i = 0; i < total; ++i) {
    const std::string& name = recording.pose_names[static_cast<std::size_t>(i)];
    const std::string capture = captureOf(recording.capture_pattern, name);
    requireRegularFile(capture);
    std::error_code none;
    const bool exists = fs::is_regular_file(capture, none);
    std::string bytes;  // a capture in several parts comes back as one file
    if (exists) {
      try {
        for (const std::string& part : captureParts(capture)) bytes += readBytes(part);
      } catch (const InputError&) {  // a part is missing: the pose is none that frames can be read of
        bytes = readBytes(capture);
      }
    }
    message.capture_sha256.push_back(exists ? sha256OfBytes(bytes) : "");
    const auto pose = poses.find(name);
    std::string problem;
    const bool in_cubes = pose != poses.end() && writer.add(*pose->second, problem);
    if (!problem.empty()) problems.push_back({name, "pose '" + name + "': " + problem});
    if (exists && !in_cubes) {
      message.files.emplace_back();
      message.files.back().name = captureOf(stored_pattern, name);
      message.files.back().data.assign(bytes.begin(), bytes.end());
    }
    if (progress) progress(i + 1, total);
  }
  config.header.stamp = start;
  config.header.frame_id = "radar_link";
  writeLatched(bag, "/radar/config", start, config);
  writeLatched(bag, "/session", start, message);
  bag_writer.close();
  return problems;
} catch (const rosbag::BagException& error) {
  throw std::runtime_error(bag_file + ": cannot be written to its end (" + error.what() + "); check the free space");
}

}  // namespace mmradartwin
