#include "mmradartwin_dsp/ros/bag.h"

#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2/exceptions.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <set>

#include "capture_check/file_kind.h"
#include "mmradartwin_dsp/bag_kind.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/output.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/tf_warning_count.h"
#include "mmradartwin_dsp/session_files.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_dsp/text.h"
#include "ros/bag/bag_set.h"
#include "ros/bag/recorded_tf.h"
#include "ros/frame_sources.h"
#include "ros/message_lengths.h"

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

constexpr char kCubes[] = "radar/adc";

std::vector<std::string> allFiles(const std::string& file, const BagOptions& options) {
  std::vector<std::string> files = {file};
  files.insert(files.end(), options.further.begin(), options.further.end());
  return files;
}

class BagContents {
 public:
  BagContents(const std::string& file, const BagOptions& options) : bags_(allFiles(file, options)), options_(options) {
    findTopics();
    readConfig();
    session = only<mmradartwin_msgs::Session>("session");
    radar_frame_ = radarFrame(bags_, topic(kCubes), options.radar_frame);
    RecordedTf tf(kTfCache_s + std::abs(options.clock_offset_s) + std::abs(options.pose_lag_s));
    const TfWarningCount warnings;
    readFrames(tf);
    judge(tf);
    notes_ = {warnings.text(), bags_.noteOnNextPart()};
    notes_.erase(std::remove(notes_.begin(), notes_.end(), ""), notes_.end());
  }

  /// Visits the cubes of a stretch of time. rosbag is not thread-safe: one visitor at a time.
  void forEachFrame(const std::string& pose, const std::vector<CubeIndex>& cubes,
                    const std::function<void(const AdcCube&)>& visit) try {
    const std::lock_guard<std::mutex> lock(mutex_);
    ros::Time first = cubes.front().recorded, last = cubes.front().recorded;
    std::set<std::int64_t> stamps;
    for (const CubeIndex& cube : cubes) {
      stamps.insert(cube.stamp_ns);
      first = std::min(first, cube.recorded);
      last = std::max(last, cube.recorded);
    }
    const auto view = bags_.view({topic(kCubes)}, first, last);
    for (const rosbag::MessageInstance& message : *view) {
      const auto cube = instanceOf<mmradartwin_msgs::AdcCube>(message);
      if (!cube || !stamps.count(toNanoseconds(cube->header.stamp))) continue;
      if (cube->radar_hash != radar_hash) {
        throw InputError(file() + ": pose '" + pose + "': frame " + std::to_string(cube->sequence) +
                         " was taken with another radar configuration than " + topic("radar/config") +
                         " says; cut the bag with rosbag filter");
      }
      AdcCube frame;
      try {
        frame = fromMsg(*cube);
      } catch (const InputError& error) {
        throw InputError(file() + ": pose '" + pose + "': " + error.what());
      }
      checkShape(pose, frame);
      visit(frame);
    }
  } catch (const ros::Exception& error) {
    throw damagedBag(file(), error);
  }

  const std::string& file() const { return bags_.label(); }
  std::string label() const { return file() + ":" + topic("radar/config"); }

  std::string whyNoPose() const {
    const std::string edge = options_.map_frame + " -> " + radar_frame_;
    const auto posed = [](const CubeIndex& cube) { return cube.T_map_radar || cube.on_the_way; };
    if (std::none_of(cubes.begin(), cubes.end(), posed)) {
      return "bag holds no pose: tf says nowhere what " + edge + " is at the time of a frame; record /tf all the while";
    }
    return "bag holds no pose: in tf, " + edge +
           " nowhere stands still (2 cm, 1 deg) for 1 s while frames come; check the frames' names, or keep the radar "
           "still longer";
  }

  /// What is odd in the bag and does no harm.
  const std::vector<std::string>& notes() const { return notes_; }

  RadarConfig radar;
  std::uint64_t radar_hash = 0;
  boost::shared_ptr<mmradartwin_msgs::Session> session;
  boost::shared_ptr<mmradartwin_msgs::Scene> scene() { return only<mmradartwin_msgs::Scene>("twin/scene"); }
  std::vector<CubeIndex> cubes;  // by stamp

