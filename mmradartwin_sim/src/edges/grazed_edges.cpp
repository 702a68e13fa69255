#include "edges/grazed_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "corners/corner_edge.h"
#include "edges/diffracting_edge.h"
#include "physics/aperture.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

// What may be left out at a time, as a share of the free field: 0.3 dB.
constexpr double kLeftOut = 0.0351;
constexpr double kFarEdge = 1 / (1.4142135623730951 * M_PI);  // a lit edge adds |F(nu)| <= kFarEdge/nu
constexpr double kLitReach = 2 * kFarEdge / kLeftOut;         // passed out and back it counts twice
// An edge's stretch beyond l from the point nearest to the ray adds |(1/2 pi) integral of exp(-j pi t^2/2) h/(h^2 +
// t^2)| <= 1/(4 pi^2 l^2).
const double kEndReach = 1 / (2 * M_PI * std::sqrt(kLeftOut));
// From here on an edge is one without ends, as two such stretches go. At h from the ray it sends F(h) times the share
// between its ends, but for 1/(2 pi^2 h^2): a bound on what was found against the integral for h from 1 to 5.
const double kWhole = 1.4142135623730951 * kEndReach;
// Nearer to an edge the ray says which side it passes on: F changes by kRayDecides/sqrt(2) of 0.5 there, 0.01 dB.
constexpr double kRayDecides = 1e-3, kOnEdge = 1e-9;

constexpr std::array<double, 4> kPanelNode = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267,
                                              0.9602898564975363};
constexpr std::array<double, 4> kPanelWeight = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745,
                                                0.1012285362903763};

/// The field at nu >= 0 behind a knife edge, to 0.002, exp(-jkL) convention. Source: Abramowitz and
/// Stegun 7.3.32, 7.3.33.
Complex behindKnifeEdge(double nu) {
  const double f = (1 + 0.926 * nu) / (2 + nu * (1.792 + nu * 3.104));
  const double g = 1 / (2 + nu * (4.142 + nu * (3.492 + nu * 6.670)));
  return Complex(g, -f) * std::polar(1.0, -0.5 * M_PI * nu * nu) / Complex(1, -1);
}

/// What one straight edge sends, h >= 0 from the ray, as its stretch from low to high has part in the boundary
/// integral: the field with it less that of rays where the ray is on the dark side, of the other sign where it is not.
/// Far ends by the first term of their asymptotic series; the second is 3/(4 pi^3 l^4) at most, 0.013 dB at kFarEnd.
Complex edgeWave(double h, double low, double high) {
  constexpr double kFarEnd = 2;
  const double at = std::max(h, 1e-6);
  const auto beyond = [at](double l) {
    if (l < kFarEnd) return edgeBeyond(l, at);
    return std::polar(at / ((at * at + l * l) * M_PI * l), -0.5 * M_PI * (l * l + 1));
  };
  const Complex turned = std::polar(0.5 / M_PI, -0.5 * M_PI * h * h);
  if (low >= 0) return turned * (beyond(low) - beyond(high));
  if (high <= 0) return turned * (beyond(-high) - beyond(-low));
  return behindKnifeEdge(h) - turned * (beyond(high) + beyond(-low));
}

/// What an edge that ends at low and high, in Fresnel units from the point nearest to the ray, has of one without ends.
Complex shareBetween(double low, double high) {
  const auto beyond = [](double u) { return u < 0 ? 1.0 - behindKnifeEdge(-u) : behindKnifeEdge(u); };
  return beyond(low) - beyond(high);
}

/// Change of the phase in jointKnifeEdges() with t, without its sign. squares: nu_1^2 + nu_2^2; product: nu_1 nu_2.
double turningOfJoint(double squares, double product, double sine) {
  const double square = (1 - sine) * (1 + sine);
  return M_PI * std::abs((squares - 2 * product * sine) * sine / square - product) / std::sqrt(square);
}

