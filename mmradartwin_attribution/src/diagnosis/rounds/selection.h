#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/fit/diagnosis_context.h"
#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/gain/gain_measurement.h"
#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::rounds {

/// Forward selection with joint refit and backward deletion: the findings of the rounds so far, fitted jointly, and the
/// state of everything else given them.
class Selection {
 public:
  /// Keeps references. findings: all of the session; those of rounds are appended. tried: hypotheses that were
  /// considered, whose verdicts may change later.
  Selection(DiagnosisContext& context, GainMeasurement& gains, std::vector<Finding>& findings,
            std::vector<TriedHypothesis>& tried);
  /// Starts a selection. mechanisms: as the engine simulates them. extended: as the recording has them, with what was
  /// taken out of the data.
  void begin(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& extended,
             ModelState state);

  const std::vector<NamedParameters>& mechanisms() const { return mechanisms_; }
  const std::vector<NamedParameters>& extended() const { return extended_; }
  ModelState& state() { return state_; }
  /// Nats of the unknown that was found; 0 where there is none.
  double unknownNats() const;

  /// Takes a round's fit over state() as one more finding and refits all. fits: all of the round, as its rivals.
  /// family: number of hypotheses of the round. Returns the reason why the finding does not stand, with nothing
  /// changed; "" where it stands.
  std::string take(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding,
                   std::size_t family);
  /// Takes things that the twin lacks for granted: all that follows is judged beside them. They are no findings, and
  /// the extended twin has them not.
  void allowFor(const std::vector<HypothesisFit>& things);
  /// Lets edges weigh paths by the field behind them where the session is likelier so given all that was found. Returns
  /// the nats gained, nothing where edges stay as they are.
  std::optional<double> takeKnifeEdges();
  /// Profiles what was found, and sorts it by falling gain, an unknown last. Gains are measured again where other
  /// findings now precede them.
  void finish();

 private:
  /// Finding of a round as it was fitted last; `finding` is its index among the findings.
  struct Accepted {
    Hypothesis hypothesis;
    std::vector<double> scaled_values, standard_error;
    bool overwhelming;
    std::size_t finding;
    /// Labels of the findings given which its gain was measured; none where it was not.
    std::optional<std::vector<std::string>> beside;
    /// Simpler hypotheses that explained nearly as much in its round, with their scaled values.
    std::vector<std::pair<Hypothesis, std::vector<double>>> rivals;
    /// At the last joint fit its gain beside all others was overwhelming.
    bool plain_beside_others = false;
  };
  std::vector<Accepted>::const_iterator acceptedAs(const Hypothesis& h) const;
  void accept(const HypothesisFit& fit, const std::vector<HypothesisFit>& fits, Finding finding);
  void writeBackFindings();
  void refitTogether();
  void withdraw(std::size_t accepted);
  void withdrawExplainedByUnknown();
  void refitAndProfile();
  void renameVerdict(const std::string& label, const std::string& verdict);
  void profileFound(std::optional<std::size_t> only);
  void refitState();
  void orderByGain();
  bool mayBeNothing(const Hypothesis& hypothesis) const;
  bool isWithinErrors(const HypothesisFit& fit) const;
  std::optional<HypothesisFit> betterName(const Accepted& a);
  void joinPattern();
  void exchangeNames();
  void takeOutImage();
  void measureAgain(const Accepted& a);

  DiagnosisContext& context_;
  GainMeasurement& gains_;
  std::vector<Finding>& findings_;
  std::vector<TriedHypothesis>& tried_;
  std::vector<NamedParameters> mechanisms_, extended_;
  /// Mechanisms without the findings of rounds, but with what was allowed for.
  std::vector<NamedParameters> before_rounds_, extended_before_rounds_;
  ModelState state_;
  std::vector<Accepted> accepted_;
  bool all_profiled_ = true;  ///< values and intervals of accepted_ are those of their profiles
  std::size_t family_ = 1;    ///< number of hypotheses of the last round
};

}  // namespace mmradartwin::diagnosis::rounds
