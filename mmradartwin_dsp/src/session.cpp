#include "mmradartwin_dsp/session.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <set>
#include <sstream>

#include "files/text_file.h"
#include "mmradartwin_dsp/bag_kind.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/csv_reader.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr char kPoseColumns[] = "pose,location,stamp,x,y,z,qx,qy,qz,qw";
constexpr double kDuplicateHorizontal_m = 0.10;
constexpr double kDuplicateHeight_m = 0.02;
constexpr double kDuplicateHeading_rad = M_PI / 180;
constexpr double kQuaternionTolerance = 1e-3;
/// Stamps typed with microseconds are rounded; poses recorded back to back must not fail for it.
constexpr std::int64_t kOverlapTolerance_ns = 1000;

/// Names of files have at most 255 bytes, and pictures, records and unfinished files add to a pose's.
constexpr std::size_t kLongestName_bytes = 200;

/// Empty where `name` may name a file, else why not.
std::string unusableName(const std::string& name) {
  if (name.empty()) return "has no name";
  if (name.front() == '.') return "has a name that begins with a dot; captures and maps are files of that name";
  if (name.find_first_of("/\\") != std::string::npos) {
    return "has a slash in its name; captures and maps are files of that name";
  }
  if (name.size() > kLongestName_bytes) {
    return "has a name of " + std::to_string(name.size()) + " bytes; allowed: " + std::to_string(kLongestName_bytes) +
           "; captures and maps are files of that name";
  }
  if (!isPlainText(name)) return "has a name that is no UTF-8 text, or holds control characters; write it anew";
  return "";
}

/// The pose of a row; throws InputError for what is wrong with it alone.
Pose readRow(const CsvReader& row) {
  Pose pose;
  pose.name = row.fields()[0];
  pose.location = row.fields()[1];
  if (pose.location.empty()) throw row.error("location is empty; name the spot, poses of one spot share it");
  if (pose.location.size() > kLongestName_bytes || !isPlainText(pose.location)) {
    throw row.error("location '" + shownShort(pose.location) + "' is no UTF-8 text of at most " +
                    std::to_string(kLongestName_bytes) + " bytes; name the spot anew");
  }
  try {
    pose.stamp_ns = parseStamp_ns(row.fields()[2]);
  } catch (const InputError& error) {
    throw row.error(error.what());
  }
  double values[7];
  for (std::size_t i = 0; i < 7; ++i) values[i] = row.number(3 + i);
  const Eigen::Quaterniond q(values[6], values[3], values[4], values[5]);
  if (std::abs(q.norm() - 1) > kQuaternionTolerance) {
    std::ostringstream message;
    message << "quaternion qx,qy,qz,qw has norm " << q.norm() << "; allowed: 0.999 to 1.001; correct or remove the row";
    throw row.error(message.str());
  }
  pose.T_map_radar = Eigen::Translation3d(values[0], values[1], values[2]) * q.normalized();
  return pose;
}

std::string captureFile(const std::string& pattern, const std::string& pose) {
  std::string file = pattern;
  return file.replace(file.find("{pose}"), 6, pose);
}

/// Captures of poses are no parts of each other.
OtherCaptures capturesOf(const std::vector<std::string>& poses, const std::string& pattern) {
  auto files = std::make_shared<std::set<std::string>>();
  for (const std::string& pose : poses) files->insert(fs::path(captureFile(pattern, pose)).lexically_normal().string());
  return [files](const std::string& file) { return files->count(fs::path(file).lexically_normal().string()) > 0; };
}

/// Bytes of samples of a capture; 0 where it is missing (reading it says so).
std::uintmax_t captureBytes(const RadarConfig& radar, const std::string& file, const OtherCaptures& others) {
  std::uintmax_t size = 0;
  try {
    for (const std::string& part : captureParts(file, others)) {
      std::error_code error;
      const std::uintmax_t bytes = fs::file_size(part, error);
      if (error) return 0;
      size += bytes;
    }
    // Heads of packets seldom fill whole frames.
    if (size % radar.bytes_per_frame() != 0 && size > radar.bytes_per_frame()) {
      return CaptureReader(radar, file, CaptureReader::Rest::kLeftOut, others).size();
    }
  } catch (const InputError&) {
    return 0;
  }
  return size;
}

/// Where most captures hold no whole number of frames, they are of another radar.
bool mostAreOfWholeFrames(const Recording& recording, const std::string& pattern, const OtherCaptures& others) {
  const auto whole = std::count_if(recording.poses.begin(), recording.poses.end(), [&](const Pose& pose) {
    return captureBytes(recording.radar, captureFile(pattern, pose.name), others) % recording.radar.bytes_per_frame() ==
           0;
  });
  return 2 * static_cast<std::size_t>(whole) > recording.poses.size();
}