/// A bound on |jointKnifeEdges()|: an integral of length t over 2 pi, which turns throughout unless it reaches the sine
/// nu_1/nu_2 (or nu_2/nu_1), and then is no more than twice the inverse of its slowest turning (van der Corput); and
/// 1.3 times what the farther edge adds (1.27 was the most among 6000 random pairs).
double mostOfJoint(double nu_1, double nu_2, double correlation) {
  const double near = std::min(std::abs(nu_1), std::abs(nu_2)), far = std::max(std::abs(nu_1), std::abs(nu_2));
  const double sine = std::min(0.9999, std::abs(correlation));
  const double most = std::min(std::asin(sine) / (2 * M_PI), 1.3 * kFarEdge / (far + 1e-9));
  const bool apart = nu_1 * nu_2 * correlation < 0;  // slowest where it begins
  if (!apart && sine * far >= near) return most;
  return std::min(most, 1 / (M_PI * turningOfJoint(near * near + far * far, near * far, apart ? 0 : sine)));
}

}  // namespace

std::complex<double> jointKnifeEdges(double nu_1, double nu_2, double correlation) {
  // (1/2 pi) integral over t from 0 to asin(correlation) of exp(-j (pi/2) (nu_1^2 - 2 nu_1 nu_2 sin t + nu_2^2)/cos^2
  // t), over w = tan(t/2).
  const double most = std::min(0.9999, std::abs(correlation)), end = most / (1 + std::sqrt((1 - most) * (1 + most)));
  const double squares = nu_1 * nu_1 + nu_2 * nu_2, product = correlation < 0 ? -nu_1 * nu_2 : nu_1 * nu_2;
  const auto sineAt = [](double w) { return 2 * w / (1 + w * w); };
  // Panels as short as the phase's turning at their ends asks for: eight nodes hold ten radians to 1e-4.
  constexpr double kPerPanel_rad = 10;
  const auto turning = [&](double w) { return turningOfJoint(squares, product, sineAt(w)) * 2 / (1 + w * w); };
  Complex sum = 0;
  double from = 0;
  for (int panel = 0; panel < 100 && end - from > 1e-9; ++panel) {
    double step = std::min({0.25, end - from, kPerPanel_rad / (turning(from) + 1e-9)});
    const double faster = turning(from + step) * step;
    if (faster > kPerPanel_rad) step *= kPerPanel_rad / faster;
    const double half = 0.5 * step, middle = from + half;
    for (std::size_t i = 0; i < kPanelNode.size(); ++i) {
      for (double side : {-1.0, 1.0}) {
        const double w = middle + side * half * kPanelNode[i], sine = sineAt(w);
        const double phase = 0.5 * M_PI * (squares - 2 * product * sine) / ((1 - sine) * (1 + sine));
        sum += std::polar(kPanelWeight[i] * half * 2 / (1 + w * w), -phase);
      }
    }
    from += step;
  }
  return (correlation < 0 ? -1.0 : 1.0) * sum / (2 * M_PI);
}

/// One edge beside one leg.
struct GrazedEdges::Graze {
  double nu;             // Fresnel parameter, positive where the leg is on the dark side
  double low, high;      // the edge's ends along it, in Fresnel units, from the point nearest to the leg
  double at_m;           // along the path
  Eigen::Vector3d dark;  // unit, across the leg, to the dark side
  int actor;
  Complex wave;  // the field with the edge less that of rays
  std::size_t screen;

  double nearestEnd() const { return std::min(std::abs(low), std::abs(high)); }
  bool isAcross() const { return low <= 0 && high >= 0; }
  bool isWhole() const { return isAcross() && nearestEnd() > 1; }  // the edge goes on to both sides
  bool isShadow() const { return nu > -kRayDecides && isAcross(); }
  void weigh(bool leg_is_free) {
    if (std::abs(nu) < kRayDecides) nu = leg_is_free ? -kOnEdge : kOnEdge;
    const double h = std::abs(nu), end = nearestEnd();
    if (end > kWhole) {
      wave = behindKnifeEdge(h);
    } else if (h > kWhole) {
      wave = behindKnifeEdge(h) * shareBetween(low, high);
    } else {
      wave = edgeWave(h, low, high);  // a corner of the thing is near
    }
    if (nu < 0) wave = -wave;
  }
};

