#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/channels/pose_time_lag.h"
#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/gain/gain_measurement.h"
#include "diagnosis/likelihood/error_spread.h"
#include "diagnosis/prepared_session.h"
#include "diagnosis/rooms.h"
#include "diagnosis/rounds/hypothesis_rounds.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/scene_refinement.h"

namespace mmradartwin::diagnosis {

/// The steps of one diagnosis, called in the order in which they stand here. Each adds findings to the result and
/// mechanisms to the extended twin.
class DiagnosisRun {
 public:
  /// Reads the recording. Keeps references. estimated: accuracies by which the session is judged in place of those that
  /// its user states. Throws InputError where recording and twin cannot belong together.
  DiagnosisRun(const TimedRecording& timed, Twin& twin, const DiagnosisOptions& options,
               const std::map<std::string, double>& estimated = {});

  /// Damage and motion that frames show, and the lag of the poses.
  void judgeFrames();
  /// The convention of the samples: order of channels, sign of phases. Data are then as they ought to have been.
  void judgeConventions();
  /// The radar's own tone, leakage or offset, which is then taken out of the data.
  void judgeOwnEcho();
  /// The noise floor where the twin states one, and of few poses the receivers' errors.
  void judgeNoise();
  /// Fits the latents of the twin as given: the state that all hypotheses are compared with.
  void fitTwinAsGiven();
  /// The likelihood of the user's other twins.
  void compareTwins();
  /// False where the twin explains no more than chance: the result then says that nothing matches.
  bool sceneMatches();
  /// Rounds of hypotheses.
  void findCauses();
  /// How far actors and headings err by the session's own echoes.
  void estimateAccuracy();
  /// What the twin with all that was found leaves unexplained, beside what a right one would.
  void judgeRest();
  /// What frames show and no cause explains.
  void addUnexplained();
  /// The paths that each finding changes.
  void recordChangedPaths();
  Diagnosis result();

  /// Ranges of the scene's actors by the twin as given; after fitTwinAsGiven().
  SceneRefinement refinement();

 private:
  /// Adds a finding unless the twin states the same already.
  void add(Finding finding, const std::map<std::string, double>& nats_by_pose = {});
  void measureFrameGain();
  /// Evidence of errors by the session's own echoes under a state of the model.
  /// elsewhere: actors whose range errors the slopes of the likelihood do not show.
  SessionEvidence evidenceUnder(const ModelState& state, const std::vector<RangeShift>& elsewhere) const;
  /// Spreads of errors by that evidence, by the keys of the accuracy.
  std::map<std::string, SpreadEstimate> spreadsBy(const SessionEvidence& evidence) const;
  /// Errors of the actors by that evidence, normal about zero with the spreads that were found.
  std::vector<ActorErrors> actorsBy(const SessionEvidence& evidence) const;
  /// Lets edges weigh paths by the field behind them where the session is likelier so.
  void takeKnifeEdges();
  /// Mechanisms of the twin as given, with edges as they were taken.
  std::vector<NamedParameters> given() const;
  /// Takes the actors' errors as they are where the twin as given shows them to be smaller than stated.
  void takeSmallerErrors();
  void insertBeforeUnknown(Finding finding);

  const Recording& recording_;
  const std::optional<FrameFinding>& lag_;
  Twin& twin_;
  PreparedSession session_;
  ChannelData& data_;
  Diagnosis result_;
  const StatedAccuracy stated_;  ///< the recording's where it states one, else that of the options
  DiagnosisContext context_;
  GainMeasurement gains_;
  HypothesisRounds rounds_;
  std::vector<NamedParameters> mechanisms_;  ///< as the engine simulates them
  std::vector<NamedParameters> extended_;    ///< the same with what was taken out of the data
  std::optional<std::string> convention_;    ///< cause of the convention that was found against the twin
  std::optional<ChannelData> as_recorded_;   ///< the data before that convention was undone
  ModelState state_;                         ///< of the twin as given
};

}  // namespace mmradartwin::diagnosis
