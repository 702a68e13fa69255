#include "diagnosis/search/latent_patterns.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "diagnosis/catalogue/bounds.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kStep = 0.125;          ///< step of numerical derivatives, scaled
constexpr double kMostPatternStart = 8;  ///< limit of a start, scaled
constexpr Eigen::Index kAlongLaw = 25;   ///< places of a law at which a named hypothesis is compared

/// Geometry that explains the latents: least squares of its coordinates v in z = D v, where z holds the errors of
/// actors and poses in standard deviations and D how the geometry changes ranges and directions.
Screened sharedGeometry(ExpectedEchoes& source, const Hypothesis& hypothesis, const ModelState& null,
                        const LatentSpread& spread, const PoseAccuracy& accuracy, const std::vector<int>& poses) {
  const SessionLatents& n = null.latents;
  const Eigen::Index actors =
      static_cast<Eigen::Index>(n.actor_range_m.size()) - 1;  // the last one belongs to no actor
  const Eigen::Index rows = actors + static_cast<Eigen::Index>(poses.size());
  const Eigen::Index columns = static_cast<Eigen::Index>(hypothesis.coordinates.size());
  Eigen::VectorXd latents(rows);
  for (Eigen::Index a = 0; a < actors; ++a) latents[a] = n.actor_range_m[a] / spread.actor_range_m;
  for (std::size_t j = 0; j < poses.size(); ++j) {
    latents[actors + static_cast<Eigen::Index>(j)] = n.yaw_rad[poses[j]] / accuracy.heading_rad;
  }
  const auto with = [&](const std::vector<double>& scaled_values) {
    return mechanismsWith(null.mechanisms, {hypothesis}, scaled_values);
  };
  const std::vector<double> nothing(hypothesis.coordinates.size(), 0.0);
  Eigen::MatrixXd design(rows, columns);
  for (Eigen::Index c = 0; c < columns; ++c) {
    std::vector<double> moved = nothing;
    moved[static_cast<std::size_t>(c)] = kStep;
    const EchoShift shift = source.shift(with(moved), with(nothing), poses, static_cast<int>(actors));
    for (Eigen::Index a = 0; a < actors; ++a) design(a, c) = shift.range_m[a] / kStep / spread.actor_range_m;
    for (std::size_t j = 0; j < poses.size(); ++j) {
      design(actors + static_cast<Eigen::Index>(j), c) = -shift.azimuth_rad[j] / kStep / accuracy.heading_rad;
    }
  }
  for (Eigen::Index r = 0; r < rows; ++r) {
    if (latents[r] == 0) design.row(r).setZero();  // no data shows this error
  }
  const Eigen::VectorXd v = design.completeOrthogonalDecomposition().solve(latents);
  std::vector<double> start;
  for (Eigen::Index c = 0; c < columns; ++c) start.push_back(std::clamp(v[c], -kMostPatternStart, kMostPatternStart));
  return {hypothesis, 0.5 * (design * v).squaredNorm(), {start}};
}

}  // namespace

std::vector<Screened> sharedLatents(ExpectedEchoes& source, const ModelState& null, const LatentSpread& spread,
                                    const PoseAccuracy& accuracy, const std::vector<Hypothesis>& all,
                                    const std::vector<int>& poses) {
  const Scene& scene = source.base().scene();
  const SessionLatents& n = null.latents;
  // An error that all poses or all actors share is a cause. The score test does not see it, since the latents have
  // absorbed it.
  std::vector<Screened> screened;
  for (const Hypothesis& h : all) {
    if (!h.isGeometry()) continue;
    const double numbers = static_cast<double>(h.coordinates.size());
    Screened s = sharedGeometry(source, h, null, spread, accuracy, poses);
    if (!(s.screened_nats > 0)) continue;
    if (s.screened_nats < 0.5 * bounds::kSharedLatent_sigmas * bounds::kSharedLatent_sigmas * numbers)
      s.screened_nats = 0;
    screened.push_back(std::move(s));
  }
  // Level errors of one material's actors, or of one actor, beyond their prior suggest the material.
  for (const Hypothesis& hypothesis : all) {
    if (hypothesis.form() != MechanismForm::kMaterialLevel || hypothesis.coordinates.size() != 1) continue;
    double sum = 0, count = 0;
    for (std::size_t a = 0; a < scene.actors.size(); ++a) {
      const Actor& actor = scene.actors[a];
      if ((actor.name != hypothesis.subject && actor.material_tag != hypothesis.subject) || n.actor_gain[a] == 0)
        continue;
      sum += n.actor_gain[a];
      ++count;
    }
    const double z = count > 0 ? sum / (spread.actor_gain * std::sqrt(count)) : 0;
    if (std::abs(z) < bounds::kSharedLatent_sigmas) continue;
    const double delta_db = 10 / std::log(10.0) * sum / count;
    const Coordinate& c = hypothesis.coordinates.front();
    screened.push_back({hypothesis, 0.5 * z * z, {{c.scaled(c.neutral + delta_db)}}});
  }
  return screened;
}

