#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

struct BagOptions {
  std::string map_frame = "map";
  std::string radar_frame;  ///< "": the one that the frames name, where tf knows it, else radar_link
  std::string ns;           ///< namespace of the topics, "/" or "/robot1"; "" finds the only one there is
  /// Bags that are read as one with the first, by the time of recording: the other parts of a split recording.
  std::vector<std::string> further;
  /// Where the session message's files are written; "" = a fresh temporary folder, which goes with the last copy of the
  /// Recording.
  std::string unpack_to;
  bool exclude_duplicates = true;
  bool need_captures = true;  ///< of a session that is no bag; false to simulate its poses
  /// Of the session message's poses only those of which the bag holds frames; the others are otherwise errors where
  /// they are read.
  bool seen_only = false;
  /// By which tf is stamped later than the truth: a frame's pose is looked up so much later than its stamp.
  double pose_lag_s = 0;
  /// By which frames are stamped later than tf, of two computers' clocks: a frame's pose is looked up so much earlier.
  double clock_offset_s = 0;
  /// Is told what is odd in the bag and does no harm, one line each.
  std::function<void(const std::string& note)> on_note;
};

/// Opens a bag as a Recording. With a `session` message its poses.csv defines the poses; otherwise a pose is a stretch
/// of at least 1 s in which T_map_radar stays within 2 cm and 1 deg of its median, poses within 10 cm horizontally
/// share a location. Throws InputError for a bag without radar configuration, cubes or tf, with frames of several
/// radars where none is named, with stamps that tell no time, with clocks of frames and tf that differ by seconds, and
/// where tf contradicts itself about a frame between the two (transform_sources.h).
///
/// Frames belong to the session's pose that began last, by stamp, as long as tf (where it is known) agrees with it.
/// Where no frame falls on any pose, as in a live recording of a session that was played at another time, the stretches
/// found in tf take the names of the session's poses at those places.
Recording openBag(const std::string& file, const BagOptions& options = {});

/// Opens whatever PATH is: session directory or session.yaml, a bag, or (with `radar_file`) a bare capture; files are
/// known by their first bytes. `radar_file` and `layout` replace what a session says. A bag brings its radar: of it,
/// `radar_file` is the namespace of one of several radars, as bag_options.ns; it takes no layout.
Recording openRecording(const std::string& path, const std::string& radar_file = "",
                        const std::optional<CaptureLayout>& layout = std::nullopt, const BagOptions& bag_options = {});

/// Called after each pose with how many are done, and of how many.
using PoseProgress = std::function<void(int done, int total)>;

/// Writes a session as a bag: the latched `session` message (session_files.h says which files it holds and how those
/// from outside of the directory fare), latched `radar/config`, one `radar/adc` message per frame, and T_map_radar in
/// /tf a quarter of a period before the first frame and after every frame of a pose, so that a replay need not wait for
/// the pose's end. All poses are written, duplicates too; captures that cubes cannot carry (truncated ones, those of
/// unusable poses) travel as files in the session message. Messages are recorded at their stamps. Returns the poses
/// that are unusable, or whose captures are missing or truncated.
std::vector<PoseProblem> sessionToBag(const std::string& session, const std::string& bag,
                                      const PoseProgress& progress = {});

/// Inverse of sessionToBag, byte for byte; from any other bag, a session with the poses found in it. Throws InputError
/// where the directory holds a session already. Returns the poses whose captures are not what the session message says
/// (frames were lost or cut out of the bag).
std::vector<PoseProblem> bagToSession(const std::string& bag, const std::string& directory,
                                      const PoseProgress& progress = {}, const BagOptions& options = {});

}  // namespace mmradartwin
