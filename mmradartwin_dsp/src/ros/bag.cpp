#include "mmradartwin_dsp/ros/bag.h"

#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/buffer_core.h>
#include <tf2/exceptions.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// tf older than this is forgotten while a bag is read; look-ups happen near its end, where tf2 finds them at once.
constexpr double kTfCache_s = 60;
/// A frame whose transform has not come this long after it will not come.
constexpr double kTfPatience_s = 10;

struct CubeIndex {
  std::int64_t stamp_ns;
  ros::Time recorded;
  std::optional<Eigen::Isometry3d> T_map_radar;
  bool on_the_way = false;  ///< within a jump of tf, or a gap with two different ends: no pose is its own
};

std::string withoutSlash(const std::string& name) {
  return name.substr(std::min(name.find_first_not_of('/'), name.size()));
}

class BagContents {
 public:
  BagContents(const std::string& file, const BagOptions& options) : file_(file), options_(options) {
    if (!fs::is_regular_file(file)) throw InputError(file + ": no such bag; give a file that exists");
    try {
      bag_.open(file, rosbag::bagmode::Read);
    } catch (const rosbag::BagUnindexedException&) {
      throw InputError(file + ": bag has no index; run `rosbag reindex " + file + "` first");
    } catch (const rosbag::BagException& error) {
      throw InputError(file + ": cannot be read as a bag (" + error.what() + ")");
    }
    findTopics();
    readConfig();
    session = only<mmradartwin_msgs::Session>("session");
    readFrames();
  }

  /// Visits the cubes of a stretch of time. rosbag is not thread-safe: one visitor at a time.
  void forEachFrame(const std::string& pose, const std::vector<CubeIndex>& cubes,
                    const std::function<void(const AdcCube&)>& visit) {
    const std::lock_guard<std::mutex> lock(mutex_);
    ros::Time first = cubes.front().recorded, last = cubes.front().recorded;
    std::set<std::int64_t> stamps;
    for (const CubeIndex& cube : cubes) {
      stamps.insert(cube.stamp_ns);
      first = std::min(first, cube.recorded);
      last = std::max(last, cube.recorded);
    }
    rosbag::View view(bag_, rosbag::TopicQuery(topic("radar/adc")), first, last);
    for (const rosbag::MessageInstance& message : view) {
      const auto cube = message.instantiate<mmradartwin_msgs::AdcCube>();
      if (!cube || !stamps.count(toNanoseconds(cube->header.stamp))) continue;
      if (cube->radar_hash != radar_hash) {
        throw InputError(file_ + ": pose '" + pose + "': frame " + std::to_string(cube->sequence) +
                         " was taken with another radar configuration than " + topic("radar/config") +
                         " says; cut the bag with rosbag filter");
      }
      AdcCube frame = fromMsg(*cube);
      checkShape(pose, frame);
      visit(frame);
    }
  }

  std::string label() const { return file_ + ":" + topic("radar/config"); }

  RadarConfig radar;
  std::uint64_t radar_hash = 0;
  boost::shared_ptr<mmradartwin_msgs::Session> session;
  boost::shared_ptr<mmradartwin_msgs::Scene> scene() { return only<mmradartwin_msgs::Scene>("twin/scene"); }
  std::vector<CubeIndex> cubes;  // by stamp

 private:
  std::string topic(const std::string& name) const { return prefix_ + name; }

