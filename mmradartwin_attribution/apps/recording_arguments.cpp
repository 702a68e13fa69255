#include "recording_arguments.h"

#include <CLI/CLI.hpp>

#include "mmradartwin_dsp/bag_kind.h"
#include "mmradartwin_dsp/capture_check.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/ros/bag_arguments.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_sim/plugin.h"

namespace mmradartwin {

void RecordingArguments::addTo(CLI::App& app) {
  app.add_option("RECORDING", recordings,
                 "session directory, session.yaml, bag or capture; several bags, the parts of one, are read as one")
      ->required();
  app.add_option("--twin", twin, "twin.yaml (default: the session's, or the base mechanisms)");
  app.add_option("--scene", scene, "scene.yaml where the recording names none");
  app.add_option("--radar", radar,
                 "radar.yaml for a recording without one; of a bag with several radars the namespace of one");
  app.add_option("--layout", layout, "byte layout of the captures, instead of radar.yaml's")
      ->check(CLI::IsMember({"4lane", "2lane"}));
  addBagArguments(app, bag);
  addDuplicatesArgument(app, bag);
  app.add_option("--plugins", plugins, "libraries with mechanisms of your own, parted by ':' (or MMRADARTWIN_PLUGINS)");
  app.add_flag("--align", align, "read captures that begin within a frame from their first whole chirp on");
}

void RecordingArguments::addChannelsTo(CLI::App& app) {
  app.add_option("--channels", channels,
                 "channels.yaml of calibrate: channel errors to take out of the measured branch");
}

void RecordingArguments::addTemplatesTo(CLI::App& app) {
  app.add_option("--report-templates", templates,
                 "folder with changed copies of share/mmradartwin_attribution/report: templates of report.html");
}

std::vector<std::string> RecordingArguments::inputs() const {
  std::vector<std::string> all = recordings;
  all.insert(all.end(), {twin, scene, radar, channels, templates});
  return all;
}

std::string RecordingArguments::radarFile() const { return isBag(recording()) ? "" : radar; }

Recording RecordingArguments::open(bool misaligned_is_finding) const {
  loadMechanismPlugins(plugins, "--plugins");
  BagOptions together = bag;
  together.further.assign(recordings.begin() + 1, recordings.end());
  Recording opened = openUnchecked(recording(), radar, together);
  if (!channels.empty()) opened.channels = loadChannelCorrection(channels, opened.radar);
  check(misaligned_is_finding, opened);
  noteDuplicates(opened);
  return opened;
}

Recording RecordingArguments::open(const std::string& path) const {
  Recording opened = openUnchecked(path, radarFile(), bag);
  check(false, opened);
  return opened;
}

void RecordingArguments::check(bool misaligned_is_finding, Recording& opened) const {
  try {
    opened.radar.virtualLine();
  } catch (const InputError& error) {
    throw InputError(opened.radar_file + ": " + error.what());
  }
  using Misaligned = CaptureCheckOptions::Misaligned;
  CaptureCheckOptions options;
  options.misaligned = align ? Misaligned::kAligned : misaligned_is_finding ? Misaligned::kFound : Misaligned::kRefused;
  for (const std::string& line : checkCaptures(opened, options)) note(line);
}

Recording RecordingArguments::openUnchecked(const std::string& path, const std::string& radar_file,
                                            const BagOptions& bag_options) const {
  std::optional<CaptureLayout> lanes;
  if (!layout.empty()) lanes = layout == "2lane" ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  return openRecording(path, radar_file, lanes, bag_options);
}

std::optional<std::string> RecordingArguments::sceneFile(const Recording& opened) const {
  return scene.empty() ? opened.scene_file : scene;
}

std::string RecordingArguments::twinFile(const Recording& opened) const {
  return twin.empty() ? opened.twin_file.value_or("") : twin;
}

TwinDescription RecordingArguments::loadTwinOf(const Recording& opened) const {
  return loadTwinOf(opened, twinFile(opened));
}

TwinDescription RecordingArguments::loadTwinOf(const Recording& opened, const std::string& file) const {
  TwinDescription description = loadTwin(file, sceneFile(opened), opened.radar);
  leaveOutReceivers(opened.radar, description.radar);
  if (opened.channels) refuseSameChannelError(description, *opened.channels);
  return description;
}

void RecordingArguments::leaveOutTemporary(TwinDescription& twin) {
  if (TemporaryFolder::holds(twin.scene_file)) twin.scene_file.clear();
  if (TemporaryFolder::holds(twin.radar_file)) twin.radar_file.clear();
}

}  // namespace mmradartwin
