#include "corners/corner_edge.h"

#include <algorithm>
#include <cmath>

#include "physics/aperture.h"
#include "physics/polarisation.h"
#include "rays/image_paths.h"

namespace mmradartwin {
namespace {

constexpr double kCornerInset_m = 0.01;
constexpr double kSmallestCornerFactor = 0.01;
constexpr double kAlongRay = 1e-4;   // sine below which a face as long as its distance (to 10 m) has less than that
constexpr double kSlopeOver = 1e-3;  // of the distance: how far from the edge a slope there is taken

using Interval = std::pair<double, double>;

/// Stretches of the line point + t along (in the facet's plane) that lie in the facet.
std::vector<Interval> insideParts(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& along) {
  const Eigen::Vector2d p((point - facet.origin).dot(facet.e1), (point - facet.origin).dot(facet.e2));
  const Eigen::Vector2d d(along.dot(facet.e1), along.dot(facet.e2)), n(-d.y(), d.x());
  std::vector<double> crossings;
  for (const auto& loop : facet.loops) {
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Eigen::Vector2d &u = loop[i], &v = loop[(i + 1) % loop.size()];
      const double hu = (u - p).dot(n), hv = (v - p).dot(n);
      if ((hu > 0) == (hv > 0)) continue;
      crossings.push_back((u + hu / (hu - hv) * (v - u) - p).dot(d));
    }
  }
  std::sort(crossings.begin(), crossings.end());
  std::vector<Interval> inside;
  for (std::size_t i = 0; i + 1 < crossings.size(); i += 2) inside.emplace_back(crossings[i], crossings[i + 1]);
  return inside;
}

double reach(const Facet& facet, const Eigen::Vector3d& point, const Eigen::Vector3d& direction) {
  double far = 0;
  for (const auto& loop : facet.loops) {
    for (const auto& q : loop) {
      far = std::max(far, (facet.origin + q.x() * facet.e1 + q.y() * facet.e2 - point).dot(direction));
    }
  }
  return far;
}

void addCornerEdges(const Facet& a, const Facet& b, double meet_m, std::vector<CornerEdge>& edges) {
  if (!perpendicular(a, b)) return;
  const Eigen::Vector3d along = a.normal.cross(b.normal).normalized();
  // A point on both planes, near the facets so that no digits are lost.
  Eigen::Vector3d point = a.origin;
  for (int i = 0; i < 2; ++i) {
    point -= a.planeDistance(point) * a.normal;
    point -= b.planeDistance(point) * b.normal;
  }
  point -= a.planeDistance(point) * a.normal;
  const Eigen::Vector3d in_a = a.normal.cross(along), in_b = b.normal.cross(along);
  for (double side_a : {1.0, -1.0}) {
    const Eigen::Vector3d into_a = side_a * in_a;
    const std::vector<Interval> part_a = insideParts(a, point + meet_m * into_a, along);
    if (part_a.empty()) continue;
    for (double side_b : {1.0, -1.0}) {
      const Eigen::Vector3d into_b = side_b * in_b;
      for (const Interval& j : insideParts(b, point + meet_m * into_b, along)) {
        for (const Interval& i : part_a) {
          const double low = std::max(i.first, j.first), high = std::min(i.second, j.second);
          if (high - low < kCornerInset_m) continue;
          edges.push_back({a.id, b.id, point + low * along, along, high - low, into_a, into_b, reach(a, point, into_a),
                           reach(b, point, into_b)});
        }
      }
    }
  }
}

/// CornerAperture::kPhysicalOptics.
std::complex<double> physicalOptics(const CornerEdge& edge, const Eigen::Vector3d& from, double wavelength_m) {
  const Eigen::Vector3d way = from - edge.origin;
  const double along_a = way.dot(edge.into_a), along_b = way.dot(edge.into_b), R = std::hypot(along_a, along_b);
  const double at = way.dot(edge.along);
  const auto alongEdge = [&](double r_m) {
    const double unit = 2 / std::sqrt(wavelength_m * r_m);
    return apertureAxis(-at * unit, (edge.length_m - at) * unit);
  };
  const std::complex<double> at_edge = alongEdge(R);
  // The echo of one face, lit by the image of the radar in the other. x along the face, y off it: of the radar.
  const auto half = [&](double x, double y, double reach_m, double other_reach_m) -> std::complex<double> {
    if (y < kAlongRay * R) return 0;
    // Light that comes by the far end of the other face ends here.
    double end_m = reach_m;
    if (y > other_reach_m) end_m = std::min(end_m, x * other_reach_m / (y - other_reach_m));
    const auto stripEnd = [&](double at_m) -> StripEnd {
      const double to_image_m = std::hypot(at_m + x, y), to_radar_m = std::hypot(at_m - x, y);
      const double both_m = to_image_m + to_radar_m;
      // both_m - 2 R, and no digits lost where the face lies along the ray.
      const double extra_m =
          at_m * at_m / ((to_image_m + R) * (to_radar_m + R)) * (both_m + 2 * R - 8 * x * x / both_m);
      const double u = std::sqrt(4 * extra_m / wavelength_m);
      const double slope = (at_m + x) / to_image_m + (at_m - x) / to_radar_m;  // of the extra path along the face
      const double step = wavelength_m * u / (2 * slope) / (0.5 * std::sqrt(wavelength_m * R) * R / y);
      const double spread = R * R * R / (to_image_m * to_image_m * to_radar_m);
      const double mean_m = 2 * to_image_m * to_radar_m / both_m;
      return {u, spread * step * std::sqrt(mean_m / R) * alongEdge(mean_m)};
    };
    // In the edge, where the strip begins, the weight's slope is what is left of the end point's correction. A face
    // along the ray fills little of a Fresnel zone, and both corrections nearly cancel: what integration by parts
    // leaves over, for a quotient that changes evenly between them, makes it whole (exact for weights of third degree).
    const StripEnd beside = stripEnd(std::min(kSlopeOver * R, 0.5 * end_m)), end = stripEnd(end_m);
    const std::complex<double> slope = (beside.weight - at_edge) / beside.u;
    const std::complex<double> left_over = ((end.weight - at_edge) / end.u - slope) / end.u * apertureAxis(0, end.u);
    return stripFactor({0, at_edge}, end, at_edge) -
           (slope / std::complex<double>(1, -1) + left_over) / std::complex<double>(0, -M_PI);
  };
  return half(along_a, along_b, edge.reach_a_m, edge.reach_b_m) +
         half(along_b, along_a, edge.reach_b_m, edge.reach_a_m);
}

}  // namespace