void rejectOverlap(const Recording& recording, const std::string& pattern, const OtherCaptures& others,
                   const std::string& poses_file) {
  std::vector<const Pose*> by_time;
  for (const Pose& pose : recording.poses) by_time.push_back(&pose);
  std::stable_sort(by_time.begin(), by_time.end(),
                   [](const Pose* a, const Pose* b) { return a->stamp_ns < b->stamp_ns; });
  for (std::size_t i = 0; i + 1 < by_time.size(); ++i) {
    const Pose& pose = *by_time[i];
    const Pose& next = *by_time[i + 1];
    const std::uintmax_t bytes = captureBytes(recording.radar, captureFile(pattern, pose.name), others);
    const auto frames = static_cast<std::int64_t>(bytes / recording.radar.bytes_per_frame());
    const std::int64_t end_ns = pose.stamp_ns + recording.radar.frame_offset_ns(frames);
    if (next.stamp_ns < end_ns - kOverlapTolerance_ns) {
      throw InputError(poses_file + ": poses '" + pose.name + "' and '" + next.name +
                       "' overlap in time: " + std::to_string(frames) + " frames from " + formatStamp(pose.stamp_ns) +
                       " last until " + formatStamp(end_ns) + ", the next begins at " + formatStamp(next.stamp_ns) +
                       "; correct the stamps or frame_period_s");
    }
  }
}

/// Lets a recording read its frames from capture files.
void readFromFiles(Recording& recording, const std::string& pattern, const std::string& session,
                   const OtherCaptures& others) {
  const auto rest = !pattern.empty() && mostAreOfWholeFrames(recording, pattern, others)
                        ? CaptureReader::Rest::kLeftOut
                        : CaptureReader::Rest::kRefused;
  recording.begins_within = std::make_shared<std::map<std::string, std::size_t>>();
  const auto open = [radar = recording.radar, pattern, session, others](const Pose& pose, CaptureReader::Rest beyond) {
    if (pattern.empty()) throw InputError(session + ": pose '" + pose.name + "': the session names no captures");
    try {
      return CaptureReader(radar, captureFile(pattern, pose.name), beyond, others);
    } catch (const TruncatedCapture& error) {
      throw TruncatedCapture("pose '" + pose.name + "': " + error.what());
    } catch (const InputError& error) {
      throw InputError("pose '" + pose.name + "': " + error.what());
    }
  };
  if (!pattern.empty()) {
    recording.captureOf = [open](const Pose& pose) { return open(pose, CaptureReader::Rest::kLeftOut); };
  }
  recording.forEachFrame = [open, begins = recording.begins_within, rest](
                               const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
    const auto within = begins->find(pose.name);
    CaptureReader reader = open(pose, within != begins->end() ? CaptureReader::Rest::kLeftOut : rest);
    if (within != begins->end()) reader.beginWithin(within->second);
    try {
      for (int i = 0; i < reader.frames(); ++i) visit(reader.frame(i, pose.stamp_ns));
      reader.requireWholeFrames();
    } catch (const TruncatedCapture& error) {
      throw TruncatedCapture("pose '" + pose.name + "': " + error.what());
    } catch (const InputError& error) {
      throw InputError("pose '" + pose.name + "': " + error.what());
    }
  };
}

}  // namespace

bool sameView(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Vector3d step = a.translation() - b.translation();
  const Eigen::Vector3d ahead_a = a.linear().col(0), ahead_b = b.linear().col(0);
  const double turn = std::atan2(ahead_a.y(), ahead_a.x()) - std::atan2(ahead_b.y(), ahead_b.x());
  return step.head<2>().norm() <= kDuplicateHorizontal_m && std::abs(step.z()) <= kDuplicateHeight_m &&
         std::abs(std::remainder(turn, 2 * M_PI)) <= kDuplicateHeading_rad;
}

void excludeDuplicates(Recording& recording) {
  std::vector<std::size_t> by_time(recording.poses.size());
  std::iota(by_time.begin(), by_time.end(), 0);
  std::stable_sort(by_time.begin(), by_time.end(), [&](std::size_t a, std::size_t b) {
    return recording.poses[a].stamp_ns < recording.poses[b].stamp_ns;
  });
  std::vector<std::size_t> kept;
  std::set<std::size_t> excluded;
  for (const std::size_t i : by_time) {
    const bool duplicate = std::any_of(kept.begin(), kept.end(), [&](std::size_t earlier) {
      return sameView(recording.poses[earlier].T_map_radar, recording.poses[i].T_map_radar);
    });
    duplicate ? (void)excluded.insert(i) : kept.push_back(i);
  }
  std::vector<Pose> poses;
  for (std::size_t i = 0; i < recording.poses.size(); ++i) {
    if (excluded.count(i)) {
      recording.duplicates.push_back(recording.poses[i].name);
    } else {
      poses.push_back(recording.poses[i]);
    }
  }
  recording.poses = std::move(poses);
}

