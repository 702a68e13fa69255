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
#include "mmradartwin_sim/mesh_notes.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

constexpr double kStrongest_dbfs = -6;
const std::string kNoise = "noise_floor";
constexpr double kLowestNoise_dbfs = -200;  // that noise_floor takes

/// The folder that is written.
fs::path folderOf(const SimulateOptions& options) {
  return options.written_as.empty() ? options.output : options.written_as;
}

/// A path as it is to stand in the session: relative, so that both may be moved together.
std::string relativeTo(const SimulateOptions& options, const std::string& file) {
  if (file.rfind("package://", 0) == 0) return file;
  const fs::path path = fs::weakly_canonical(file), written = fs::weakly_canonical(folderOf(options));
  const fs::path inside = path.lexically_relative(written);
  if (!inside.empty() && *inside.begin() != "..") return inside.string();
  return fs::proximate(path, fs::weakly_canonical(options.output)).string();
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

/// Levels of all I and Q values of a session, told from any thread in any order.
class SampleLevels {
 public:
  /// exceededBy() is for those who asked for it.
  explicit SampleLevels(bool count) : counts_(count ? kBins : 0) {
    for (auto& c : counts_) c.store(0);
  }
  void add(const ComplexGrid& x) {
    double largest = 0;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      for (const double v : {std::abs(x.data()[i].real()), std::abs(x.data()[i].imag())}) {
        largest = std::max(largest, v);
        if (!counts_.empty()) counts_[static_cast<std::size_t>(bin(v))].fetch_add(1, std::memory_order_relaxed);
      }
    }
    double known = strongest_.load();
    while (largest > known && !strongest_.compare_exchange_weak(known, largest)) {
    }
  }
  double strongest() const { return strongest_.load(); }
  /// The level that this share of all values exceeds, to 0.0005 dB.
  double exceededBy(double fraction) const {
    std::uint64_t total = 0, above = 0;
    for (const auto& c : counts_) total += c.load();
    int b = kBins - 1;
    for (; b > 0; --b) {
      above += counts_[static_cast<std::size_t>(b)].load();
      if (static_cast<double>(above) >= fraction * static_cast<double>(total)) break;
    }
    return std::pow(10.0, (kLowest_db + b * kStep_db) / 20);
  }

 private:
  static constexpr double kLowest_db = -400, kStep_db = 0.0005;
  static constexpr int kBins = 1000000;
  static int bin(double v) {
    if (!(v > 0)) return 0;
    return static_cast<int>(std::min(kBins - 1.0, std::max(0.0, (20 * std::log10(v) - kLowest_db) / kStep_db)));
  }
  std::vector<std::atomic<std::uint64_t>> counts_;
  std::atomic<double> strongest_{0};
};

/// The inputs that all steps of a simulation share.
struct Job {
  const SimulateOptions& options;
  const Recording& recording;
  const Twin& twin;
  const Pose& pose(int i) const { return recording.poses[static_cast<std::size_t>(i)]; }
  int poses() const { return static_cast<int>(recording.poses.size()); }
};

Recording openInput(const SimulateOptions& options) {
  SessionOptions session_options;
  session_options.need_captures = false;
  session_options.exclude_duplicates = false;  // the simulated session has the poses of the given one
  Recording recording = openSession(options.session, session_options);
  if (fs::exists(options.output) &&
      fs::equivalent(options.output, fs::is_directory(options.session) ? fs::path(options.session)
                                                                       : fs::absolute(options.session).parent_path())) {
    throw InputError(options.output + ": --output is the session itself; choose another folder");
  }
  return recording;
}

Twin makeTwin(const SimulateOptions& options, const Recording& recording) {
  const std::string twin_file = options.twin_file.empty() ? recording.twin_file.value_or("") : options.twin_file;
  Twin twin = placedTwin(loadTwin(twin_file, recording.scene_file, recording.radar), recording.poses, recording.source,
                         options.seed);
  std::vector<Eigen::Isometry3d> poses;
  for (const Pose& p : recording.poses) poses.push_back(p.T_map_radar);
  twin.prepare(poses);
  return twin;
}

void addLevels(const Job& job, const Simulation& s, SampleLevels& levels) {
  if (!job.twin.hasFrameStage()) {
    levels.add(s.grid.x);
    return;
  }
  job.twin.visitChirps(s, job.options.frames, [&levels](const ChirpContext&, const ComplexGrid& x) { levels.add(x); });
}

