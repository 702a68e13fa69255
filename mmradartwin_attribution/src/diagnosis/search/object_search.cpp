#include "diagnosis/search/object_search.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/numbers/number_text.h"
#include "diagnosis/search/back_projection.h"

namespace mmradartwin::diagnosis::search {
namespace {

constexpr double kSides_m[] = {0.25, 0.45};               ///< sides of a box that are tried
constexpr double kTurned_deg = 15, kSquare_deg = 90;      ///< step of its turns; a square repeats after a quarter turn
constexpr std::size_t kFacingPoses = 5;                   ///< poses that a side of a box may face
constexpr double kSideFactors[] = {0.6, 0.8, 1.25, 1.6};  ///< factors on a side
constexpr double kPlaceShifts_m[] = {-0.1, -0.05, 0.05, 0.1};  ///< shifts of a place
constexpr double kPlaceTurns_deg[] = {-8, -3, 3, 8};           ///< turns about itself
constexpr double kPlaceOffsets_m[] = {-0.1, 0, 0.1};           ///< offsets from the place that hidden paths pass
constexpr int kSweeps = 4;                                     ///< sweeps over the surroundings of a fit
constexpr double kLeastSweepGain_nats = 5;                     ///< gain of a sweep from which another one follows
constexpr double kLeastForSweeps_nats = 15;                    ///< gain of a fit from which it is swept

/// Indices of a box's coordinates.
enum Coordinates { kX, kY, kSide, kYaw };

/// Hypothesis of a box whose middle starts at a place.
Hypothesis boxAt(const Eigen::Vector2d& middle) {
  Hypothesis h;
  h.mechanism = defaultMechanism(mechanismOfForm(MechanismForm::kUnmodelledObject));
  h.mechanism.values.set("shape", std::string("box"));
  h.coordinates = {{"x_m", "m", -1, middle.x(), middle.x() + 0.1, -1000, 1000, {}},
                   {"y_m", "m", -1, middle.y(), middle.y() + 0.1, -1000, 1000, {}},
                   {"size_m", "m", -1, 0, kSides_m[0], 0.02, 5, {}},
                   {"yaw_deg", "deg", -1, 0, kTurned_deg, -360, 360, {}}};
  return h;
}

/// Scaled coordinates of boxes that share a side, a corner or the middle with the fitted one.
std::vector<std::vector<double>> boxesAround(const HypothesisFit& fit) {
  const std::vector<Coordinate>& c = fit.hypothesis.coordinates;
  const Eigen::Vector2d center(c[kX].value(fit.scaled_values[kX]), c[kY].value(fit.scaled_values[kY]));
  const double side_m = c[kSide].value(fit.scaled_values[kSide]), yaw_deg = c[kYaw].value(fit.scaled_values[kYaw]);
  const double yaw_rad = yaw_deg * M_PI / 180;
  const Eigen::Vector2d u(std::cos(yaw_rad), std::sin(yaw_rad)), v(-u.y(), u.x());
  std::vector<std::vector<double>> boxes;
  const auto add = [&](const Eigen::Vector2d& at, double size_m, double turned_deg) {
    boxes.push_back({c[kX].scaled(at.x()), c[kY].scaled(at.y()), c[kSide].scaled(size_m), c[kYaw].scaled(turned_deg)});
  };
  for (double grown : kSideFactors) {
    const double half_m = 0.5 * (grown - 1) * side_m;
    for (int i : {-1, 0, 1}) {
      for (int j : {-1, 0, 1}) add(center + half_m * (i * u + j * v), grown * side_m, yaw_deg);
    }
  }
  for (double shift_m : kPlaceShifts_m) {
    add(center + shift_m * u, side_m, yaw_deg);
    add(center + shift_m * v, side_m, yaw_deg);
  }
  for (double turn_deg : kPlaceTurns_deg) add(center, side_m, yaw_deg + turn_deg);
  return boxes;
}

/// Scaled coordinates of places and turns around a fit; of a late echo, places and delays.
std::vector<std::vector<double>> placesAround(const HypothesisFit& fit) {
  std::vector<std::vector<double>> places;
  const auto add = [&](std::size_t coordinate, double by) {
    const Coordinate& c = fit.hypothesis.coordinates[coordinate];
    places.push_back(fit.scaled_values);
    places.back()[coordinate] = c.scaled(c.value(fit.scaled_values[coordinate]) + by);
  };
  for (std::size_t i = 0; i < fit.scaled_values.size(); ++i) {
    if (fit.hypothesis.coordinates[i].unit == "deg") {
      for (double turn_deg : kPlaceTurns_deg) add(i, turn_deg);
    } else if (fit.hypothesis.coordinates[i].unit == "m") {
      for (double shift_m : kPlaceShifts_m) add(i, shift_m);
    }
  }
  return places;
}

}  // namespace

bool isUnmodelledBox(const Hypothesis& hypothesis) {
  return hypothesis.form() == MechanismForm::kUnmodelledObject && hypothesis.mechanism.values.text("shape") == "box";
}

Screened asBox(const ChannelData& data, const ModelState& null, const HypothesisFit& cylinder) {
  const NamedParameters fitted = cylinder.hypothesis.at(cylinder.scaled_values);
  const Eigen::Vector2d axis(fitted.values.number("x_m"), fitted.values.number("y_m"));
  Screened box{boxAt(axis), cylinder.gain, {}};
  Hypothesis& hypothesis = box.hypothesis;
  hypothesis.variant = "a box " + cylinder.hypothesis.variant;
  const double radius_m = 0.5 * fitted.values.number("size_m");
  // The cylinder's front is the near side of the box, half a side before its middle.
  const auto startBehind = [&](const Eigen::Vector2d& toward_radar, double yaw_deg) {
    for (double side_m : kSides_m) {
      const Eigen::Vector2d center = axis + (radius_m - 0.5 * side_m) * toward_radar;
      box.starts.push_back({hypothesis.coordinates[0].scaled(center.x()), hypothesis.coordinates[1].scaled(center.y()),
                            hypothesis.coordinates[2].scaled(side_m), hypothesis.coordinates[3].scaled(yaw_deg)});
    }
  };
  const Eigen::Vector2d toward_most = -awayFromRadar(data, axis);
  for (double yaw_deg = 0; yaw_deg < kSquare_deg; yaw_deg += kTurned_deg) startBehind(toward_most, yaw_deg);
  // A side may face the poses that gain most.
  std::vector<std::pair<double, std::size_t>> seen;
  for (std::size_t i = 0; i < data.poses.size(); ++i) seen.emplace_back(null.by_pose[i] - cylinder.state.by_pose[i], i);
  std::sort(seen.begin(), seen.end());
  seen.resize(std::min(kFacingPoses, seen.size()));
  for (const auto& [gain, i] : seen) {
    const Eigen::Vector2d way = (data.poses[i].pose.T_map_radar.translation().head<2>() - axis).normalized();
    startBehind(way, std::fmod(std::atan2(way.y(), way.x()) * 180 / M_PI + 360, kSquare_deg));
  }
  return box;
}

Screened boxFacing(const ChannelData& data, const ProjectedPlace& side) {
  const Eigen::Vector2d seen(side.x_m, side.y_m);
  Screened box{boxAt(seen), side.screened_nats, {}};
  Hypothesis& h = box.hypothesis;
  h.variant = "a box whose side faces some poses, about " + number(seen.x(), 2) + ", " + number(seen.y(), 2) + " m";
  for (const int pose : side.faced) {
    const Eigen::Vector2d radar = data.poses[static_cast<std::size_t>(pose)].pose.T_map_radar.translation().head<2>();
    const Eigen::Vector2d way = (radar - seen).normalized(), along(-way.y(), way.x());
    const double yaw_deg = std::fmod(std::atan2(way.y(), way.x()) * 180 / M_PI + 360, kSquare_deg);
    for (const double side_m : kSides_m) {
      for (const double aside : {-0.3, 0.0, 0.3}) {
        const Eigen::Vector2d center = seen - 0.5 * side_m * way + aside * side_m * along;
        box.starts.push_back({h.coordinates[kX].scaled(center.x()), h.coordinates[kY].scaled(center.y()),
                              h.coordinates[kSide].scaled(side_m), h.coordinates[kYaw].scaled(yaw_deg)});
      }
    }
  }
  return box;
}

Screened boxAbout(const HidingPlace& place) {
  Screened box{boxAt({place.x_m, place.y_m}), 0, {}};
  Hypothesis& h = box.hypothesis;
  h.variant = "a box that hides what is behind it, about " + number(place.x_m, 2) + ", " + number(place.y_m, 2) + " m";
  for (const double side_m : {M_SQRT1_2 * place.width_m, place.width_m}) {  // the width may be a diagonal
    for (double yaw_deg = 0; yaw_deg < kSquare_deg; yaw_deg += 2 * kTurned_deg) {
      for (const double dx_m : kPlaceOffsets_m) {
        for (const double dy_m : kPlaceOffsets_m) {
          box.starts.push_back({h.coordinates[kX].scaled(place.x_m + dx_m), h.coordinates[kY].scaled(place.y_m + dy_m),
                                h.coordinates[kSide].scaled(side_m), h.coordinates[kYaw].scaled(yaw_deg)});
        }
      }
    }
  }
  return box;
}

HypothesisFit fitObject(HypothesisFitter& fitter, const ModelState& null, const Screened& object) {
  const Hypothesis& h = object.hypothesis;
  HypothesisFit best = fitter.fit(null, h, object.starts);
  for (int i = 0; i < kSweeps && best.gain_without_best_place > kLeastForSweeps_nats; ++i) {
    HypothesisFit other = fitter.fit(null, h, isUnmodelledBox(h) ? boxesAround(best) : placesAround(best), 0, &best);
    const double higher = other.gain - best.gain;
    if (higher > 0) best = std::move(other);
    if (higher < kLeastSweepGain_nats) break;
  }
  return best;
}

}  // namespace mmradartwin::diagnosis::search
