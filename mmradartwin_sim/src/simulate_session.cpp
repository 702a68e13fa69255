#include "mmradartwin_sim/simulate_session.h"

#include <tbb/global_control.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr double kStrongest_dbfs = -6;

/// A path as it is to stand in a session of `folder`: relative, so that both may be moved together.
std::string relativeTo(const std::string& folder, const std::string& file) {
  if (file.rfind("package://", 0) == 0) return file;
  return fs::proximate(fs::weakly_canonical(file), fs::weakly_canonical(folder)).string();
}

/// One frame: every loop repeats the grid's samples, slot by slot.
AdcCube makeCube(const RadarConfig& radar, const ComplexGrid& x, double scale) {
  AdcCube cube;
  cube.chirps = radar.chirps_per_frame();
  cube.samples = radar.samples_per_chirp;
  cube.receivers = radar.receivers();
  cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
  cube.data.reserve(static_cast<std::size_t>(cube.chirps) * cube.samples * cube.receivers * 2);
  const auto count = [scale](double v) {
    return static_cast<std::int16_t>(std::lround(std::min(32767.0, std::max(-32768.0, v * scale))));
  };
  for (int c = 0; c < cube.chirps; ++c) {
    const int slot = c % radar.slots();
    for (int n = 0; n < cube.samples; ++n) {
      for (int r = 0; r < cube.receivers; ++r) {
        const std::complex<double> v = x(cube.receivers * slot + r, n);
        cube.data.push_back(count(v.real()));
        cube.data.push_back(count(v.imag()));
      }
    }
  }
  return cube;
}

}  // namespace

SimulateResult simulateSession(const SimulateOptions& options, const std::function<void(int, int)>& progress) {
  SessionOptions session_options;
  session_options.need_captures = false;
  session_options.exclude_duplicates = false;  // the simulated session has the poses of the given one
  const Recording recording = openSession(options.session, session_options);
  if (fs::exists(options.output) &&
      fs::equivalent(options.output, fs::is_directory(options.session) ? fs::path(options.session)
                                                                       : fs::absolute(options.session).parent_path())) {
    throw InputError(options.output + ": --output is the session itself; choose another folder");
  }
  const std::string twin_file = options.twin_file.empty() ? recording.twin_file.value_or("") : options.twin_file;
  std::optional<tbb::global_control> limit;
  if (options.jobs > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.jobs));

  Twin twin(loadTwin(twin_file, recording.scene_file, recording.radar), options.seed);
  SimulateResult result;
  result.notes = twin.notes();
  result.problems = recording.problems;
  std::vector<Eigen::Isometry3d> poses;
  for (const Pose& p : recording.poses) poses.push_back(p.T_map_radar);
  twin.prepare(poses);

  const fs::path paths = fs::path(options.output) / "paths";
  fs::create_directories(paths);
  const int count = static_cast<int>(recording.poses.size());
  std::vector<ComplexGrid> grids(recording.poses.size());
  std::vector<std::string> failures(recording.poses.size());
  std::atomic<int> done{0};
  std::mutex mutex;
  tbb::parallel_for(0, count, [&](int i) {
    const Pose& pose = recording.poses[i];
    try {
      Simulation s = twin.simulate(pose.T_map_radar, pose.stamp_ns);
      writePathsCsv(s.records, twin.scene(), (paths / (pose.name + ".csv")).string());
      grids[i] = std::move(s.grid.x);
      const std::lock_guard<std::mutex> lock(mutex);
      result.worst_amplitude_error = std::max(result.worst_amplitude_error, s.check.worst_amplitude_error);
      result.worst_grid_error = std::max(result.worst_grid_error, s.check.grid_error);
    } catch (const InputError& e) {
      failures[i] = e.what();
    }
    const int now = ++done;
    if (progress) progress(now, count);
  });

  double strongest = 0;
  for (const ComplexGrid& x : grids) {
    if (x.size() == 0) continue;
    strongest = std::max({strongest, x.real().cwiseAbs().maxCoeff(), x.imag().cwiseAbs().maxCoeff()});
  }
  for (int i = 0; i < count; ++i) {
    if (!failures[i].empty())
      result.problems.push_back({recording.poses[i].name, "pose " + recording.poses[i].name + ": " + failures[i]});
  }
  const bool any = std::any_of(grids.begin(), grids.end(), [](const ComplexGrid& x) { return x.size() > 0; });
  if (!any) {
    throw InputError(options.session + ": no pose can be simulated" +
                     (result.problems.empty() ? std::string("; poses.csv has none")
                                              : "; the first: " + result.problems.front().message));
  }
  result.gain_db = strongest > 0 ? kStrongest_dbfs - 20 * std::log10(strongest) : 0;

  SessionWriter::Files files;
  files.radar_yaml = toYaml(twin.radar());
  files.scene = relativeTo(options.output, twin.description().scene_file);
  if (recording.twin_file) files.twin = relativeTo(options.output, *recording.twin_file);
  files.gain_db = result.gain_db;
  SessionWriter writer(options.output, twin.radar(), files);
  const double scale = 32768 * std::pow(10.0, result.gain_db / 20);
  for (int i = 0; i < count; ++i) {
    if (grids[i].size() == 0) continue;
    std::vector<AdcCube> cubes(static_cast<std::size_t>(options.frames), makeCube(twin.radar(), grids[i], scale));
    for (int f = 0; f < options.frames; ++f) {
      cubes[f].sequence = static_cast<std::uint32_t>(f);
      cubes[f].stamp_ns = recording.poses[i].stamp_ns + std::llround(f * twin.radar().frame_period_s * 1e9);
    }
    writer.add(recording.poses[i], cubes);
    ++result.poses;
  }
  writer.finish();
  std::ofstream resolved(fs::path(options.output) / "twin.resolved.yaml");
  resolved << "# The twin that made this session, with all its parameters.\n" << twin.description().toYaml();
  if (!resolved) throw std::runtime_error(options.output + "/twin.resolved.yaml: cannot be written");
  return result;
}

}  // namespace mmradartwin