std::vector<CornerEdge> findCornerEdges(const Scene& scene, double meet_m,
                                        const std::function<bool(const Facet&)>& takes_part,
                                        const std::function<bool(const Facet&, const Facet&)>& pair) {
  std::vector<CornerEdge> edges;
  // Sweep along x over bounding boxes: only facets that touch can meet.
  struct Box {
    Eigen::AlignedBox3d box;
    int id;
  };
  std::vector<Box> boxes;
  for (const Facet& f : scene.facets) {
    if (!f.present || f.curved >= 0 || !takes_part(f)) continue;
    Box b{Eigen::AlignedBox3d(), f.id};
    for (double x : {0.0, f.size1_m}) {
      for (double y : {0.0, f.size2_m}) b.box.extend(f.origin + x * f.e1 + y * f.e2);
    }
    b.box.extend(b.box.min() - Eigen::Vector3d::Constant(meet_m));
    b.box.extend(b.box.max() + Eigen::Vector3d::Constant(meet_m));
    boxes.push_back(b);
  }
  std::stable_sort(boxes.begin(), boxes.end(),
                   [](const Box& a, const Box& b) { return a.box.min().x() < b.box.min().x(); });
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    for (std::size_t j = i + 1; j < boxes.size() && boxes[j].box.min().x() <= boxes[i].box.max().x(); ++j) {
      if (!boxes[i].box.intersects(boxes[j].box)) continue;
      const Facet& a = scene.facets[std::min(boxes[i].id, boxes[j].id)];
      const Facet& b = scene.facets[std::max(boxes[i].id, boxes[j].id)];
      if (pair(a, b)) addCornerEdges(a, b, meet_m, edges);
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const CornerEdge& a, const CornerEdge& b) {
    return std::make_pair(a.a, a.b) < std::make_pair(b.a, b.b);
  });
  return edges;
}