namespace {

/// True where isKnown(actor) holds for all that the leg meets. Where it only touches a face it may meet nothing.
template <typename Known>
bool areAllThatBlock(const RayCaster& rays, const PathLeg& leg, const Known& isKnown) {
  constexpr int kMost = 16;
  const Eigen::Vector3d t = (leg.to - leg.from) / leg.length_m;
  const double to_m = leg.length_m - leg.gap_m;
  double from_m = leg.gap_m, step_m = 1e-4;
  for (int hits = 0; hits < kMost; ++hits) {
    const auto met = from_m < to_m ? rays.firstHit(leg.from + from_m * t, t, to_m - from_m) : std::nullopt;
    if (!met) return true;
    if (!isKnown(met->actor)) return false;
    from_m += met->distance_m + step_m;
    step_m *= 2;  // a face along the leg is met wherever one begins
  }
  return false;
}

}  // namespace

GrazedEdges::GrazedEdges(const Scene& scene) : scene_(scene) {
  for (const DiffractingEdge& e : findDiffractingEdges(scene, EdgesOf::kAllFacets)) {
    const int actor = scene.facets[static_cast<std::size_t>(e.a)].actor;
    if (!scene.actors[static_cast<std::size_t>(actor)].occludes) continue;
    const Eigen::Vector3d into_b = std::cos(e.n * M_PI) * e.into_a + std::sin(e.n * M_PI) * e.side;
    edges_.push_back({e.origin, e.along, e.length_m, {e.into_a, into_b}, {e.a, e.b}, actor, {}});
    const Eigen::Vector3d middle = e.origin + 0.5 * e.length_m * e.along;
    x_.push_back(static_cast<float>(middle.x()));
    y_.push_back(static_cast<float>(middle.y()));
    z_.push_back(static_cast<float>(middle.z()));
    half_.push_back(static_cast<float>(0.5 * e.length_m + 1e-3));
  }
  const std::vector<CornerEdge> corners = findCornerEdges(
      scene, kFacesMeet_m, [](const Facet& f) { return f.reflects; }, [](const Facet&, const Facet&) { return true; });
  for (const CornerEdge& corner : corners) {
    addEndOfWedge({corner.a, corner.origin, corner.into_a, corner.into_b}, corner.b);
    addEndOfWedge({corner.b, corner.origin, corner.into_b, corner.into_a}, corner.a);
  }
}

void GrazedEdges::addEndOfWedge(const EndOfWedge& end, int face) {
  const Facet& facet = scene_.facets[static_cast<std::size_t>(end.facet)];
  for (const auto& loop : facet.loops) {
    for (const auto& q : loop) {
      const Eigen::Vector3d p = facet.origin + q.x() * facet.e1 + q.y() * facet.e2;
      if ((p - end.fold).dot(end.into_facet) < -kFacesMeet_m) return;  // it goes on behind the face
    }
  }
  for (Edge& edge : edges_) {
    if (edge.facets[0] == face || edge.facets[1] == face) edge.ends.push_back(end);
  }
}

bool GrazedEdges::hidesNone(const Edge& edge, const PathLeg& leg) {
  for (const EndOfWedge& end : edge.ends) {
    if (end.facet == leg.facets[1] && end.holds(leg.from)) return true;
    if (end.facet == leg.facets[0] && end.holds(leg.to)) return true;
  }
  return false;
}

