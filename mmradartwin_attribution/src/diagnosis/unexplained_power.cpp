#include "diagnosis/unexplained_power.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <numeric>
#include <random>
#include <utility>

#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/likelihood/channel_draw.h"
#include "diagnosis/numbers/number_text.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr int kDraws = 8;
/// Fewer places cannot tell a twin that lacks much from one actor that stands wrong: the bootstrap over them is too
/// narrow.
constexpr std::size_t kLeastLocations = 8;
constexpr double kLeastLacking = 0.01;  ///< share of the power below which nobody misses anything
constexpr double kNoFloor = -100;       ///< logarithm of a floor that is none
constexpr std::size_t kWorstPoses = 5;  ///< poses that are named
const std::string kBounces = "max_bounces";
constexpr double kLeastPerBounce_nats = 3;

/// Bounces that the paths of a mechanism may have.
int mostBounces(const std::string& mechanism) {
  for (const ParameterSpec& s : MechanismRegistry::instance().create(mechanism)->parameters()) {
    if (s.name == kBounces) return static_cast<int>(s.max);
  }
  return 0;
}

/// Explained power of the data, and of channels drawn from the model, with the interval of their difference. The floor
/// is left out: a fit puts what it cannot explain into it. echoes: of the twin; shifted: with the actors' range errors.
GainMetric againstDraw(DiagnosisContext& context, const ModelState& state, const std::vector<CellPowers>& measured,
                       const std::vector<PoseEchoes>& echoes, const std::vector<PoseEchoes>& shifted, unsigned draw) {
  SessionLatents latents = state.latents;
  latents.log_floor = kNoFloor;
  ChannelData drawn = context.data;
  tbb::parallel_for(std::size_t{0}, drawn.poses.size(), [&](std::size_t i) {
    std::mt19937 random(static_cast<unsigned>(i * kDraws) + draw);
    drawn.poses[i].range_spectra = drawnChannels(context.likelihood, shifted[i], latents, static_cast<int>(i), random);
  });
  return explainedPowerGain(context.data, measured, cellPowers(drawn, echoes));
}

double average(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// Chance that one more draw from the model explains as little as the data do: Student's predictive distribution of a
/// value beside others of one normal law (Gelman et al., Bayesian Data Analysis, 3.2).
double chanceOfSoLittle(double explained, const std::vector<double>& drawn) {
  const auto count = static_cast<double>(drawn.size());
  const double middle = average(drawn);
  double squares = 0;
  for (const double value : drawn) squares += (value - middle) * (value - middle);
  const double spread = std::sqrt(squares / (count - 1) * (1 + 1 / count));
  if (!(spread > 0)) return explained < middle ? 0 : 1;
  return boost::math::cdf(boost::math::students_t(count - 1), (explained - middle) / spread);
}

/// Poses at which most is missing, the worst first.
FindingPlace worstPlace(const ChannelData& data, const std::vector<CellPowers>& cells) {
  std::vector<std::pair<double, std::size_t>> missing;
  const double gain = std::sqrt(powerGain(cells));
  const auto missed = [&](const CellPowers& pose, std::size_t j) {
    const double more = std::sqrt(pose.measured[j]) - gain * std::sqrt(pose.expected[j]);
    return more > 0 ? more * more : 0;
  };
  for (std::size_t i = 0; i < cells.size(); ++i) {
    double sum = 0;
    for (std::size_t j = 0; j < cells[i].measured.size(); ++j) sum += missed(cells[i], j);
    missing.emplace_back(-sum, i);
  }
  std::sort(missing.begin(), missing.end());
  FindingPlace place;
  for (std::size_t i = 0; i < std::min(kWorstPoses, missing.size()); ++i) {
    place.poses.push_back(data.poses[missing[i].second].pose.name);
  }
  return place;
}

}  // namespace

std::optional<Finding> unexplainedPower(DiagnosisContext& context, const ModelState& state) {
  if (context.data.locations.size() < kLeastLocations) return std::nullopt;
  context.report("what a right twin would explain", 0);
  const std::vector<PoseEchoes> echoes = context.echoes.echoes(state.mechanisms);
  const std::vector<PoseEchoes> shifted = context.echoes.echoes(state.mechanisms, state.actor_range_m);
  const std::vector<CellPowers> measured = cellPowers(context.data, echoes);
  std::vector<double> right;
  double explained = 0;
  for (unsigned draw = 0; draw < kDraws; ++draw) {
    const GainMetric drawn = againstDraw(context, state, measured, echoes, shifted, draw);
    right.push_back(drawn.after);
    explained = drawn.before;
    if ((*drawn.difference_ci95)[0] < kLeastLacking) return std::nullopt;
  }
  Finding finding;
  finding.cause = "unknown";
  finding.candidates = {{"unknown", 1.0}};
  finding.evidence.false_alarm_rate = chanceOfSoLittle(explained, right);
  finding.description = "the twin explains " + number(explained) + " of the measured power, and would explain " +
                        number(average(right)) +
                        " of it if it were right: noise, speckle and the errors of levels leave no more";
  finding.where.push_back(worstPlace(context.data, measured));
  *finding.description += "; most is missing at the poses named";
  return finding;
}

std::optional<MissingBounces> missingBounces(DiagnosisContext& context, const ModelState& state) {
  const auto specular = std::find_if(state.mechanisms.begin(), state.mechanisms.end(),
                                     [](const NamedParameters& m) { return m.values.has(kBounces); });
  if (specular == state.mechanisms.end()) return std::nullopt;
  const auto at = static_cast<std::size_t>(specular - state.mechanisms.begin());
  const int most = mostBounces(specular->mechanism);
  std::optional<MissingBounces> best;
  for (int bounces = static_cast<int>(specular->values.number(kBounces)) + 1; bounces <= most; ++bounces) {
    context.report("paths of " + std::to_string(bounces) + " bounces", 0);
    std::vector<NamedParameters> mechanisms = state.mechanisms;
    mechanisms[at].values.set(kBounces, static_cast<double>(bounces));
    context.echoes.setBaseline(mechanisms);
    ModelState more = context.fitter.state(mechanisms, &state.latents);
    const double before = best ? best->state.log_likelihood : state.log_likelihood;
    if (more.log_likelihood > before + kLeastPerBounce_nats) best = MissingBounces{bounces, at, most, std::move(more)};
  }
  if (!best) context.echoes.setBaseline(state.mechanisms);
  return best;
}

Finding findingOf(const MissingBounces& missing, const ModelState& before) {
  Finding finding;
  finding.cause = "trace_coverage";
  finding.candidates = {{finding.cause, 1.0}};
  finding.mechanism = missing.state.mechanisms[missing.specular];
  finding.parameters.push_back({kBounces, "1", static_cast<double>(missing.max_bounces), {}});
  finding.evidence.log_likelihood_gain = missing.state.log_likelihood - before.log_likelihood;
  // Nothing was fitted but the latents, and few orders were tried.
  finding.evidence.false_alarm_rate = std::min(1.0, missing.tried * std::exp(-finding.evidence.log_likelihood_gain));
  return finding;
}

}  // namespace mmradartwin::diagnosis
