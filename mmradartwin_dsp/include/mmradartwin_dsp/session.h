#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/adc_cube.h"
#include "mmradartwin_dsp/channel_correction.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

class CaptureReader;

struct Pose {
  std::string name;
  std::string location;
  std::int64_t stamp_ns = 0;  ///< start of the first frame
  Eigen::Isometry3d T_map_radar = Eigen::Isometry3d::Identity();
};

/// Where the radar was at one frame.
struct StampedTransform {
  std::int64_t stamp_ns = 0;
  Eigen::Isometry3d T_map_radar = Eigen::Isometry3d::Identity();
};

/// What was left out or is wrong with one pose; the others go on.
struct PoseProblem {
  std::string pose;
  std::string message;  ///< one line for the user
};

/// What a poses.csv says.
struct PoseTable {
  std::vector<std::string> names;     ///< of all rows, in file order
  std::vector<Pose> poses;            ///< of the rows that can be used
  std::vector<PoseProblem> problems;  ///< of the others
};

/// A recorded session, whatever it was read from: a session directory, a bag, a bare capture.
struct Recording {
  std::string source;  ///< path it was read from
  std::string name;    ///< of the session
  RadarConfig radar;
  std::string radar_file;                     ///< path or label, for errors
  std::optional<std::string> scene_file;      ///< absolute path of scene.yaml, where the session names one
  std::optional<std::string> twin_file;       ///< absolute path of twin.yaml, where the session names one
  std::optional<double> gain_db;              ///< of a simulated session
  std::map<std::string, double> accuracy;     ///< what the session states of its ground, by key (StatedAccuracy)
  std::optional<ChannelCorrection> channels;  ///< what averages of its frames are corrected by; set by the user
  std::vector<Pose> poses;                    ///< in file order, duplicates and unusable ones left out
  std::vector<std::string> duplicates;        ///< names of excluded poses (10 cm, 2 cm, 1 deg of an earlier one)
  std::vector<PoseProblem> problems;          ///< poses that cannot be used (NaN, unreadable, ...)
  std::vector<std::string> pose_names;        ///< every pose that the session names, in its order
  std::string capture_pattern;                ///< path of a capture, {pose} for the name; "" without files
  /// Visits the frames of a pose in order. Throws InputError where its capture is missing or damaged; TruncatedCapture
  /// where it holds no whole number of frames, after the whole ones where most captures of the session are whole.
  std::function<void(const Pose&, const std::function<void(const AdcCube&)>&)> forEachFrame;
  /// The capture of a pose, a rest beyond whole frames left out; throws InputError. Empty without files.
  std::function<CaptureReader(const Pose&)> captureOf;
  /// By pose, how many bytes into a frame its capture begins: what forEachFrame reads it by. Empty without files.
  std::shared_ptr<std::map<std::string, std::size_t>> begins_within;
  bool aligned_by_user = false;  ///< that is by the user's wish, and no finding
  /// Of a bag, of every frame in order of time, on the way from pose to pose, too; else empty, and so are the next two.
  std::vector<StampedTransform> track;
  /// Visits the frames stamped from first_ns to last_ns, on the way or not, in order.
  std::function<void(std::int64_t first_ns, std::int64_t last_ns, const std::function<void(const AdcCube&)>&)>
      forEachFrameBetween;
  /// The same recording with each frame's pose looked up by so much later than its stamp, beyond what it was before.
  std::function<Recording(double lag_s)> withPoseLag;
};

/// How openSession reads a session.
struct SessionOptions {
  bool need_captures = true;  ///< false to simulate: poses are then not checked for overlap in time
  bool exclude_duplicates = true;
  std::string radar_file;               ///< instead of the one that the session names
  std::optional<CaptureLayout> layout;  ///< instead of the radar's
};
/// Reads a session directory (or its session.yaml). Throws InputError for what makes the whole session unusable
/// (unknown keys, missing radar.yaml, unreadable poses.csv, poses that overlap in time); what concerns one pose only
/// goes to `problems`.
Recording openSession(const std::string& path, const SessionOptions& options = {});

/// Reads the text of a poses.csv. Throws InputError, which names `file`, for a wrong header, a row without 10 fields, a
/// name that is unusable or stands twice, and no row at all.
PoseTable parsePoses(const std::string& csv, const std::string& file);

/// A bare capture: one pose named after the file, at the origin.
Recording openCapture(const std::string& file, const RadarConfig& radar);

/// True within 10 cm horizontally, 2 cm in height and 1 deg in heading: a duplicate (docs/reference/contracts.md
/// section 5).
bool sameView(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b);
/// Moves the later of each such pair from poses to duplicates.
void excludeDuplicates(Recording& recording);

/// Resolves a path of a session file: relative to `base_file`'s folder, absolute, or package://pkg/rest
/// (looked up in ROS_PACKAGE_PATH and CMAKE_PREFIX_PATH).
std::string resolvePath(const std::string& path, const std::string& base_file);

/// Writes a session directory that openSession reads back.
class SessionWriter {
 public:
  struct Files {  ///< texts; scene and twin optional
    std::string radar_yaml;
    std::optional<std::string> scene;  ///< path as it is to stand in session.yaml
    std::optional<std::string> twin;
    std::optional<double> gain_db;
  };
  SessionWriter(const std::string& directory, const RadarConfig& radar, const Files& files);
  void add(const Pose& pose, const std::vector<AdcCube>& cubes);
  /// Writes poses.csv and session.yaml; last, so that an unfinished session is recognisable.
  void finish();

 private:
  std::string directory_;
  RadarConfig radar_;
  Files files_;
  std::vector<Pose> poses_;
};

/// Stamps are read and written exactly: "1700000000.25" <-> 1700000000250000000.
std::int64_t parseStamp_ns(const std::string& text);
std::string formatStamp(std::int64_t stamp_ns);
/// Shortest decimal that reads back as exactly `value`.
std::string formatExact(double value);

}  // namespace mmradartwin