  void findTopics() {
    rosbag::View view(bag_);
    std::set<std::string> cube_topics, all;
    for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
      all.insert(connection->topic);
      if (connection->datatype == "mmradartwin_msgs/AdcCube") cube_topics.insert(connection->topic);
    }
    const std::string wanted = withoutSlash(options_.ns.empty() ? "radar/adc" : options_.ns + "/radar/adc");
    std::string found;
    for (const std::string& name : cube_topics) {
      if (withoutSlash(name) == wanted) found = name;
    }
    if (found.empty() && options_.ns.empty() && cube_topics.size() == 1) found = *cube_topics.begin();
    const std::string ending = "radar/adc";
    if (found.size() < ending.size() || found.compare(found.size() - ending.size(), ending.size(), ending) != 0) {
      std::string others;
      for (const std::string& name : cube_topics.empty() ? all : cube_topics)
        others += (others.empty() ? "" : ", ") + name;
      throw InputError(file_ + ": bag holds no frames on topic " + wanted + " (it has " +
                       (others.empty() ? "nothing" : others) + "); record radar/adc, radar/config and tf");
    }
    prefix_ = found.substr(0, found.size() - ending.size());
  }

  template <typename Message>
  boost::shared_ptr<Message> only(const std::string& name) {
    rosbag::View view(bag_, rosbag::TopicQuery(topic(name)));
    boost::shared_ptr<Message> last;
    for (const rosbag::MessageInstance& message : view) {
      last = message.instantiate<Message>();
      if (!last) refuseVersion(message);
    }
    return last;
  }

  [[noreturn]] void refuseVersion(const rosbag::MessageInstance& message) const {
    throw InputError(file_ + ": topic " + message.getTopic() + " holds " + message.getDataType() +
                     " of another version; convert the bag with rosbag fix");
  }

  void readConfig() {
    rosbag::View view(bag_, rosbag::TopicQuery(topic("radar/config")));
    boost::shared_ptr<mmradartwin_msgs::RadarConfig> config;
    for (const rosbag::MessageInstance& message : view) {
      const auto next = message.instantiate<mmradartwin_msgs::RadarConfig>();
      if (!next) refuseVersion(message);
      if (config && radarHash(*next) != radarHash(*config)) {
        throw InputError(file_ + ": holds several radar configurations on " + topic("radar/config") +
                         "; cut it with rosbag filter so that it holds one");
      }
      config = next;
    }
    if (!config) {
      throw InputError(file_ + ": bag holds no radar configuration on topic " + topic("radar/config") +
                       "; record it too (it is latched)");
    }
    try {
      radar = fromMsg(*config);
    } catch (const InputError& error) {
      throw InputError(file_ + ": " + error.what());
    }
    radar_hash = radarHash(*config);
  }

  void checkShape(const std::string& pose, const AdcCube& cube) const {
    if (cube.chirps == radar.chirps_per_frame() && cube.samples == radar.samples_per_chirp &&
        cube.receivers == radar.receivers()) {
      return;
    }
    throw InputError(file_ + ": pose '" + pose + "': frame " + std::to_string(cube.sequence) +
                     " has another shape than radar/config says");
  }

  /// Indexes the frames and finds T_map_radar at each one's stamp.
  void readFrames() {
    tf2::BufferCore buffer{ros::Duration(kTfCache_s)};
    rosbag::View fixed(bag_, rosbag::TopicQuery(std::vector<std::string>{"/tf_static", "tf_static"}));
    std::size_t transforms = 0;
    const auto feed = [&](const rosbag::MessageInstance& message, bool is_static) {
      const auto tf = message.instantiate<tf2_msgs::TFMessage>();
      if (!tf) return;
      record_.add(*tf, is_static);
      record_.keep(kTfCache_s);
      for (const geometry_msgs::TransformStamped& transform : tf->transforms) {
        transforms += buffer.setTransform(transform, "bag", is_static) ? 1 : 0;
        if (!is_static) newest_tf_ns_ = std::max(newest_tf_ns_, toNanoseconds(transform.header.stamp));
      }
    };
    for (const rosbag::MessageInstance& message : fixed) feed(message, true);
    rosbag::View view(bag_, rosbag::TopicQuery(std::vector<std::string>{"/tf", "tf", topic("radar/adc")}));
    std::deque<CubeIndex> waiting;
    for (const rosbag::MessageInstance& message : view) {
      if (message.getDataType() == "tf2_msgs/TFMessage") {
        feed(message, false);
        settle(buffer, waiting, false);
        continue;
      }
      const auto cube = message.instantiate<mmradartwin_msgs::AdcCube>();
      if (!cube) refuseVersion(message);
      waiting.push_back({toNanoseconds(cube->header.stamp), message.getTime(), std::nullopt, false});
    }
    settle(buffer, waiting, true);
    std::stable_sort(cubes.begin(), cubes.end(), [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
    if (cubes.empty()) throw InputError(file_ + ": bag holds no frames on topic " + topic("radar/adc"));
    if (transforms == 0) {
      throw InputError(file_ + ": bag holds no tf; record /tf and /tf_static too, with " + options_.map_frame + " -> " +
                       options_.radar_frame);
    }
  }

  void settle(const tf2::BufferCore& buffer, std::deque<CubeIndex>& waiting, bool last) {
    while (!waiting.empty()) {
      CubeIndex& cube = waiting.front();
      const std::int64_t reported_ns = cube.stamp_ns + std::llround(options_.pose_lag_s * 1e9);
      try {
        const geometry_msgs::TransformStamped T =
            buffer.lookupTransform(options_.map_frame, options_.radar_frame, toRosTime(reported_ns));
        cube.on_the_way =
            !record_.whyNotBetween(reported_ns, options_.map_frame, options_.radar_frame, TransformLimits()).empty();
        if (!cube.on_the_way) cube.T_map_radar = fromMsg(T.transform);
      } catch (const tf2::TransformException&) {
        const bool late = newest_tf_ns_ > reported_ns + static_cast<std::int64_t>(kTfPatience_s * 1e9);
        if (!last && !late) return;
      }
      cubes.push_back(cube);
      waiting.pop_front();
    }
  }

  std::string file_;
  BagOptions options_;
  rosbag::Bag bag_;
  std::mutex mutex_;
  std::string prefix_;
  TransformRecord record_;
  std::int64_t newest_tf_ns_ = 0;
};

using CubesByPose = std::map<std::string, std::vector<CubeIndex>>;

/// Frames belong to the pose that began last; those that tf puts elsewhere were taken on the way to the next one.
CubesByPose assignByStamp(const std::vector<Pose>& poses, const std::vector<CubeIndex>& cubes, std::int64_t slack_ns) {
  std::vector<const Pose*> by_time;
  for (const Pose& pose : poses) by_time.push_back(&pose);
  std::stable_sort(by_time.begin(), by_time.end(),
                   [](const Pose* a, const Pose* b) { return a->stamp_ns < b->stamp_ns; });
  CubesByPose assigned;
  for (const CubeIndex& cube : cubes) {
    const auto next = std::upper_bound(by_time.begin(), by_time.end(), cube.stamp_ns + slack_ns,
                                       [](std::int64_t stamp, const Pose* pose) { return stamp < pose->stamp_ns; });
    if (next == by_time.begin()) continue;
    const Pose& pose = **(next - 1);
    if (cube.on_the_way || (cube.T_map_radar && !standsStill(*cube.T_map_radar, pose.T_map_radar))) continue;
    assigned[pose.name].push_back(cube);
  }
  return assigned;
}

std::vector<StampedTransform> trackOf(const BagContents& bag) {
  std::vector<StampedTransform> frames;
  for (const CubeIndex& cube : bag.cubes) {
    if (cube.T_map_radar) frames.push_back({cube.stamp_ns, *cube.T_map_radar});
  }
  return frames;
}

std::vector<Stretch> stretchesOf(const BagContents& bag) {
  return findStationaryPoses(trackOf(bag), bag.radar.frame_offset_ns(1));
}

std::vector<CubeIndex> cubesOf(const Stretch& stretch, const std::vector<CubeIndex>& cubes) {
  std::vector<CubeIndex> found;
  for (const CubeIndex& cube : cubes) {
    if (cube.stamp_ns < stretch.pose.stamp_ns || cube.stamp_ns > stretch.last_stamp_ns) continue;
    if (cube.T_map_radar && standsStill(*cube.T_map_radar, stretch.pose.T_map_radar)) found.push_back(cube);
  }
  return found;
}

/// The session was played at another time than its stamps say: poses are recognised by where the radar stood.
CubesByPose assignByPlace(const BagContents& bag, std::vector<Pose>& poses) {
  CubesByPose assigned;
  for (const Stretch& stretch : stretchesOf(bag)) {
    const auto pose = std::find_if(poses.begin(), poses.end(), [&](const Pose& pose) {
      return !assigned.count(pose.name) && sameView(pose.T_map_radar, stretch.pose.T_map_radar);
    });
    if (pose == poses.end()) continue;
    pose->stamp_ns = stretch.pose.stamp_ns;
    assigned[pose->name] = cubesOf(stretch, bag.cubes);
  }
  return assigned;
}

Recording fromSessionMessage(BagContents& bag, const std::string& folder, CubesByPose& assigned) {
  restoreSessionFiles(storedFiles(*bag.session), folder);
  SessionOptions options;
  options.need_captures = false;
  options.exclude_duplicates = false;
  Recording recording = openSession(folder, options);
  recording.name = bag.session->name;
  assigned = assignByStamp(recording.poses, bag.cubes, bag.radar.frame_offset_ns(1) / 4);
  if (assigned.empty()) assigned = assignByPlace(bag, recording.poses);
  return recording;
}

Recording fromStretches(BagContents& bag, const std::string& file, const std::string& folder, CubesByPose& assigned) {
  Recording recording;
  recording.name = fs::path(file).stem().string();
  for (const Stretch& stretch : stretchesOf(bag)) {
    recording.poses.push_back(stretch.pose);
    recording.pose_names.push_back(stretch.pose.name);
    assigned[stretch.pose.name] = cubesOf(stretch, bag.cubes);
  }
  const auto scene = bag.scene();
  if (scene && !scene->scene_file.empty() && fs::exists(scene->scene_file)) {
    recording.scene_file = scene->scene_file;
    if (!scene->twin_yaml.empty()) {
      recording.twin_file = (fs::path(folder) / "twin.yaml").string();
      std::ofstream(*recording.twin_file, std::ios::binary | std::ios::trunc) << scene->twin_yaml;
    }
  }
  return recording;
}

std::string captureOf(const std::string& pattern, const std::string& pose) {
  std::string file = pattern;
  return pattern.empty() ? pattern : file.replace(file.find("{pose}"), 6, pose);
}

void leaveOutUnseen(Recording& recording, const CubesByPose& assigned) {
  const auto unseen = [&](const Pose& pose) {
    return !assigned.count(pose.name) && !fs::exists(captureOf(recording.capture_pattern, pose.name));
  };
  recording.poses.erase(std::remove_if(recording.poses.begin(), recording.poses.end(), unseen), recording.poses.end());
  if (recording.poses.empty() && recording.problems.empty()) {
    throw InputError("no frame of any of the session's " + std::to_string(recording.pose_names.size()) +
                     " poses came yet; wait for the first one, and check that tf puts the radar where poses.csv does");
  }
}

}  // namespace