Recording openSession(const std::string& path, const SessionOptions& options) {
  std::error_code error;
  const fs::path file = fs::is_directory(path, error) ? fs::path(path) / "session.yaml" : fs::path(path);
  if (!fs::exists(file, error)) {
    throw InputError(file.string() +
                     ": no such session; give a folder that holds a session.yaml (an unfinished recording has none)");
  }
  if (isBag(file.string())) {
    throw InputError(path + ": is a bag, and a session is asked for; make one of it by bag_to_session");
  }
  YamlMap yaml = YamlMap::load(file.string());
  yaml.choice("format", {"mmradartwin_session/1"});
  Recording recording;
  recording.source = path;
  recording.name = fs::weakly_canonical(fs::absolute(file)).parent_path().filename().string();
  recording.radar_file = resolvePath(yaml.text("radar"), file.string());
  if (!options.radar_file.empty()) recording.radar_file = options.radar_file;
  const std::string poses_file = resolvePath(yaml.text("poses"), file.string());
  if (yaml.has("scene")) recording.scene_file = resolvePath(yaml.text("scene"), file.string());
  if (yaml.has("twin")) recording.twin_file = resolvePath(yaml.text("twin"), file.string());
  if (yaml.has("accuracy")) recording.accuracy = readStatedAccuracy(yaml.map("accuracy"));
  if (yaml.has("gain_db")) recording.gain_db = yaml.number("gain_db", -400, 400);
  std::string pattern;
  if (yaml.has("captures") || options.need_captures) {
    pattern = yaml.text("captures");
    if (pattern.find("{pose}") == std::string::npos) {
      yaml.fail("captures", "'" + pattern + "' must contain {pose}, the place of the pose's name");
    }
    pattern = resolvePath(pattern, file.string());
  }
  yaml.rejectUnknownKeys();
  recording.radar = loadRadarConfig(recording.radar_file);
  if (options.layout) recording.radar.layout = *options.layout;
  recording.capture_pattern = pattern;
  PoseTable table =
      parsePoses(readTextFile(poses_file, "put the poses there or correct key poses in session.yaml"), poses_file);
  recording.poses = std::move(table.poses);
  recording.problems = std::move(table.problems);
  recording.pose_names = std::move(table.names);
  const OtherCaptures others = pattern.empty() ? OtherCaptures() : capturesOf(recording.pose_names, pattern);
  if (options.need_captures) rejectOverlap(recording, pattern, others, poses_file);
  if (options.exclude_duplicates) excludeDuplicates(recording);

  readFromFiles(recording, pattern, file.string(), others);
  return recording;
}

Recording openCapture(const std::string& file, const RadarConfig& radar) {
  // Nobody has named another capture.
  const OtherCaptures others = [](const std::string&) { return false; };
  Recording recording;
  recording.source = file;
  recording.name = fs::path(file).stem().string();
  recording.radar = radar;
  recording.radar_file = file;
  Pose pose;
  pose.name = pose.location = recording.name;
  recording.pose_names.push_back(pose.name);
  recording.poses.push_back(pose);
  recording.begins_within = std::make_shared<std::map<std::string, std::size_t>>();
  // A rest is refused at once, unless the capture only begins and ends within a frame, which its bytes tell.
  recording.captureOf = [radar, file, others](const Pose&) {
    return CaptureReader(radar, file, CaptureReader::Rest::kLeftOut, others);
  };
  recording.captureOf(pose);
  recording.forEachFrame = [open = recording.captureOf, begins = recording.begins_within](
                               const Pose& pose, const std::function<void(const AdcCube&)>& visit) {
    CaptureReader reader = open(pose);
    const auto within = begins->find(pose.name);
    within != begins->end() ? reader.beginWithin(within->second) : reader.requireWholeFrames();
    for (int i = 0; i < reader.frames(); ++i) visit(reader.frame(i, pose.stamp_ns));
  };
  return recording;
}