template <typename Found>
void GrazedEdges::forEachNear(const PathLeg& leg, double wavelength_m, double reach, const Found& found) const {
  const double length_m = leg.length_m;
  if (length_m < 4 * leg.gap_m) return;
  const Eigen::Vector3d t = (leg.to - leg.from) / length_m;
  // Nowhere along a path is the unit of Fresnel parameters longer than in its middle.
  const double widest_m = reach * std::sqrt(wavelength_m * leg.total_m / 8);
  const auto look = [&](const Edge& edge) {
    bool of_ends = false;  // their own apertures hold the edges of the facets that the leg goes between
    for (int facet : leg.facets) {
      of_ends = of_ends || (facet >= 0 && (facet == edge.facets[0] || facet == edge.facets[1]));
    }
    if (of_ends || hidesNone(edge, leg)) return;
    const Eigen::Vector3d across = t.cross(edge.along);
    const double sine = across.norm();
    if (sine < 0.1) return;  // the edge runs along the leg
    const Eigen::Vector3d n = across / sine, to = edge.origin - leg.from;
    const double offset_m = to.dot(n);  // of the edge's line from the leg's
    const double cosine = t.dot(edge.along), along_t = to.dot(t), along_edge = to.dot(edge.along);
    const double on_edge =
        (cosine * along_t - along_edge) / (sine * sine);  // points of the lines nearest to each other
    const double on_leg = along_t + on_edge * cosine;
    if (on_leg < leg.gap_m || on_leg > length_m - leg.gap_m) return;
    // What lies in the plane of a facet that the leg ends at is beside it and not in the way.
    const Eigen::Vector3d point = edge.origin + on_edge * edge.along;
    for (int id : leg.facets) {
      if (id >= 0 && std::abs(scene_.facets[static_cast<std::size_t>(id)].planeDistance(point)) < leg.gap_m) return;
    }
    // Both faces on one side of the edge as seen along the leg: it bounds what is hidden. A face that is seen edge-on
    // counts with the edge that is met first.
    double sides[2];
    bool hidden = false;
    for (int k = 0; k < 2; ++k) {
      sides[k] = edge.into[k].dot(n);
      if (std::abs(sides[k]) < 1e-3) {
        sides[k] = 0;
        hidden = hidden || edge.into[k].dot(t) < 0;
      }
    }
    if (hidden || sides[0] * sides[1] < 0 || (sides[0] == 0 && sides[1] == 0)) return;
    const double side = sides[0] + sides[1] > 0 ? 1 : -1;
    const double at_m = leg.before_m + on_leg;
    const double unit = std::sqrt(2 * leg.total_m / (wavelength_m * at_m * (leg.total_m - at_m)));
    Graze graze;
    graze.nu = -side * offset_m * unit;
    graze.low = -on_edge * sine * unit;
    graze.high = (edge.length_m - on_edge) * sine * unit;
    graze.at_m = at_m;
    graze.dark = side * n;
    graze.actor = edge.actor;
    const double beyond = graze.low > 0 ? graze.low : (graze.high < 0 ? -graze.high : 0);
    if (std::abs(graze.nu) > reach || beyond > kEndReach) return;
    found(graze);
  };
  const Eigen::Vector3f from = leg.from.cast<float>(), ahead = t.cast<float>();
  const float far = static_cast<float>(length_m), wide = static_cast<float>(widest_m);
  // A block at a time without a branch first: few edges of a room are near.
  constexpr std::size_t kBlock = 32;
  for (std::size_t block = 0; block < edges_.size(); block += kBlock) {
    const std::size_t count = std::min(kBlock, edges_.size() - block);
    float beyond[kBlock];
    for (std::size_t k = 0; k < count; ++k) {
      const float x = x_[block + k] - from.x(), y = y_[block + k] - from.y(), z = z_[block + k] - from.z();
      const float on = std::min(far, std::max(0.0f, x * ahead.x() + y * ahead.y() + z * ahead.z()));
      const float dx = x - on * ahead.x(), dy = y - on * ahead.y(), dz = z - on * ahead.z();
      const float near = half_[block + k] + wide;
      beyond[k] = dx * dx + dy * dy + dz * dz - near * near;
    }
    for (std::size_t k = 0; k < count; ++k) {
      if (beyond[k] <= 0) look(edges_[block + k]);
    }
  }
}

bool GrazedEdges::passes(const PathLeg& leg, double wavelength_m) const {
  bool passes = false;
  forEachNear(leg, wavelength_m, kDarkReach, [&](const Graze& g) { passes = passes || g.isShadow(); });
  return passes;
}