 private:
  std::string topic(const std::string& name) const { return prefix_ + name; }

  void findTopics() {
    const auto view = bags_.view();
    std::set<std::string> cube_topics, all;
    std::map<std::string, std::string> radars;  // topics by namespace
    for (const rosbag::ConnectionInfo* connection : view->getConnections()) {
      all.insert(connection->topic);
      if (connection->datatype != "mmradartwin_msgs/AdcCube") continue;
      cube_topics.insert(connection->topic);
      if (const auto ns = namespaceOf(connection->topic, kCubes)) radars[*ns] = connection->topic;
    }
    const std::string ns = normalNamespace(options_.ns);
    if (ns.empty() && radars.size() > 1) {
      std::vector<std::string> topics, choices;
      for (const auto& [name, topic] : radars) {
        topics.push_back(topic);
        choices.push_back("--radar " + name);
      }
      throw InputError(file() + ": bag holds frames of " + std::to_string(radars.size()) + " radars, " +
                       join(topics, " and ") + "; say which: " + join(choices, " or "));
    }
    const auto found = ns.empty() ? radars.begin() : radars.find(ns);
    if (found == radars.end()) {
      const std::set<std::string>& others = cube_topics.empty() ? all : cube_topics;
      throw InputError(file() + ": bag holds no frames on topic " +
                       withoutSlash(ns.empty() ? kCubes : ns + "/" + kCubes) + " (it has " +
                       (others.empty() ? "nothing" : join({others.begin(), others.end()}, ", ")) +
                       "); record radar/adc, radar/config and tf");
    }
    prefix_ = found->second.substr(0, found->second.size() - std::string(kCubes).size());
  }

  template <typename Message>
  boost::shared_ptr<Message> only(const std::string& name) {
    const auto view = bags_.view({topic(name)});
    boost::shared_ptr<Message> last;
    for (const rosbag::MessageInstance& message : *view) {
      last = instanceOf<Message>(message);
      if (!last) refuseVersion(message);
    }
    return last;
  }

  [[noreturn]] void refuseVersion(const rosbag::MessageInstance& message) const {
    throw InputError(file() + ": topic " + message.getTopic() + " holds " + message.getDataType() +
                     " of another version; convert the bag with rosbag fix");
  }

  void readConfig() {
    const auto view = bags_.view({topic("radar/config")});
    boost::shared_ptr<mmradartwin_msgs::RadarConfig> config;
    for (const rosbag::MessageInstance& message : *view) {
      const auto next = instanceOf<mmradartwin_msgs::RadarConfig>(message);
      if (!next) refuseVersion(message);
      if (config && radarHash(*next) != radarHash(*config)) {
        throw InputError(file() + ": holds several radar configurations on " + topic("radar/config") +
                         "; cut it with rosbag filter so that it holds one");
      }
      config = next;
    }
    if (!config) {
      throw InputError(file() + ": bag holds no radar configuration on topic " + topic("radar/config") +
                       "; record it too (it is latched)" + bags_.adviceForLatched());
    }
    try {
      radar = fromMsg(*config);
    } catch (const InputError& error) {
      throw InputError(file() + ": " + error.what());
    }
    radar_hash = radarHash(*config);
  }

  void checkShape(const std::string& pose, const AdcCube& cube) const {
    if (cube.chirps == radar.chirps_per_frame() && cube.samples == radar.samples_per_chirp &&
        cube.receivers == radar.receivers()) {
      return;
    }
    throw InputError(file() + ": pose '" + pose + "': frame " + std::to_string(cube.sequence) +
                     " has another shape than radar/config says");
  }