PoseTable parsePoses(const std::string& csv, const std::string& file) {
  PoseTable table;
  CsvReader reader(csv, file);
  reader.requireColumns(kPoseColumns);
  std::set<std::string> names;
  while (reader.next()) {
    const std::string name = reader.fields()[0], pose = "pose '" + name + "'";
    const std::string unusable = unusableName(name);
    if (!unusable.empty()) throw reader.error("pose '" + shownShort(name) + "' " + unusable);
    if (!names.insert(name).second) throw reader.error(pose + " stands twice; every pose needs a name of its own");
    table.names.push_back(name);
    reader.callRow(pose);
    try {
      table.poses.push_back(readRow(reader));
    } catch (const InputError& error) {
      table.problems.push_back({name, error.what()});
    }
  }
  if (names.empty()) throw InputError(file + ": holds no poses; write one row per pose");
  return table;
}

std::int64_t parseStamp_ns(const std::string& text) {
  const auto bad = [&text](const std::string& why) {
    return InputError("stamp '" + text.substr(0, 40) + "' " + why +
                      "; write seconds as in 1700000000.25, allowed: 0 to 4294967295");
  };
  const std::size_t point = text.find('.');
  const std::string whole = text.substr(0, point);
  std::string fraction = point == std::string::npos ? "" : text.substr(point + 1);
  const auto digits = [](const std::string& s) {
    return std::all_of(s.begin(), s.end(), [](char c) { return c >= '0' && c <= '9'; });
  };
  if (whole.empty() || !digits(whole) || !digits(fraction)) throw bad("is no decimal number of seconds");
  // Beyond nanoseconds is rounding noise of whoever printed a double.
  const bool round_up = fraction.size() > 9 && fraction[9] >= '5';
  fraction.resize(9, '0');
  std::int64_t seconds = 0;
  const auto result = std::from_chars(whole.data(), whole.data() + whole.size(), seconds);
  if (result.ec != std::errc() || seconds > 4294967295LL) throw bad("is out of range");
  return seconds * 1000000000LL + std::stoll(fraction) + (round_up ? 1 : 0);
}

std::string formatStamp(std::int64_t stamp_ns) {
  std::string fraction = std::to_string(1000000000LL + stamp_ns % 1000000000LL).substr(1);
  fraction.erase(fraction.find_last_not_of('0') + 1);
  return std::to_string(stamp_ns / 1000000000LL) + (fraction.empty() ? "" : "." + fraction);
}

std::string formatExact(double value) {
  char buffer[64];
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr);
}

namespace {

void writeText(const fs::path& file, const std::string& text) {
  std::ofstream out(file, std::ios::binary | std::ios::trunc);
  out << text;
  out.close();
  if (!out) throw std::runtime_error(file.string() + ": cannot be written; check folder, rights and free space");
}

}  // namespace

SessionWriter::SessionWriter(const std::string& directory, const RadarConfig& radar, const Files& files)
    : directory_(directory), radar_(radar), files_(files) {
  std::error_code error;
  fs::create_directories(fs::path(directory) / "captures", error);
  if (error)
    throw InputError(directory + ": folder cannot be made (" + error.message() + "); give one that can be written");
  fs::remove(fs::path(directory) / "session.yaml", error);
  writeText(fs::path(directory) / "radar.yaml", files_.radar_yaml);
}

void SessionWriter::add(const Pose& pose, const std::vector<AdcCube>& cubes) {
  const std::string unusable = unusableName(pose.name);
  if (!unusable.empty() || pose.name.find(',') != std::string::npos) {
    throw InputError("pose '" + shownShort(pose.name) + "' " +
                     (unusable.empty() ? "has a comma in its name" : unusable));
  }
  writeCapture(radar_, cubes, (fs::path(directory_) / "captures" / (pose.name + ".bin")).string());
  poses_.push_back(pose);
}

void SessionWriter::finish() {
  std::string csv = std::string(kPoseColumns) + "\n";
  for (const Pose& pose : poses_) {
    const Eigen::Vector3d& p = pose.T_map_radar.translation();
    const Eigen::Quaterniond q(pose.T_map_radar.linear());
    csv += pose.name + "," + pose.location + "," + formatStamp(pose.stamp_ns);
    for (const double value : {p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()}) csv += "," + formatExact(value);
    csv += "\n";
  }
  writeText(fs::path(directory_) / "poses.csv", csv);
  std::string yaml = "format: mmradartwin_session/1\nradar: radar.yaml\n";
  if (files_.scene) yaml += "scene: " + yamlText(*files_.scene) + "\n";
  if (files_.twin) yaml += "twin: " + yamlText(*files_.twin) + "\n";
  yaml += "poses: poses.csv\ncaptures: captures/{pose}.bin\n";
  if (files_.gain_db) yaml += "gain_db: " + formatExact(*files_.gain_db) + "\n";
  writeText(fs::path(directory_) / "session.yaml", yaml);
}

}  // namespace mmradartwin
