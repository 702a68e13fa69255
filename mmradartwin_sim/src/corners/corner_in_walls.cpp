#include "corners/corner_in_walls.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "physics/reflections.h"

namespace mmradartwin {
namespace {

constexpr double kOnPlane_m = 1e-7, kInside_m = 1e-9;

/// The way from the radar over walls to the point of an edge that is nearest to its image in them.
struct Way {
  Eigen::Vector3d image;  ///< of the radar in the walls
  Eigen::Vector3d turn;   ///< the point of the edge
  PerInteraction<Eigen::Vector3d> vertices;
};

std::optional<Way> wayTo(const Scene& scene, const Eigen::Vector3d& radar, const CornerInWalls& corner) {
  Way way;
  PerInteraction<Eigen::Vector3d> images;
  way.image = radar;
  for (int wall : corner.walls) {
    const Facet& facet = scene.facets[static_cast<std::size_t>(wall)];
    if (std::abs(facet.planeDistance(way.image)) < kOnPlane_m) return std::nullopt;
    images.push_back(way.image = mirror(way.image, facet));
  }
  const CornerEdge& edge = *corner.edge;
  const Eigen::Vector3d to_image = way.image - edge.origin;
  if (to_image.dot(edge.into_a) < 1e-6 || to_image.dot(edge.into_b) < 1e-6) return std::nullopt;
  const double at = to_image.dot(edge.along);
  if (at < 0 || at > edge.length_m) return std::nullopt;
  way.turn = edge.origin + at * edge.along;
  way.vertices.assign(corner.walls.size(), Eigen::Vector3d::Zero());
  Eigen::Vector3d from = way.turn;
  for (std::size_t i = corner.walls.size(); i-- > 0;) {
    const Facet& facet = scene.facets[static_cast<std::size_t>(corner.walls[i])];
    const double here = facet.planeDistance(from), there = facet.planeDistance(images[i]);
    if (!(here * there < 0) || std::abs(here) < kOnPlane_m) return std::nullopt;
    way.vertices[i] = from + here / (here - there) * (images[i] - from);
    if (!facet.contains(way.vertices[i], kInside_m)) return std::nullopt;
    from = way.vertices[i];
  }
  return way;
}

/// True where nothing stands in the way and each wall is met on a side that can be seen.
bool isClear(const PoseContext& context, const ElementsInMap& elements, const CornerInWalls& corner, const Way& way) {
  const std::vector<Facet>& facets = context.scene.facets;
  Eigen::Vector3d from = elements.p;
  for (std::size_t i = 0; i < corner.walls.size(); ++i) {
    const Facet& facet = facets[static_cast<std::size_t>(corner.walls[i])];
    const Eigen::Vector3d& next = i + 1 < corner.walls.size() ? way.vertices[i + 1] : way.turn;
    if (!elements.sides.isOpen(facet, way.vertices[i], from) || !elements.sides.isOpen(facet, way.vertices[i], next) ||
        !context.rays.visible(from, way.vertices[i], legGap(facet, (way.vertices[i] - from).normalized()))) {
      return false;
    }
    from = way.vertices[i];
  }
  const CornerEdge& edge = *corner.edge;
  for (int face : {edge.a, edge.b}) {
    if (!elements.sides.isOpen(facets[static_cast<std::size_t>(face)], way.turn, from)) return false;
  }
  const Eigen::Vector3d lifted = way.turn + 2 * kFacesMeet_m * (edge.into_a + edge.into_b);
  const Facet& last = facets[static_cast<std::size_t>(corner.walls.back())];
  return context.rays.visible(from, lifted, legGap(last, (lifted - from).normalized()));
}

/// Calls `found` with every sequence of so many reflectors, none twice in a row.
template <typename Found>
void forEachSequence(const std::vector<int>& reflectors, int length, PerInteraction<int>& sequence,
                     const Found& found) {
  if (static_cast<int>(sequence.size()) == length) {
    found(sequence);
    return;
  }
  for (int facet : reflectors) {
    if (!sequence.empty() && sequence.back() == facet) continue;
    sequence.push_back(facet);
    forEachSequence(reflectors, length, sequence, found);
    sequence.pop_back();
  }
}

}  // namespace

std::vector<CornerInWalls> findCornersInWalls(const PoseContext& context, const ElementsInMap& elements,
                                              const std::vector<CornerEdge>& edges, const std::vector<int>& reflectors,
                                              int walls, const ImageSearch::Limits& limits) {
  std::vector<CornerInWalls> found;
  PerInteraction<int> sequence;
  forEachSequence(reflectors, walls, sequence, [&](const PerInteraction<int>& mirrors) {
    for (const CornerEdge& edge : edges) {
      CornerInWalls corner{&edge, mirrors};
      const auto way = wayTo(context.scene, elements.p, corner);
      if (!way || 2 * (way->image - way->turn).norm() > limits.max_length_m) continue;
      if (limits.in_view && !limits.in_view((way->vertices.front() - elements.p).normalized())) continue;
      if (limits.only_actor >= 0) {
        const auto wanted = [&](int id) {
          return context.scene.facets[static_cast<std::size_t>(id)].actor == limits.only_actor;
        };
        if (!wanted(edge.a) && !wanted(edge.b) && std::none_of(mirrors.begin(), mirrors.end(), wanted)) continue;
      }
      if (isClear(context, elements, corner, *way)) found.push_back(std::move(corner));
    }
  });
  return found;
}

void addCornerInWalls(const PoseContext& context, const ElementsInMap& elements, const CornerInWalls& corner,
                      const PathEvent& event, double cutoff, std::vector<PathRecord>& records) {
  const std::optional<Way> way = wayTo(context.scene, elements.p, corner);
  if (!way) return;
  const CornerEdge& edge = *corner.edge;
  const double wavelength = context.radar.wavelength_m(), R = (way->image - way->turn).norm();
  PathRecord record;
  for (int wall : corner.walls) record.facets.push_back(wall);
  record.facets.push_back(edge.a);
  record.facets.push_back(edge.b);
  for (std::size_t i = corner.walls.size(); i-- > 0;) record.facets.push_back(corner.walls[i]);
  record.vertices = way->vertices;
  record.vertices.push_back(way->turn);
  record.vertices.push_back(way->turn);
  for (std::size_t i = corner.walls.size(); i-- > 0;) record.vertices.push_back(way->vertices[i]);

  const int turn = static_cast<int>(corner.walls.size());
  const std::complex<double> at_edge =
      event.level * wavelength / (4 * M_PI * 2 * R) * cornerFactor(edge, way->image, wavelength);
  const std::complex<double> weight = reflectAlong(context, elements, record.vertices, 2 * R, turn, at_edge, record);
  if (std::abs(weight) < cutoff || !(std::abs(weight) > 0)) return;
  record.event = &event.name;
  record.departure = record.arrival =
      context.T_map_radar.linear().transpose() * (way->vertices.front() - elements.p).normalized();
  record.bounces = static_cast<int>(record.facets.size());
  // Both reflections at the edge together turn a point by half a turn about it.
  record.length_m = elements.lengthsByImage([&](Eigen::Vector3d t) {
    const auto mirrored = [&](int wall) { t = mirror(t, context.scene.facets[static_cast<std::size_t>(wall)]); };
    for (int wall : corner.walls) mirrored(wall);
    t = 2 * (edge.origin + (t - edge.origin).dot(edge.along) * edge.along) - t;
    for (std::size_t i = corner.walls.size(); i-- > 0;) mirrored(corner.walls[i]);
    return t;
  });
  setContribution(context.radar, std::conj(weight), record);
  records.push_back(std::move(record));
}

}  // namespace mmradartwin