/// Grids of all poses, without records; a pose that cannot be simulated has an empty grid and is among the result's
/// problems. Writes the paths' files.
std::vector<Simulation> simulatePoses(const Job& job, const std::function<void(int, int)>& progress,
                                      SampleLevels& levels, SimulateResult& result) {
  const fs::path paths = folderOf(job.options) / "paths";
  fs::create_directories(paths);
  const int count = job.poses();
  std::vector<Simulation> simulated(job.recording.poses.size());
  std::vector<std::string> failures(job.recording.poses.size());
  std::vector<char> silent(job.recording.poses.size(), 0);
  std::atomic<int> done{0};
  std::mutex mutex;
  tbb::parallel_for(0, count, [&](int i) {
    const Pose& pose = job.pose(i);
    try {
      Simulation s = job.twin.simulate(pose.T_map_radar, pose.stamp_ns);
      writePathsCsv(exportedRecords(job.twin.radar(), s.records, job.options.diffuse_records), job.twin.scene(),
                    (paths / (pose.name + ".csv")).string());
      addLevels(job, s, levels);
      silent[i] = s.grid.x.isZero(0);
      {
        const std::lock_guard<std::mutex> lock(mutex);
        result.worst_amplitude_error = std::max(result.worst_amplitude_error, s.check.worst_amplitude_error);
        result.worst_grid_error = std::max(result.worst_grid_error, s.check.grid_error);
      }
      s.records = {};  // of all poses together they are too many; frames that need them trace again
      simulated[i] = std::move(s);
    } catch (const InputError& e) {
      failures[i] = e.what();
    }
    const int now = ++done;
    if (progress) progress(now, count);
  });
  for (int i = 0; i < count; ++i) {
    if (failures[i].empty()) continue;
    result.problems.push_back({job.pose(i).name, "pose " + job.pose(i).name + ": " + failures[i]});
  }
  for (int i = 0; i < count; ++i) {
    if (silent[i]) result.notes.push_back("pose " + job.pose(i).name + ": the twin has no echo, all samples are zero");
  }
  return simulated;
}

void refuseNothing(const Job& job, const std::vector<Simulation>& simulated, const SimulateResult& result) {
  const bool any =
      std::any_of(simulated.begin(), simulated.end(), [](const Simulation& s) { return s.grid.x.size() > 0; });
  if (any) return;
  throw InputError(job.recording.source + ": no pose can be simulated" +
                   (result.problems.empty() ? std::string("; poses.csv has none")
                                            : "; the first: " + result.problems.front().message));
}

/// The gain that brings a session's strongest sample, or the share of samples that is to be clipped, to its level.
double gainOf_db(const Twin& twin, const SampleLevels& levels) {
  const double strongest = levels.strongest(), clipped = twin.clippedFraction();
  if (clipped > 0 && strongest > 0) return -20 * std::log10(levels.exceededBy(clipped));
  return strongest > 0 ? kStrongest_dbfs - 20 * std::log10(strongest) : 0;
}

std::vector<AdcCube> framesOf(const Job& job, const Pose& pose, const Simulation& simulated, double gain_db) {
  const Twin& twin = job.twin;
  if (twin.hasFrameStage()) {
    try {
      const FrameOptions options{job.options.frames, gain_db, pose.name};
      if (!twin.framesNeedRecords()) return twin.simulateFrames(simulated, options);
      return twin.simulateFrames(twin.simulate(pose.T_map_radar, pose.stamp_ns), options);
    } catch (const InputError& e) {
      throw InputError("pose " + pose.name + ": " + e.what());
    }
  }
  const double scale = 32768 * std::pow(10.0, gain_db / 20);
  std::vector<AdcCube> frames(static_cast<std::size_t>(job.options.frames),
                              makeCube(twin.radar(), simulated.grid.x, scale));
  for (int f = 0; f < job.options.frames; ++f) {
    frames[f].sequence = static_cast<std::uint32_t>(f);
    frames[f].stamp_ns = pose.stamp_ns + twin.radar().frame_offset_ns(f);
  }
  return frames;
}

