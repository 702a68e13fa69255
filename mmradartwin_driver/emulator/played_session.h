#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// What is played of a session or a bare capture: frames back to back, pose after pose. Emulator and player read the
/// same arguments and so come to the same list.
struct PlayedPose {
  Pose pose;
  std::string capture;  ///< file
  std::int64_t frames = 0;
  std::int64_t first_frame = 0;  ///< its place in the stream
};
struct PlayedSession {
  std::string directory;  ///< of session.yaml; empty for a bare capture
  RadarConfig radar;
  std::vector<PlayedPose> poses;
  std::vector<PoseProblem> problems;  ///< poses that were left out
  std::int64_t frames = 0;
};
struct PlayedSelection {
  int first = 0;  ///< index of the first pose played
  int every = 1;  ///< then each so-manieth
  int count = 0;  ///< at most; 0: all
};

/// `radar_file` names the radar.yaml of a bare capture; a session brings its own. Throws InputError.
PlayedSession openPlayedSession(const std::string& path, const std::string& radar_file,
                                const PlayedSelection& selection);

}  // namespace mmradartwin
