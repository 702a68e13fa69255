#pragma once

#include <string>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

struct BagOptions {
  std::string map_frame = "map";
  std::string radar_frame = "radar_link";
  std::string ns;                       ///< namespace of the topics, "" or "/robot1"
  std::string unpack_to;                ///< where the session message's files are written; "" = a fresh temporary folder
};

/// Opens a bag as a Recording. With a `session` message its poses.csv defines the poses; otherwise a pose is a stretch
/// of at least 1 s in which T_map_radar stays within 2 cm and 1 deg of its median, poses within 10 cm horizontally share
/// a location. Throws InputError for a bag without radar configuration, cubes or tf.
Recording openBag(const std::string& file, const BagOptions& options = {});

/// Opens whatever PATH is: session directory or session.yaml, *.bag, or (with `radar_file`) a bare *.bin capture.
Recording openRecording(const std::string& path, const std::string& radar_file = "");

void sessionToBag(const std::string& session, const std::string& bag);
/// Inverse of sessionToBag, byte for byte; from any other bag, a session with the poses found in it.
void bagToSession(const std::string& bag, const std::string& directory);

}  // namespace mmradartwin