namespace {

/// Named hypothesis of a level that changes linearly with range or time; its start is the law's mean slope.
std::optional<Screened> namedSlope(const Screened& law, const Parameters& values, const std::vector<Hypothesis>& all) {
  const std::vector<double>&at = values.numbers("at"), &gain_db = values.numbers("gain_db");
  const std::string& variable = values.text("variable");
  const bool over_range = variable == "range_m";
  if ((!over_range && variable != "time_s") || gain_db.size() < 2 || gain_db.size() != at.size()) return std::nullopt;
  const double slope = (gain_db.back() - gain_db.front()) / (at.back() - at.front());
  const double value = over_range ? -slope : 3600 * slope;
  for (const Hypothesis& h : all) {
    if (h.form() != (over_range ? MechanismForm::kLossOverRange : MechanismForm::kGainOverTime) || !h.variant.empty())
      continue;
    if (h.coordinates.size() != 1) continue;
    const Coordinate& c = h.coordinates[0];
    if (!(c.neutral + value > c.min && c.neutral + value < c.max)) continue;
    return Screened{h, law.screened_nats, {{c.scaled(c.neutral + value)}}};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Screened> namedLike(const Screened& law, const std::vector<Hypothesis>& all) {
  if (law.hypothesis.form() != MechanismForm::kLaw || law.starts.empty()) return std::nullopt;
  const Parameters values = law.hypothesis.at(law.starts.front()).values;
  if (!values.numbers("channels").empty() || !values.text("actor").empty()) return std::nullopt;
  if (std::optional<Screened> slope = namedSlope(law, values, all)) return slope;
  const std::vector<double>&at = values.numbers("at"), &delay_m = values.numbers("delay_m");
  const std::string& variable = values.text("variable");
  const bool of_radar = variable == "azimuth_deg", of_scene = variable == "bearing_deg";
  if ((!of_radar && !of_scene) || delay_m.size() < 2 || delay_m.size() != at.size()) return std::nullopt;
  const auto named = std::find_if(all.begin(), all.end(), [&](const Hypothesis& h) {
    return h.form() == (of_radar ? MechanismForm::kRadarOffset : MechanismForm::kSceneOffset);
  });
  if (named == all.end()) return std::nullopt;
  Eigen::MatrixXd design(kAlongLaw, 2);
  Eigen::VectorXd delays(kAlongLaw);
  std::size_t piece = 1;
  for (Eigen::Index i = 0; i < kAlongLaw; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(kAlongLaw - 1);
    const double angle_deg = at.front() + share * (at.back() - at.front());
    while (piece + 1 < at.size() && at[piece] < angle_deg) ++piece;
    const double within = (angle_deg - at[piece - 1]) / std::max(1e-9, at[piece] - at[piece - 1]);
    delays[i] = delay_m[piece - 1] + within * (delay_m[piece] - delay_m[piece - 1]);
    const double sign = of_radar ? -1 : 1, angle_rad = angle_deg * M_PI / 180;
    design.row(i) << sign * std::cos(angle_rad), sign * std::sin(angle_rad);
  }
  const Eigen::Vector2d offset_m = design.colPivHouseholderQr().solve(delays);
  std::vector<double> start;
  for (const Coordinate& c : named->coordinates) {
    const bool first = c.parameter == "forward_m" || c.parameter == "x_m";
    start.push_back(c.unit == "m" ? c.scaled(c.neutral + offset_m[first ? 0 : 1]) : 0.0);
  }
  return Screened{*named, law.screened_nats, {start}};
}

}  // namespace mmradartwin::diagnosis::search
