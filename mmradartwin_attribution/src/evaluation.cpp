#include "mmradartwin_attribution/evaluation.h"

#include <tbb/blocked_range.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "mmradartwin_attribution/mover_mask.h"
#include "mmradartwin_dsp/average_pose.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/point_detector.h"

namespace mmradartwin {
namespace {

/// Frames of a pose that are searched for walkers, from first to last.
constexpr int kSearchedFrames = 16;

/// Masks what walkers may have changed in the average of a pose. Nothing where frames tell no speeds.
class WalkerSearch {
 public:
  explicit WalkerSearch(const Recording& recording) : recording_(recording) {
    if (whyNoSpeeds(recording.radar).empty()) detector_.emplace(CfarSettings(), recording.radar);
  }
  /// The frames that mask() takes, of so many; who calls it reads the recording one at a time.
  std::vector<AdcCube> frames(const Pose& pose, int averaged) const {
    std::vector<AdcCube> kept;
    if (!detector_) return kept;
    const int step = (averaged + kSearchedFrames - 1) / kSearchedFrames;
    int number = 0;
    recording_.forEachFrame(pose, [&](const AdcCube& cube) {
      if (number++ % std::max(1, step) == 0) kept.push_back(cube);
    });
    return kept;
  }
  void mask(const SignalChain& chain, const EvaluationField& field, const std::vector<AdcCube>& frames,
            RangeAngleMap& map) const {
    if (frames.empty()) return;
    MoverMask mask(recording_.radar);
    for (const AdcCube& frame : frames) {
      try {
        const DopplerGrids speeds =
            dopplerGrids(recording_.radar, frame, recording_.channels ? &*recording_.channels : nullptr);
        mask.add(frame.stamp_ns, detector_->moving(chain, speeds));
      } catch (const InputError&) {  // a frame may have lost all chirps of a slot that the average has
      }
    }
    mask.apply(field, map);
  }

 private:
  const Recording& recording_;
  std::optional<PointDetector> detector_;
};

}  // namespace

RangeAngleMap averagedMap(const Recording& recording, const SignalChain& chain, const Pose& pose) {
  return chain.map(averagePose(recording, pose));
}

SimulatedBranch simulatedByTwin(const Twin& twin, DiffuseRecords diffuse_records, const EvaluationField* field) {
  auto chain = std::make_shared<SignalChain>(twin.radar());
  return [&twin, chain, diffuse_records, field](const Pose& pose) {
    Simulation simulation = twin.simulate(pose.T_map_radar, pose.stamp_ns);
    SimulatedPose simulated;
    simulated.map = chain->map(simulation.grid);
    if (field != nullptr && simulation.propagation_only) {
      simulated.expected_power = expectedPower(*field, twin.radar(), simulation.records);
    }
    simulated.records = exportedRecords(twin.radar(), std::move(simulation.records), diffuse_records);
    return simulated;
  };
}

SimulatedBranch simulatedBySession(const Recording& session) {
  auto chain = std::make_shared<SignalChain>(session.radar);
  auto reading = std::make_shared<std::mutex>();
  return [&session, chain, reading](const Pose& pose) {
    for (const Pose& candidate : session.poses) {
      if (candidate.name != pose.name) continue;
      const std::lock_guard<std::mutex> lock(*reading);
      return SimulatedPose{averagedMap(session, *chain, candidate), {}};
    }
    throw InputError("pose '" + pose.name + "': the simulated session " + session.source +
                     " has no usable pose of that name");
  };
}

SimulatedBranch refusingEmpty(SimulatedBranch branch) {
  constexpr double kNothing_db = -390;  // a map has -400 dB where nothing is
  return [branch = std::move(branch)](const Pose& pose) {
    SimulatedPose simulated = branch(pose);
    const RealGrid& map = simulated.map.power_db;
    const auto anything = [&](double level_db) { return level_db > kNothing_db; };
    if (std::any_of(map.data(), map.data() + map.size(), anything)) return simulated;
    throw InputError(
        "the simulation has no echo here, so that there is nothing to compare; correct the pose or the scene");
  };
}

Evaluation evaluate(const Recording& recording, const SimulatedBranch& simulated, const Scene& scene,
                    const RayCaster& rays, const EvaluationOptions& options, const MeasuredBranch& measured) {
  const SignalChain chain(recording.radar);
  const EvaluationField field(options.config, recording.radar, chain.axes());
  const RegionModel regions(scene, rays, field, recording.radar);
  const WalkerSearch walkers(recording);

  Evaluation result;
  result.duplicates = recording.duplicates;
  result.problems = recording.problems;
  result.poses.resize(recording.poses.size());
  std::mutex reading, reporting;  // captures and bags are read one at a time; the rest of the work is parallel
  std::size_t done = 0;
  const auto work = [&](std::size_t i) {
    PoseResult& out = result.poses[i];
    out.index = i;
    out.pose = recording.poses[i];
    try {
      RangeAngleMap map;
      if (measured) {
        map = measured(out.pose);
      } else {
        std::vector<AdcCube> frames;
        {
          const std::lock_guard<std::mutex> lock(reading);
          map = averagedMap(recording, chain, out.pose);
          frames = walkers.frames(out.pose, map.frames);
        }
        walkers.mask(chain, field, frames, map);
      }
      out.frames = map.frames;
      SimulatedPose other = simulated(out.pose);
      out.explained = explainedPower(field, map, other.map, other.expected_power);
      out.expected_known = other.expected_power.size() > 0;
      out.attribution = attributePose(field, map, other.map, regions.regions(out.pose.T_map_radar), other.records);
      for (const Residual& residual : out.attribution.residuals) {
        for (int index : residual.records) out.residual_records.emplace(index, other.records[index]);
      }
      out.records = std::move(other.records);
      out.used = true;
    } catch (const InputError& error) {
      const std::string prefix = "pose '" + out.pose.name + "': ", message = error.what();
      out.problem = message.find(prefix) != std::string::npos ? message : prefix + message;
    }
    if (options.on_pose && out.used) options.on_pose(out);
    if (!options.keep_records) out.records = {};
    const std::lock_guard<std::mutex> lock(reporting);
    ++done;
    if (options.on_progress) options.on_progress(done, result.poses.size());
  };
  tbb::task_arena arena(options.jobs > 0 ? options.jobs : tbb::info::default_concurrency());
  arena.execute([&] { tbb::parallel_for(std::size_t{0}, result.poses.size(), work); });

  Ledger central, outer;
  result.expected_known = true;
  for (const PoseResult& pose : result.poses) {
    if (!pose.used) {
      result.problems.push_back({pose.pose.name, pose.problem});
      continue;
    }
    central.add(pose.attribution.central);
    outer.add(pose.attribution.outer);
    result.explained.add(pose.explained);
    result.expected_known = result.expected_known && pose.expected_known;
    if (pose.attribution.convention.conjugatedBetter()) ++result.conjugated_better;
  }
  result.central = central.summary();
  result.outer = outer.summary();
  return result;
}

}  // namespace mmradartwin
