#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

/// A file that a result depends on.
struct InputFile {
  std::string file;
  std::string sha256;  ///< hexadecimal
};

/// Files behind a recording and a model: all of a session directory or the bag, scene, its meshes and materials, radar
/// and twin. Files that are missing are left out (their absence is an error elsewhere).
std::vector<std::string> inputFiles(const std::string& recording_path, const Recording& recording,
                                    const std::vector<std::string>& more);
/// Reads and hashes files, several at a time, in the given order. Throws InputError for one that cannot be read.
std::vector<InputFile> hashFiles(const std::vector<std::string>& files);

/// Description of a run that stands beside its results, so that the run can be repeated.
struct RunDescription {
  std::vector<std::string> command;
  std::string recording;                                ///< as given
  std::string simulated;                                ///< "twin", or the path of the simulated session
  std::string version;                                  ///< git describe at configure time, or the package's version
  std::string attribution_yaml, radar_yaml, twin_yaml;  ///< resolved; twin empty where there is none
  std::vector<InputFile> inputs;
};

std::string packageVersion();

}  // namespace mmradartwin
