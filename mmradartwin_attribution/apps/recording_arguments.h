#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/ros/bag.h"
#include "mmradartwin_sim/twin.h"

namespace CLI {
class App;
}

namespace mmradartwin {

/// What evaluate, diagnose and calibrate take alike: a recording and what stands beside it.
struct RecordingArguments {
  std::string twin, scene, radar, layout, channels, templates;
  std::vector<std::string> recordings;  ///< several bags are read as one
  BagOptions bag;
  std::string plugins;
  bool align = false;

  /// Adds the argument RECORDING, --twin, --scene, --radar, --layout and --align, and what is taken of bags.
  void addTo(CLI::App& app);
  /// Adds --channels.
  void addChannelsTo(CLI::App& app);
  /// Adds --report-templates.
  void addTemplatesTo(CLI::App& app);

  const std::string& recording() const { return recordings.front(); }
  /// All files and folders that the user named.
  std::vector<std::string> inputs() const;
  /// "" where --radar is the namespace of one of a bag's radars.
  std::string radarFile() const;
  /// Asks whether its captures are what radar.yaml says (checkCaptures) and prints the notes. Throws InputError.
  Recording open(bool misaligned_is_finding = false) const;
  /// Another recording of the same radar and layout, without `channels`.
  Recording open(const std::string& path) const;
  /// The one given, else the recording's; nothing and "" where there is none.
  std::optional<std::string> sceneFile(const Recording& recording) const;
  std::string twinFile(const Recording& recording) const;
  /// loadTwin() with these. Throws InputError, also for a twin with the channel errors that `channels` takes out.
  TwinDescription loadTwinOf(const Recording& recording) const;
  TwinDescription loadTwinOf(const Recording& recording, const std::string& file) const;  ///< another one
  /// Takes out of a twin that is to be written what goes with this process: a scene and a radar that a bag brought.
  /// They are the recording's wherever it is read again.
  static void leaveOutTemporary(TwinDescription& twin);

 private:
  Recording openUnchecked(const std::string& path, const std::string& radar_file, const BagOptions& bag_options) const;
  void check(bool misaligned_is_finding, Recording& opened) const;
};

}  // namespace mmradartwin