  /// Indexes the frames and finds T_map_radar at each one's stamp.
  void readFrames(RecordedTf& tf) {
    const auto feed = [&](const rosbag::MessageInstance& message, bool is_static) {
      const auto transforms = instanceOf<tf2_msgs::TFMessage>(message);
      if (transforms) tf.add(*transforms, is_static, message.getCallerId(), toNanoseconds(message.getTime()));
    };
    const auto fixed = bags_.view({"/tf_static", "tf_static"});
    for (const rosbag::MessageInstance& message : *fixed) feed(message, true);
    const auto view = bags_.view({"/tf", "tf", topic(kCubes)});
    std::deque<CubeIndex> waiting;
    for (const rosbag::MessageInstance& message : *view) {
      if (message.getDataType() == "tf2_msgs/TFMessage") {
        feed(message, false);
        settle(tf, waiting, false);
        continue;
      }
      const auto cube = instanceOf<mmradartwin_msgs::AdcCube>(message);
      if (!cube) refuseVersion(message);
      waiting.push_back({toNanoseconds(cube->header.stamp), message.getTime(), std::nullopt, false});
      sources_.add(cube->header.frame_id, message.getCallerId());
      frames_.add(waiting.back().stamp_ns, toNanoseconds(message.getTime()));
    }
    settle(tf, waiting, true);
    std::stable_sort(cubes.begin(), cubes.end(), [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  }

  /// Refuses frames and transforms from which no pose, or a wrong one, would follow.
  void judge(const RecordedTf& tf) const {
    const auto refuse = [this](const std::string& why) {
      if (!why.empty()) throw InputError(file() + ": " + why);
    };
    if (cubes.empty()) refuse("bag holds no frames on topic " + topic(kCubes));
    refuse(frames_.whyNoTime("frames on " + topic(kCubes), "the driver"));
    refuse(sources_.whyNotOne(topic(kCubes)));
    refuseFramesTwice();
    if (tf.empty()) {
      refuse("bag holds no tf; record /tf and /tf_static too, with " + options_.map_frame + " -> " + radar_frame_ +
             bags_.adviceForLatched());
    }
    refuse(tf.whyWrong(options_.map_frame, radar_frame_, frames_, options_.clock_offset_s));
    if (session) return;  // its poses have stamps of their own
    const std::string not_connected = tf.whyNotConnected(options_.map_frame, radar_frame_);
    if (not_connected.empty()) return;
    refuse(not_connected + (bags_.holds("tf_static") ? "" : bags_.adviceForLatched()));
  }

  void refuseFramesTwice() const {
    if (options_.further.empty()) return;
    const auto twice = std::adjacent_find(cubes.begin(), cubes.end(),
                                          [](const auto& a, const auto& b) { return a.stamp_ns == b.stamp_ns; });
    if (twice == cubes.end()) return;
    throw InputError(file() + ": the frame stamped " + formatStamp(twice->stamp_ns) +
                     " s is in two of the bags; give only one of those that hold the same recording");
  }

  void settle(const RecordedTf& tf, std::deque<CubeIndex>& waiting, bool last) {
    while (!waiting.empty()) {
      CubeIndex& cube = waiting.front();
      const std::int64_t reported_ns =
          cube.stamp_ns + std::llround((options_.pose_lag_s - options_.clock_offset_s) * 1e9);
      try {
        const geometry_msgs::TransformStamped T =
            tf.buffer().lookupTransform(options_.map_frame, radar_frame_, toRosTime(reported_ns));
        cube.on_the_way =
            !tf.record().whyNotBetween(reported_ns, options_.map_frame, radar_frame_, TransformLimits()).empty();
        if (!cube.on_the_way) cube.T_map_radar = fromMsg(T.transform);
      } catch (const tf2::TransformException&) {
        const bool late = tf.newest_ns() > reported_ns + static_cast<std::int64_t>(kTfPatience_s * 1e9);
        if (!last && !late) return;
      }
      cubes.push_back(cube);
      waiting.pop_front();
    }
  }

  BagSet bags_;
  BagOptions options_;
  std::mutex mutex_;
  std::string prefix_, radar_frame_;
  StampRecord frames_;
  FrameSources sources_;
  std::vector<std::string> notes_;
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
  fs::path name = fs::path(file).filename();
  if (name.extension() == ".active") name = name.stem();  // of a recorder that was cut off
  recording.name = name.stem().string();
  for (const Stretch& stretch : stretchesOf(bag)) {
    recording.poses.push_back(stretch.pose);
    recording.pose_names.push_back(stretch.pose.name);
    assigned[stretch.pose.name] = cubesOf(stretch, bag.cubes);
  }
  const auto scene = bag.scene();
  std::error_code none;
  if (scene && !scene->scene_file.empty() && fs::exists(scene->scene_file, none)) {
    recording.scene_file = scene->scene_file;
    if (!scene->twin_yaml.empty()) {
      recording.twin_file = (fs::path(folder) / "twin.yaml").string();
      std::ofstream out(*recording.twin_file, std::ios::binary | std::ios::trunc);
      out << scene->twin_yaml;
      out.close();
      if (!out) throw std::runtime_error(*recording.twin_file + ": cannot be written; check the free space");
    }
  }
  return recording;
}

std::string captureNamed(const std::string& pattern, const std::string& pose) {
  std::string file = pattern;
  return pattern.empty() ? pattern : file.replace(file.find("{pose}"), 6, pose);
}

void leaveOutUnseen(Recording& recording, const CubesByPose& assigned) {
  const auto unseen = [&](const Pose& pose) {
    return !assigned.count(pose.name) && !fs::exists(captureNamed(recording.capture_pattern, pose.name));
  };
  recording.poses.erase(std::remove_if(recording.poses.begin(), recording.poses.end(), unseen), recording.poses.end());
  if (recording.poses.empty() && recording.problems.empty()) {
    throw InputError("no frame of any of the session's " + std::to_string(recording.pose_names.size()) +
                     " poses came yet; wait for the first one, and check that tf puts the radar where poses.csv does");
  }
}

/// Names the bag in an error about what it holds.
InputError withBag(const std::string& file, const InputError& error) {
  const std::string text = error.what();
  return Output::namedIn(text).find(file) == std::string::npos ? InputError(file + ": " + text) : error;
}

}  // namespace

Recording openBag(const std::string& file, const BagOptions& options) try {
  const auto bag = std::make_shared<BagContents>(file, options);
  std::shared_ptr<TemporaryFolder> temporary;
  std::string folder = options.unpack_to;
  if (folder.empty()) {
    temporary = std::make_shared<TemporaryFolder>();
    folder = temporary->path();
  }
  fs::create_directories(folder);
  Output::showAs(folder, file);
  auto assigned = std::make_shared<CubesByPose>();
  Recording recording =
      bag->session ? fromSessionMessage(*bag, folder, *assigned) : fromStretches(*bag, file, folder, *assigned);
  if (options.seen_only && bag->session) leaveOutUnseen(recording, *assigned);
  recording.source = file;
  recording.radar = bag->radar;
  recording.radar_file = bag->label();
  if (recording.poses.empty() && recording.problems.empty()) {
    throw InputError(bag->file() + ": " + bag->whyNoPose());
  }
  if (options.on_note) {
    for (const std::string& note : bag->notes()) options.on_note(file + ": " + note);
  }
  if (options.exclude_duplicates) excludeDuplicates(recording);
  recording.captureOf = {};  // frames come as cubes
  recording.begins_within.reset();
  recording.forEachFrame = [bag, temporary, assigned, from_files = recording.forEachFrame,
                            pattern = recording.capture_pattern](const Pose& pose,
                                                                 const std::function<void(const AdcCube&)>& visit) {
    const auto cubes = assigned->find(pose.name);
    if (cubes != assigned->end() && !cubes->second.empty()) return bag->forEachFrame(pose.name, cubes->second, visit);
    if (fs::exists(captureNamed(pattern, pose.name))) return from_files(pose, visit);
    throw InputError(bag->file() + ": pose '" + pose.name +
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
    later.on_note = nullptr;  // once is enough
    return openBag(file, later);
  };
  return recording;
} catch (const ros::Exception& error) {
  throw damagedBag(file, error);
} catch (const InputError& error) {
  throw withBag(file, error);
}

namespace {

/// By its name or by its bytes: what is called a bag and is none shall be told so.
bool meansBag(const std::string& path) {
  if (fs::is_directory(path)) return false;
  if (isBag(path) || !whyNoBag(path).empty()) return true;
  std::string name = fs::path(path).filename().string();
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto ends = [&name](const std::string& end) {
    return name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0;
  };
  return ends(".bag") || ends(".bag.active");
}

Recording openBagOf(const std::string& path, const std::string& radar, BagOptions options) {
  if (!radar.empty() && options.ns.empty() && !fs::is_regular_file(radar) && fs::path(radar).extension().empty()) {
    options.ns = radar;
  } else if (!radar.empty() && normalNamespace(radar) != normalNamespace(options.ns)) {
    throw InputError(path + ": a bag brings its own radar; --radar is of it the namespace of one of several radars " +
                     "(/left), not a file");
  }
  return openBag(path, options);
}

std::string firstBytes(const std::string& file) {
  constexpr std::size_t kEnough = 4096;
  std::string bytes(kEnough, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(in.gcount()));
  return bytes;
}

/// By its name or by its bytes, which are no text's.
bool meansCapture(const std::string& path) {
  if (fs::is_directory(path)) return false;
  if (fs::path(path).extension() == ".bin") return true;
  const std::string bytes = firstBytes(path);
  const bool binary =
      std::any_of(bytes.begin(), bytes.end(), [](unsigned char c) { return c < 0x20 && !std::isspace(c); });
  if (!binary) return false;
  const std::string kind = foreignKind(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  if (!kind.empty()) throw InputError(path + ": is " + kind);
  return true;
}

/// A text under another name than session.yaml shall say that it is one.
void refuseOtherText(const std::string& path) {
  if (fs::is_directory(path) || fs::path(path).filename() == "session.yaml") return;
  if (firstBytes(path).find("mmradartwin_session") != std::string::npos) return;
  throw InputError(path +
                   ": is a text and no session.yaml, which has a line format: mmradartwin_session/1; give a "
                   "session directory, a bag or a capture");
}

[[noreturn]] void refuseFolderOfBags(const std::string& folder) {
  std::vector<std::string> bags;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (isBag(entry.path().string())) bags.push_back(entry.path().string());
  }
  std::sort(bags.begin(), bags.end());
  const std::string other = whyNoBag(folder);
  if (!other.empty()) throw InputError(folder + ": " + other);
  if (bags.empty()) openSession(folder);  // says that it is none
  throw InputError(folder + ": folder holds no session.yaml but " + std::to_string(bags.size()) +
                   " bag(s); give those that are one recording: " + join(bags, " "));
}

}  // namespace

Recording openRecording(const std::string& path, const std::string& radar_file,
                        const std::optional<CaptureLayout>& layout, const BagOptions& bag_options) {
  if (!fs::exists(path)) {
    throw InputError(path + ": no such file or folder; give a session directory, a bag or a capture");
  }
  requireRegularFile(path);
  if (meansBag(path)) {
    if (layout) throw InputError(path + ": a bag holds cubes, not captures; leave --layout out");
    return openBagOf(path, radar_file, bag_options);
  }
  if (!bag_options.further.empty()) {
    throw InputError(path + ": is no bag, and only bags are read together; give one session or capture");
  }
  if (fs::is_directory(path) && !fs::exists(fs::path(path) / "session.yaml")) refuseFolderOfBags(path);
  if (meansCapture(path)) {
    if (radar_file.empty())
      throw InputError(path + ": a bare capture needs a radar description; give --radar radar.yaml");
    RadarConfig radar = loadRadarConfig(radar_file);
    if (layout) radar.layout = *layout;
    return openCapture(path, radar);
  }
  refuseOtherText(path);
  SessionOptions options;
  options.radar_file = radar_file;
  options.layout = layout;
  options.exclude_duplicates = bag_options.exclude_duplicates;
  options.need_captures = bag_options.need_captures;
  return openSession(path, options);
}

}  // namespace mmradartwin