std::complex<double> GrazedEdges::factor(const PoseContext& context, const PathLegs& legs) const {
  const double wavelength_m = context.radar.wavelength_m();
  boost::container::small_vector<Graze, 16> grazes;
  boost::container::small_vector<std::size_t, 5> first_of_leg;
  for (const PathLeg& leg : legs) {
    first_of_leg.push_back(grazes.size());
    forEachNear(leg, wavelength_m, kLitReach, [&](const Graze& g) { grazes.push_back(g); });
  }
  if (grazes.empty()) return 1;  // nothing that would let a blocked leg pass
  first_of_leg.push_back(grazes.size());

  /// Edges of one thing beside one leg that look to different sides: one screen. Such as look to the same side lie
  /// behind each other.
  struct Screen {
    int actor;
    bool covers;  // the ray
    Complex wave;
    Complex share() const { return (covers ? 0.0 : 1.0) + wave; }
  };
  boost::container::small_vector<Screen, 8> screens;
  Eigen::Matrix3d unfold = Eigen::Matrix3d::Identity();
  for (std::size_t i = 0; i < legs.size(); ++i) {
    const std::size_t begin = first_of_leg[i], end = first_of_leg[i + 1], first_screen = screens.size();
    const bool is_free = context.rays.visible(legs[i].from, legs[i].to, legs[i].gap_m);
    if (begin == end && !is_free) return 0;
    for (std::size_t k = begin; k < end; ++k) {
      Graze& g = grazes[k];
      g.dark = unfold * g.dark;
      g.weigh(is_free);
      std::size_t own = first_screen;
      const auto isStacked = [&](const Graze& other) { return other.screen == own && other.dark.dot(g.dark) > 0.5; };
      while (own < screens.size() &&
             (screens[own].actor != g.actor || std::any_of(&grazes[begin], &grazes[k], isStacked))) {
        ++own;
      }
      if (own == screens.size()) screens.push_back({g.actor, false, 0});
      g.screen = own;
      screens[own].covers = screens[own].covers || (!is_free && g.isShadow());
      screens[own].wave += g.wave;
    }
    if (!is_free) {
      const auto isKnown = [&](int actor) {
        return std::any_of(screens.begin() + static_cast<std::ptrdiff_t>(first_screen), screens.end(),
                           [&](const Screen& s) { return s.covers && s.actor == actor; });
      };
      const bool any = std::any_of(screens.begin() + static_cast<std::ptrdiff_t>(first_screen), screens.end(),
                                   [](const Screen& s) { return s.covers; });
      if (!any || !areAllThatBlock(context.rays, legs[i], isKnown)) return 0;
    }
    if (legs[i].facets[1] < 0) continue;
    const Eigen::Vector3d& normal = scene_.facets[static_cast<std::size_t>(legs[i].facets[1])].normal;
    unfold -= 2 * (unfold * normal) * normal.transpose();
  }

  Complex field = 1;
  for (const Screen& s : screens) field *= s.share();
  const double total_m = legs.front().total_m;
  for (std::size_t a = 0; a < grazes.size(); ++a) {
    for (std::size_t b = a + 1; b < grazes.size(); ++b) {
      const Graze &g = grazes[a], &h = grazes[b];
      if (g.screen == h.screen || !g.isWhole() || !h.isWhole()) continue;
      const double low_m = std::min(g.at_m, h.at_m), high_m = std::max(g.at_m, h.at_m);
      const double depth = std::sqrt(low_m * (total_m - high_m) / (high_m * (total_m - low_m)));
      const double correlation = depth * g.dark.dot(h.dark);
      if (mostOfJoint(g.nu, h.nu, correlation) < kLeftOut) continue;
      Complex others = jointKnifeEdges(g.nu, h.nu, correlation);
      for (std::size_t s = 0; s < screens.size(); ++s) {
        if (s != g.screen && s != h.screen) others *= screens[s].share();
      }
      field += others;
    }
  }
  return field;
}

}  // namespace mmradartwin