/// Writes the session and its captures.
void writeSession(const Job& job, std::vector<Simulation>& simulated, SimulateResult& result) {
  const RadarConfig& radar = job.twin.radar();
  SessionWriter::Files files;
  files.radar_yaml = toYaml(radar);
  files.scene = relativeTo(job.options, job.twin.description().scene_file);
  if (job.recording.twin_file) files.twin = relativeTo(job.options, *job.recording.twin_file);
  files.gain_db = result.gain_db;
  SessionWriter writer(folderOf(job.options).string(), radar, files);
  // Frames of some poses at once, written in order; bounded by what they take.
  const double bytes_per_pose = static_cast<double>(radar.bytes_per_frame()) * job.options.frames;
  const int at_once = static_cast<int>(std::min(16.0, std::max(1.0, 64e6 / bytes_per_pose)));
  for (int first = 0; first < job.poses(); first += at_once) {
    const int last = std::min(job.poses(), first + at_once);
    std::vector<std::vector<AdcCube>> cubes(static_cast<std::size_t>(last - first));
    tbb::parallel_for(first, last, [&](int i) {
      Simulation& s = simulated[i];
      if (s.grid.x.size() == 0) return;
      cubes[static_cast<std::size_t>(i - first)] = framesOf(job, job.pose(i), s, result.gain_db);
      s = {};
    });
    for (int i = first; i < last; ++i) {
      if (cubes[static_cast<std::size_t>(i - first)].empty()) continue;
      writer.add(job.pose(i), cubes[static_cast<std::size_t>(i - first)]);
      ++result.poses;
    }
  }
  writer.finish();
}

bool statesNoise(const Twin& twin) {
  const std::vector<NamedParameters>& mechanisms = twin.description().mechanisms;
  return std::any_of(mechanisms.begin(), mechanisms.end(),
                     [](const NamedParameters& m) { return m.mechanism == kNoise; });
}

/// The twin with a noise floor of this level.
Twin withNoise(const Twin& twin, const std::vector<Pose>& poses, double level_dbfs) {
  std::vector<NamedParameters> mechanisms = twin.description().mechanisms;
  NamedParameters noise{kNoise, {}};
  noise.values.set("level_dbfs", level_dbfs);
  noise.values.set("delta_db", 0.0);
  mechanisms.push_back(std::move(noise));
  Twin noisy = twin.changed(std::move(mechanisms));
  noisy.setSession(poses);
  return noisy;
}

void writeResolvedTwin(const Job& job) {
  // What a bag brought stands in the session itself, which will have another name.
  TwinDescription twin = job.twin.description();
  const std::string written = fs::weakly_canonical(folderOf(job.options)).string() + "/";
  for (std::string* file : {&twin.scene_file, &twin.radar_file}) {
    if (fs::weakly_canonical(*file).string().compare(0, written.size(), written) == 0)
      *file = relativeTo(job.options, *file);
  }
  const std::string file = (folderOf(job.options) / "twin.resolved.yaml").string();
  std::ofstream resolved(file);
  resolved << "# The twin that made this session, with all its parameters.\n" << twin.toYaml();
  resolved.close();
  if (!resolved) throw std::runtime_error(file + ": cannot be written; check folder, rights and free space");
}

}  // namespace

double thermalNoise_db(double sample_rate_hz) {
  constexpr double kBoltzmann_J_per_K = 1.380649e-23, kTemperature_K = 290;
  constexpr double kNoiseFigure_db = 12, kTransmitted_dbw = 12 - 30, kAntennaGain_dbi = 10.5;
  return 10 * std::log10(kBoltzmann_J_per_K * kTemperature_K * sample_rate_hz) + kNoiseFigure_db - kTransmitted_dbw -
         2 * kAntennaGain_dbi;
}

SimulateResult simulateSession(const SimulateOptions& options, const std::function<void(int, int)>& progress) {
  return simulateRecording(openInput(options), options, progress);
}

SimulateResult simulateRecording(const Recording& recording, const SimulateOptions& options,
                                 const std::function<void(int, int)>& progress) {
  std::optional<tbb::global_control> limit;
  if (options.jobs > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.jobs));
  const Twin twin = makeTwin(options, recording);
  const Job job{options, recording, twin};

  SimulateResult result;
  result.problems = recording.problems;
  SampleLevels levels(twin.clippedFraction() > 0);
  std::vector<Simulation> simulated = simulatePoses(job, progress, levels, result);
  refuseNothing(job, simulated, result);
  result.gain_db = gainOf_db(twin, levels);
  std::optional<Twin> noisy;
  if (options.noise == SimulatedNoise::kThermal && !statesNoise(twin)) {
    const double level_dbfs = result.gain_db + thermalNoise_db(twin.radar().sample_rate_hz);
    result.noise_dbfs = std::max(kLowestNoise_dbfs, std::min(0.0, level_dbfs));
    noisy.emplace(withNoise(twin, recording.poses, *result.noise_dbfs));
  }
  const Job written{options, recording, noisy ? *noisy : twin};
  writeSession(written, simulated, result);
  for (std::string& note : twin.notes()) result.notes.push_back(std::move(note));
  for (std::string& note : meshNotes(twin.scene())) result.notes.push_back(std::move(note));
  writeResolvedTwin(written);
  return result;
}

}  // namespace mmradartwin