std::complex<double> cornerFactor(const CornerEdge& edge, const Eigen::Vector3d& from, double wavelength_m,
                                  CornerAperture aperture) {
  if (aperture == CornerAperture::kPhysicalOptics) return physicalOptics(edge, from, wavelength_m);
  const Eigen::Vector3d way = from - edge.origin;
  const double x = way.dot(edge.into_a), y = way.dot(edge.into_b), R = std::hypot(x, y), at = way.dot(edge.along);
  // Across the ray the faces end at -reach_a sin and +reach_b sin of their angles to it, first order in s = 2R.
  const double unit = 2 / std::sqrt(wavelength_m * R);
  double across_a = edge.reach_a_m * y / R, across_b = edge.reach_b_m * x / R;
  if (aperture == CornerAperture::kNarrowerFace) across_a = across_b = std::min(across_a, across_b);
  return apertureAxis(-across_a * unit, across_b * unit) * apertureAxis(-at * unit, (edge.length_m - at) * unit);
}

void addCornerPath(const PoseContext& context, const ElementsInMap& elements, const CornerEdge& edge,
                   const PathEvent& event, std::vector<PathRecord>& records, CornerAperture aperture) {
  const Eigen::Vector3d to_radar = elements.p - edge.origin;
  // Concave as seen from here: the radar stands between the two faces.
  const double x = to_radar.dot(edge.into_a), y = to_radar.dot(edge.into_b);
  if (x < 1e-6 || y < 1e-6) return;
  const double R = std::hypot(x, y);
  if (R > context.max_range_m) return;
  const double wavelength = context.radar.wavelength_m();
  const double foot_at = to_radar.dot(edge.along);
  const bool inside = foot_at >= 0 && foot_at <= edge.length_m;
  const double inset = std::min(kCornerInset_m, 0.5 * edge.length_m);
  const double vertex_at = inside ? foot_at : (foot_at < 0 ? inset : edge.length_m - inset);
  const Eigen::Vector3d foot = edge.origin + foot_at * edge.along, vertex = edge.origin + vertex_at * edge.along;
  const Eigen::Vector3d way = vertex - elements.p;
  const double distance = way.norm();
  if (distance > context.max_range_m) return;
  const Eigen::Vector3d direction_radar = context.T_map_radar.linear().transpose() * (way / distance);
  if (!context.inFieldOfView(direction_radar)) return;

  const std::complex<double> factor = cornerFactor(edge, elements.p, wavelength, aperture);
  if (std::abs(factor) < kSmallestCornerFactor) return;
  const Facet &a = context.scene.facets[edge.a], &b = context.scene.facets[edge.b];
  if (!elements.sides.isOpen(a, vertex, elements.p) || !elements.sides.isOpen(b, vertex, elements.p)) return;
  const Eigen::Vector3d lifted = vertex + 2 * kFacesMeet_m * (edge.into_a + edge.into_b);
  if (!context.rays.visible(elements.p, lifted, 1e-3)) return;

  const Material &ma = context.scene.actors[a.actor].material, &mb = context.scene.actors[b.actor].material;
  const Eigen::Vector3d out = (foot - elements.p).normalized();
  const Eigen::Vector3d e = verticalField(elements.up, out);
  ComplexVector field = reflectField(e.cast<std::complex<double>>(), out, a.normal, ma, context.frequency_hz);
  const Eigen::Vector3d between = out - 2 * out.dot(a.normal) * a.normal;
  field = reflectField(field, between, b.normal, mb, context.frequency_hz);
  const std::complex<double> gamma = (e.cast<std::complex<double>>().transpose() * field)(0);
  const std::complex<double> coefficient =
      event.level * wavelength / (4 * M_PI * 2 * R) * specularShare(ma) * specularShare(mb) * gamma * factor;
  if (std::abs(coefficient) <= 0) return;

  PathRecord record;
  record.event = &event.name;
  record.actors = {a.actor, b.actor};
  record.facets = {a.id, b.id};
  record.vertices = {vertex, vertex};
  record.departure = record.arrival = direction_radar;
  record.bounces = 2;
  record.reflection_cosine = {std::abs(out.dot(a.normal)), std::abs(out.dot(b.normal))};
  // Both reflections together turn a point by half a turn about the edge.
  record.length_m = inside ? elements.lengthsByImage([&](const Eigen::Vector3d& t) -> Eigen::Vector3d {
    return 2 * (edge.origin + (t - edge.origin).dot(edge.along) * edge.along) - t;
  })
                           : elements.lengthsVia(vertex);
  setContribution(context.radar, std::conj(coefficient), record);
  records.push_back(std::move(record));
}

}  // namespace mmradartwin
