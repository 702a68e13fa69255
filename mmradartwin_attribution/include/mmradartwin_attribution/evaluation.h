#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_attribution/explained_power.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_attribution/residual.h"
#include "mmradartwin_attribution/response_region.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/cell_records.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// The simulated side of one pose.
struct SimulatedPose {
  RangeAngleMap map;
  std::vector<PathRecord> records;  ///< empty where the simulated side is a recording
  RealGrid expected_power = {};     ///< expectedPower() of all paths; empty where it was not asked for or is not known
};
/// Gives the simulated side of a pose; called for several poses at once. Throws InputError for a pose that cannot be
/// used.
using SimulatedBranch = std::function<SimulatedPose(const Pose&)>;

/// Simulates with a twin. Keeps a reference to it. Which records a residual points to depends on `diffuse_records`, the
/// residuals themselves do not. field, where there is one: expected powers are computed in its cells; kept, too. A twin
/// whose receiver does more than to add up paths has none.
SimulatedBranch simulatedByTwin(const Twin& twin, DiffuseRecords diffuse_records = DiffuseRecords::kPoints,
                                const EvaluationField* field = nullptr);
/// Takes another session's averaged captures, by pose name. Keeps a reference to it.
SimulatedBranch simulatedBySession(const Recording& session);
/// The same branch, which throws InputError for a map without any echo: no figure of it would mean anything.
SimulatedBranch refusingEmpty(SimulatedBranch branch);

/// Coherent average of all frames of a pose through the signal chain. Throws InputError (missing or damaged capture).
RangeAngleMap averagedMap(const Recording& recording, const SignalChain& chain, const Pose& pose);

struct PoseResult {
  std::size_t index = 0;  ///< in the recording's poses
  Pose pose;
  bool used = false;
  std::string problem;  ///< where not used: one line for the user
  int frames = 0;       ///< in the measured average
  ExplainedPower explained;
  bool expected_known = false;  ///< explained compares with the expectation over phases, not with one draw of them
  PoseAttribution attribution;
  std::vector<PathRecord> records;             ///< behind the simulated map; residuals index them (see keep_records)
  std::map<int, PathRecord> residual_records;  ///< those of them that make up a residual, by index
};

struct EvaluationOptions {
  AttributionConfig config;
  int jobs = 0;                                    ///< 0: as many as there are cores
  bool keep_records = false;                       ///< else PoseResult::records is emptied after on_pose
  std::function<void(const PoseResult&)> on_pose;  ///< from worker threads, as each pose is done
  std::function<void(std::size_t done, std::size_t all)> on_progress;  ///< one call at a time
};

struct Evaluation {
  std::vector<PoseResult> poses;  ///< in the recording's order
  LedgerSummary central, outer;
  std::vector<std::string> duplicates;
  std::vector<PoseProblem> problems;  ///< of the recording and of single poses
  int conjugated_better = 0;          ///< poses whose conjugated measurement agrees better
  ExplainedPower explained;           ///< over all poses
  bool expected_known = false;        ///< of every pose; else its share is that of a single draw of phases

  double explainedShare() const { return explained.share(explained.amplitudeGain()); }
  /// Of one pose, under the gain of all.
  double explainedShare(const PoseResult& pose) const { return pose.explained.share(explained.amplitudeGain()); }
};

/// Gives the measured map of a pose, as SimulatedBranch the simulated one.
using MeasuredBranch = std::function<RangeAngleMap(const Pose&)>;

/// Compares every pose of a recording with its simulated side. The scene gives the expected regions. `measured` empty:
/// the recording's captures are read and averaged.
Evaluation evaluate(const Recording& recording, const SimulatedBranch& simulated, const Scene& scene,
                    const RayCaster& rays, const EvaluationOptions& options, const MeasuredBranch& measured = {});

}  // namespace mmradartwin