Recording openBag(const std::string& file, const BagOptions& options) {
  const auto bag = std::make_shared<BagContents>(file, options);
  std::shared_ptr<TemporaryFolder> temporary;
  std::string folder = options.unpack_to;
  if (folder.empty()) {
    temporary = std::make_shared<TemporaryFolder>();
    folder = temporary->path();
  }
  fs::create_directories(folder);
  auto assigned = std::make_shared<CubesByPose>();
  Recording recording =
      bag->session ? fromSessionMessage(*bag, folder, *assigned) : fromStretches(*bag, file, folder, *assigned);
  if (options.seen_only && bag->session) leaveOutUnseen(recording, *assigned);
  recording.source = file;
  recording.radar = bag->radar;
  recording.radar_file = bag->label();
  if (recording.poses.empty() && recording.problems.empty()) {
    throw InputError(file + ": bag holds no pose: in tf, " + options.map_frame + " -> " + options.radar_frame +
                     " nowhere stands still (2 cm, 1 deg) for 1 s while frames come; check the frames' names, or keep "
                     "the radar still longer");
  }
  if (options.exclude_duplicates) excludeDuplicates(recording);
  recording.forEachFrame = [bag, temporary, assigned, file, from_files = recording.forEachFrame,
                            pattern = recording.capture_pattern](const Pose& pose,
                                                                 const std::function<void(const AdcCube&)>& visit) {
    const auto cubes = assigned->find(pose.name);
    if (cubes != assigned->end() && !cubes->second.empty()) return bag->forEachFrame(pose.name, cubes->second, visit);
    if (fs::exists(captureOf(pattern, pose.name))) return from_files(pose, visit);
    throw InputError(file + ": pose '" + pose.name +
                     "': bag holds no frames of it; its capture was missing or its time was cut out");
  };
  recording.track = trackOf(*bag);
  recording.forEachFrameBetween = [bag](std::int64_t first_ns, std::int64_t last_ns,
                                        const std::function<void(const AdcCube&)>& visit) {
    std::vector<CubeIndex> cubes;
    for (const CubeIndex& cube : bag->cubes) {
      if (cube.stamp_ns >= first_ns && cube.stamp_ns <= last_ns) cubes.push_back(cube);
    }
    if (!cubes.empty()) bag->forEachFrame("on the way", cubes, visit);
  };
  recording.withPoseLag = [file, options](double lag_s) {
    BagOptions later = options;
    later.pose_lag_s += lag_s;
    return openBag(file, later);
  };
  return recording;
}

Recording openRecording(const std::string& path, const std::string& radar_file,
                        const std::optional<CaptureLayout>& layout, const BagOptions& bag_options) {
  const std::string extension = fs::path(path).extension().string();
  if (!fs::exists(path)) {
    throw InputError(path + ": no such file or folder; give a session directory, a .bag or a .bin capture");
  }
  if (extension == ".bag") {
    if (!radar_file.empty() || layout) {
      throw InputError(path +
                       ": a bag brings its own radar and holds cubes, not captures; leave --radar and --layout out");
    }
    return openBag(path, bag_options);
  }
  if (extension == ".bin") {
    if (radar_file.empty())
      throw InputError(path + ": a bare capture needs a radar description; give --radar radar.yaml");
    RadarConfig radar = loadRadarConfig(radar_file);
    if (layout) radar.layout = *layout;
    return openCapture(path, radar);
  }
  SessionOptions options;
  options.radar_file = radar_file;
  options.layout = layout;
  return openSession(path, options);
}

}  // namespace mmradartwin
