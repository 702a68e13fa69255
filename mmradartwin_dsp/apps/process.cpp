// process: a session, a bag or a bare capture -> maps, pictures and, on request, cubes and grids for other tools.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>

#include "mmradartwin_dsp/array_file.h"
#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/capture_check.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/map_picture.h"
#include "mmradartwin_dsp/npz_file.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/ros/bag_arguments.h"

namespace fs = std::filesystem;
using namespace mmradartwin;

namespace {

struct Options {
  std::vector<std::string> inputs;
  std::string radar, layout, channels;
  OutputArguments output;
  BagOptions bag;
  bool mat = false;
  bool npz = false;
  bool cubes = false;
  bool align = false;
};

/// cube: [frame][chirp][sample][rx][I, Q] ADC counts; grid: [channel][sample]; power_db: [range][azimuth] dBFS.
void writeArrays(ArrayFile& file, const Options& options, const Recording& recording, const Pose& pose,
                 const ReceiveGrid& grid, const RangeAngleMap& map) {
  const auto size = [](Eigen::Index n) { return static_cast<std::size_t>(n); };
  file.write("grid", {size(grid.x.rows()), size(grid.x.cols())}, grid.x.data());
  file.write("full_scale", grid.full_scale);
  file.write("frames", grid.frames);
  file.write("stamp_s", static_cast<double>(pose.stamp_ns) * 1e-9);
  const Eigen::Matrix<double, 4, 4, Eigen::RowMajor> T = pose.T_map_radar.matrix();
  file.write("T_map_radar", {4, 4}, T.data());
  file.write("range_m", {map.axes.range_m.size()}, map.axes.range_m.data());
  file.write("azimuth_rad", {map.axes.azimuth_rad.size()}, map.axes.azimuth_rad.data());
  file.write("power_db", {size(map.power_db.rows()), size(map.power_db.cols())}, map.power_db.data());
  if (!options.cubes) return file.close();
  std::vector<std::int16_t> samples;
  std::size_t frames = 0;
  AdcCube last;
  recording.forEachFrame(pose, [&](const AdcCube& cube) {
    samples.insert(samples.end(), cube.data.begin(), cube.data.end());
    ++frames;
    last = cube;
  });
  const auto extent = [](int n) { return static_cast<std::size_t>(n); };
  file.write("cube", {frames, extent(last.chirps), extent(last.samples), extent(last.receivers), 2}, samples.data());
  file.close();
}

int process(const Options& options) {
  std::vector<std::string> inputs = options.inputs;
  inputs.insert(inputs.end(), {options.radar, options.channels});
  Output output = Output::folder(options.output, inputs, "maps");
  const fs::path folder(output.path());
  std::optional<CaptureLayout> layout;
  if (!options.layout.empty()) layout = options.layout == "2lane" ? CaptureLayout::kTwoLane : CaptureLayout::kFourLane;
  BagOptions bag = options.bag;
  bag.further.assign(options.inputs.begin() + 1, options.inputs.end());
  Recording recording = openRecording(options.inputs.front(), options.radar, layout, bag);
  if (!options.channels.empty()) recording.channels = loadChannelCorrection(options.channels, recording.radar);
  CaptureCheckOptions check;
  if (options.align) check.misaligned = CaptureCheckOptions::Misaligned::kAligned;
  for (const std::string& line : checkCaptures(recording, check)) note(line);
  const SignalChain chain = [&] {
    try {
      return SignalChain(recording.radar);
    } catch (const InputError& error) {
      throw InputError(recording.radar_file + ": " + error.what());
    }
  }();
  for (const char* part : {"maps", "pictures"}) fs::create_directories(folder / part);
  const auto arrays = [&folder](const std::string& ending, const std::string& pose) {
    return (folder / ending / (pose + "." + ending)).string();
  };
  if (options.mat) fs::create_directories(folder / "mat");
  if (options.npz) fs::create_directories(folder / "npz");

  std::vector<std::string> problems;
  for (const PoseProblem& problem : recording.problems) problems.push_back(problem.message);
  ProgressLine progress;
  std::size_t done = 0;
  for (const Pose& pose : recording.poses) {
    try {
      const ReceiveGrid grid = averagePose(recording, pose);
      const RangeAngleMap map = chain.map(grid);
      writeMapCsv(map, (folder / "maps" / (pose.name + ".csv")).string());
      FanStyle style;
      style.max_range_m = recording.radar.max_range_m() - recording.radar.range_bin_m() / 2;  // edge of the last bin
      style.title = recording.name + ", pose " + pose.name + ", " + std::to_string(grid.frames) + " frames";
      writePicture(drawFan(map.axes, map.power_db, style), (folder / "pictures" / (pose.name + ".png")).string());
      if (options.mat) {
        MatFile file(arrays("mat", pose.name));
        writeArrays(file, options, recording, pose, grid, map);
      }
      if (options.npz) {
        NpzFile file(arrays("npz", pose.name));
        writeArrays(file, options, recording, pose, grid, map);
      }
    } catch (const InputError& error) {
      problems.push_back(error.what());
    }
    progress.count(++done, recording.poses.size(), "poses");
  }
  progress.clear();
  noteDuplicates(recording);
  const std::size_t maps = recording.poses.size() + recording.problems.size() - problems.size();
  if (maps == 0) {
    throw InputError(recording.source +
                     ": no pose gives a map; the first: " + (problems.empty() ? "it has none" : problems.front()));
  }
  output.complete();
  sayErrors(problems);
  std::cout << maps << " map(s) in " << (fs::path(output.name()) / "maps").string() << ", " << problems.size()
            << " pose(s) skipped\n";
  return problems.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Turns a session directory, a rosbag or a bare DCA1000 capture into range-angle maps.");
  app.add_option("RECORDING", options.inputs,
                 "session directory, session.yaml, bag or capture; several bags, the parts of one, are read as one")
      ->required();
  addOutputArguments(app, options.output, "folder for maps/, pictures/, mat/ and npz/");
  app.add_option(
      "--radar", options.radar,
      "radar.yaml; needed for a bare capture, else instead of the session's; of a bag with several radars the "
      "namespace of one");
  app.add_option("--layout", options.layout, "byte layout of the captures, instead of the radar's")
      ->check(CLI::IsMember({"4lane", "2lane"}));
  app.add_option("--channels", options.channels, "channels.yaml of calibrate: channel errors to take out of the grids");
  addBagArguments(app, options.bag);
  addDuplicatesArgument(app, options.bag);
  app.add_flag("--align", options.align, "read captures that begin within a frame from their first whole chirp on");
  app.add_flag("--mat", options.mat,
               "also write grid and map of each pose as a MATLAB file (Octave and SciPy read it too)");
  app.add_flag("--npz", options.npz, "also write the same as a NumPy archive");
  app.add_flag("--cubes", options.cubes, "with --mat or --npz: the raw cubes too, [frame][chirp][sample][rx][I,Q]");
  app.footer("Example: process lab.bag --output maps --mat");
  return runProgram(app, argc, argv, [&options] {
    if (options.cubes && !options.mat && !options.npz) {
      throw InputError("--cubes says what --mat and --npz write; give one of them too");
    }
    return process(options);
  });
}
