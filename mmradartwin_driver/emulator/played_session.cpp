#include "played_session.h"

#include <filesystem>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// Whole frames in a capture; throws InputError where there are none.
std::int64_t countFrames(const RadarConfig& radar, const std::string& file) {
  requireRegularFile(file);
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) throw InputError(file + ": capture cannot be read: " + error.message());
  const std::uintmax_t frame = radar.bytes_per_frame();
  if (size == 0 || size % frame != 0) {
    throw InputError(file + ": " + std::to_string(size) + " bytes are no whole number of frames of " +
                     std::to_string(frame) +
                     " bytes: give the radar.yaml that it was recorded with, or record it again");
  }
  return static_cast<std::int64_t>(size / frame);
}

}  // namespace

PlayedSession openPlayedSession(const std::string& path, const std::string& radar_file,
                                const PlayedSelection& selection) {
  PlayedSession played;
  if (!radar_file.empty()) {
    played.radar = loadRadarConfig(radar_file);
    PlayedPose whole;
    whole.pose.name = fs::path(path).stem().string();
    whole.capture = path;
    whole.frames = played.frames = countFrames(played.radar, path);
    played.poses.push_back(whole);
    return played;
  }
  const Recording session = openSession(path);
  const fs::path file = fs::is_directory(path) ? fs::path(path) / "session.yaml" : fs::path(path);
  played.directory = fs::absolute(file).parent_path().string();
  played.radar = session.radar;
  played.problems = session.problems;
  const std::string& pattern = session.capture_pattern;
  for (std::size_t i = selection.first; i < session.poses.size(); i += selection.every) {
    if (selection.count > 0 && static_cast<int>(played.poses.size()) == selection.count) break;
    PlayedPose pose;
    pose.pose = session.poses[i];
    pose.capture = pattern;
    pose.capture.replace(pattern.find("{pose}"), 6, pose.pose.name);
    pose.first_frame = played.frames;
    try {
      pose.frames = countFrames(played.radar, pose.capture);
    } catch (const InputError& error) {
      played.problems.push_back({pose.pose.name, error.what()});
      continue;
    }
    played.frames += pose.frames;
    played.poses.push_back(pose);
  }
  if (played.poses.empty()) {
    if (!played.problems.empty()) {
      throw InputError(path + ": no pose to play; the first problem: " + played.problems.front().message);
    }
    throw InputError(path + ": no pose to play: " + std::to_string(session.poses.size()) +
                     " poses are usable, playing was to begin with number " + std::to_string(selection.first));
  }
  return played;
}

}  // namespace mmradartwin
