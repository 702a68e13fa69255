// Apertures, corners and edges in geometry of its own: expected regions come from scene and pose alone and share
// nothing with the simulator but facets and occlusion, so that an error of the simulator's geometry shows as a residual
// (docs/reference/contracts.md section 6).

#include "mmradartwin_attribution/response_region.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "fresnel_aperture.h"
#include "mirror_image.h"
#include "mmradartwin_sim/seen_sides.h"

namespace mmradartwin {
namespace {

std::vector<Eigen::Vector3d> boundary(const Facet& facet) {
  std::vector<Eigen::Vector3d> points;
  for (const auto& loop : facet.loops) {
    for (const Eigen::Vector2d& p : loop) points.push_back(facet.origin + p.x() * facet.e1 + p.y() * facet.e2);
  }
  if (points.empty()) {
    for (double a : {0.0, facet.size1_m}) {
      for (double b : {0.0, facet.size2_m}) points.push_back(facet.origin + a * facet.e1 + b * facet.e2);
    }
  }
  return points;
}

// Extent of points along a line: from begin to end those within a gap of it, nearest and farthest the least and
// greatest distance of any from it.
struct Along {
  double begin = 1e9, end = -1e9, nearest = 1e9, farthest = 0;
};

Along along(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& origin, const Eigen::Vector3d& axis,
            double gap) {
  Along result;
  for (const Eigen::Vector3d& p : points) {
    const double t = axis.dot(p - origin);
    const double distance = (p - origin - t * axis).norm();
    result.nearest = std::min(result.nearest, distance);
    result.farthest = std::max(result.farthest, distance);
    if (distance > gap) continue;
    result.begin = std::min(result.begin, t);
    result.end = std::max(result.end, t);
  }
  return result;
}

// Greatest distance of points from a plane to either side; 0 where no point lies there.
std::pair<double, double> reach(const Facet& plane, const std::vector<Eigen::Vector3d>& points) {
  double positive = 0, negative = 0;
  for (const Eigen::Vector3d& p : points) {
    positive = std::max(positive, plane.planeDistance(p));
    negative = std::max(negative, -plane.planeDistance(p));
  }
  return {positive, negative};
}

constexpr double kLobeFloor_db = -6;  // weakest lobe of an image's beam against its strongest; sidelobes stay below

double level_db(double amplitude) { return 20 * std::log10(std::max(amplitude, 1e-12)); }

}  // namespace

const std::string& regionKindName(RegionKind kind) {
  static const std::string names[] = {"facing", "corner", "edge", "extent", "image"};
  return names[static_cast<int>(kind)];
}

RegionModel::RegionModel(const Scene& scene, const RayCaster& rays, const EvaluationField& field,
                         const RadarConfig& radar)
    : scene_(scene),
      rays_(rays),
      field_(field),
      radar_(radar),
      wavelength_m_(radar.wavelength_m()),
      max_range_m_(radar.max_range_m()),
      mirrors_(std::make_unique<MirrorSearch>(scene, rays, radar.wavelength_m())) {
  findCorners();
  placeProbes();
}

RegionModel::~RegionModel() = default;

void RegionModel::findCorners() {
  const double gap = field_.config().regions.corner_gap_m;
  const double sine = std::sin(field_.config().regions.corner_tolerance_rad);
  std::vector<std::vector<Eigen::Vector3d>> rims;
  std::vector<Eigen::AlignedBox3d> boxes;
  for (const Facet& f : scene_.facets) {
    rims.push_back(boundary(f));
    Eigen::AlignedBox3d box;
    for (const Eigen::Vector3d& p : rims.back()) box.extend(p);
    boxes.push_back(box);
  }
  for (std::size_t i = 0; i < scene_.facets.size(); ++i) {
    const Facet& a = scene_.facets[i];
    if (!a.reflects || !a.present) continue;
    for (std::size_t j = i + 1; j < scene_.facets.size(); ++j) {
      const Facet& b = scene_.facets[j];
      if (!b.reflects || !b.present || std::abs(a.normal.dot(b.normal)) > sine) continue;
      if (boxes[i].exteriorDistance(boxes[j]) > 2 * gap) continue;
      const Eigen::Vector3d axis = a.normal.cross(b.normal).normalized();
      // The point of both planes nearest to a's origin.
      const Eigen::Vector3d in_a = axis.cross(a.normal);
      const double slope = b.normal.dot(in_a);
      const Eigen::Vector3d origin = a.origin - (b.planeDistance(a.origin) / slope) * in_a;
      // A facet may cross the line (a cabinet stands before the middle of a wall): then its rim is far from the line,
      // and the part of it beyond the other's plane counts by its whole extent along the line.
      const auto span = [&](const std::vector<Eigen::Vector3d>& rim, const Facet& other) {
        const auto [positive, negative] = reach(other, rim);
        const bool crosses = positive > gap && negative > gap;
        return along(rim, origin, axis, crosses ? 1e9 : gap);
      };
      const Along on_a = span(rims[i], b), on_b = span(rims[j], a);
      const double begin = std::max(on_a.begin, on_b.begin), end = std::min(on_a.end, on_b.end);
      if (end - begin < gap) continue;
      const auto [a_positive, a_negative] = reach(b, rims[i]);
      const auto [b_positive, b_negative] = reach(a, rims[j]);
      for (int side_b : {1, -1}) {    // side of plane a on which b lies
        for (int side_a : {1, -1}) {  // side of plane b on which a lies
          const double width_a = side_a > 0 ? a_positive : a_negative, width_b = side_b > 0 ? b_positive : b_negative;
          if (width_a <= gap || width_b <= gap) continue;
          corners_.push_back({static_cast<int>(i), static_cast<int>(j), origin + begin * axis, origin + end * axis,
                              static_cast<double>(side_b), static_cast<double>(side_a), width_a, width_b});
        }
      }
    }
  }
}

void RegionModel::placeProbes() {
  constexpr double kMaxProbesPerFacet = 600;
  probes_.resize(scene_.actors.size());
  for (const Facet& f : scene_.facets) {
    if (!f.reflects || !f.present || f.actor < 0) continue;
    std::vector<Probe>& probes = probes_[f.actor];
    const double spacing =
        std::max(field_.config().regions.extent_spacing_m, std::sqrt(f.size1_m * f.size2_m / kMaxProbesPerFacet));
    const int n1 = std::max(1, static_cast<int>(std::ceil(f.size1_m / spacing)));
    const int n2 = std::max(1, static_cast<int>(std::ceil(f.size2_m / spacing)));
    bool any = false;
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        const Eigen::Vector3d p = f.origin + (i + 0.5) / n1 * f.size1_m * f.e1 + (j + 0.5) / n2 * f.size2_m * f.e2;
        if (!f.rectangle && !f.contains(p)) continue;
        probes.push_back({p, f.id, f.size1_m * f.size2_m / (n1 * n2)});
        any = true;
      }
    }
    if (!any)
      probes.push_back({f.nearest(f.origin + 0.5 * (f.size1_m * f.e1 + f.size2_m * f.e2), 1e-3), f.id, f.area_m2});
  }
}

bool RegionModel::seen(const Eigen::Vector3d& radar_map, const Eigen::Vector3d& point,
                       const Eigen::Vector3d& inward) const {
  return rays_.visible(radar_map, point + 2e-3 * inward, 1e-3);
}

bool RegionModel::place(const Eigen::Isometry3d& T_map_radar, const Eigen::Vector3d& point,
                        ResponseRegion& region) const {
  const Eigen::Vector3d p = T_map_radar.inverse() * point;
  region.range_m = p.norm();
  if (region.range_m < 1e-3 || region.range_m >= max_range_m_ || p.x() <= 0) return false;
  if (std::abs(std::asin(p.z() / region.range_m)) > field_.config().regions.max_elevation_rad) return false;
  region.azimuth_rad = std::asin(p.y() / region.range_m);
  region.point = point;
  region.field = field_.fieldAt(region.range_m, region.azimuth_rad);
  return region.field != Field::kExcluded;
}

void RegionModel::addFacets(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const {
  const Eigen::Vector3d radar = T.translation();
  const SeenSides sides(scene_, radar);
  for (const Facet& f : scene_.facets) {
    if (!f.reflects || !f.present || f.actor < 0) continue;
    const double distance = f.planeDistance(radar);
    const double R = std::abs(distance);
    if (R < 1e-3 || R >= max_range_m_) continue;
    const Eigen::Vector3d foot = radar - distance * f.normal;
    const double scale = 2 / std::sqrt(wavelength_m_ * R);
    const double x1 = f.e1.dot(foot - f.origin), x2 = f.e2.dot(foot - f.origin);
    const double aperture =
        fresnelAperture(-x1 * scale, (f.size1_m - x1) * scale) * fresnelAperture(-x2 * scale, (f.size2_m - x2) * scale);
    ResponseRegion region;
    region.support_db = level_db(wavelength_m_ / (8 * M_PI * R) * aperture);
    const bool inside = f.contains(foot, 1e-6);
    region.kind = inside ? RegionKind::kFacing : RegionKind::kEdge;
    if (!place(T, inside ? foot : f.nearest(foot, 0.01), region)) continue;
    if (!sides.isOpen(f, region.point, radar)) continue;
    if (!seen(radar, region.point, (distance > 0 ? 1.0 : -1.0) * f.normal)) continue;
    region.actors = {f.actor};
    out.push_back(region);
  }
}

void RegionModel::addCorners(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const {
  const Eigen::Vector3d radar = T.translation();
  const SeenSides sides(scene_, radar);
  for (const Corner& c : corners_) {
    const Facet &a = scene_.facets[c.first], &b = scene_.facets[c.second];
    if (a.planeDistance(radar) * c.toward_second <= 0 || b.planeDistance(radar) * c.toward_first <= 0) continue;
    const Eigen::Vector3d segment = c.end - c.begin;
    const double length = segment.norm();
    const double t = segment.dot(radar - c.begin) / length;
    const Eigen::Vector3d foot = c.begin + t / length * segment;
    const Eigen::Vector3d point =
        c.begin + std::clamp(t, std::min(0.01, length / 2), std::max(length - 0.01, length / 2)) / length * segment;
    const double R = (foot - radar).norm();
    if (R < 1e-3) continue;
    const double scale = 2 / std::sqrt(wavelength_m_ * R);
    // Each face as wide as it appears across the ray: its foot on the line lies at u = 0.
    const Eigen::Vector3d ray = (foot - radar) / R;
    const double across_a = c.width_first_m * std::abs(ray.dot(a.normal));
    const double across_b = c.width_second_m * std::abs(ray.dot(b.normal));
    const double aperture =
        fresnelAperture(-across_a * scale, across_b * scale) * fresnelAperture(-t * scale, (length - t) * scale);
    ResponseRegion region;
    region.support_db = level_db(wavelength_m_ / (8 * M_PI * R) * aperture);
    region.kind = RegionKind::kCorner;
    if (!place(T, point, region)) continue;
    if (!sides.isOpen(a, region.point, radar) || !sides.isOpen(b, region.point, radar)) continue;
    const Eigen::Vector3d inward = c.toward_second * a.normal + c.toward_first * b.normal;
    if (!seen(radar, region.point, 5 * inward)) continue;  // 1 cm off either face
    region.actors = {a.actor};
    if (b.actor != a.actor) region.actors.push_back(b.actor);
    out.push_back(region);
  }
}

// Paths over the same facets to and fro are equally long and add up with a known phase. Where departure and arrival
// differ, the array steers to neither: the regions are the lobes of the beam that both paths make together.
void RegionModel::addImages(const Eigen::Isometry3d& T, std::vector<ResponseRegion>& out) const {
  const RegionConfig& config = field_.config().regions;
  if (config.image_order < 2) return;
  const std::vector<MirrorImage> images =
      mirrors_->find(T, config.image_order, 2 * max_range_m_, config.max_elevation_rad);
  const Eigen::Isometry3d T_radar_map = T.inverse();
  const VirtualLine line = radar_.virtualLine();
  const int channels = static_cast<int>(line.channels.size());
  const auto addChannels = [&](const MirrorImage& image, Eigen::VectorXcd& sum) {
    const Eigen::Vector3d departure = (T_radar_map * image.vertices.front()).normalized();
    const Eigen::Vector3d arrival = (T_radar_map * image.vertices.back()).normalized();
    for (int k = 0; k < channels; ++k) {
      const int channel = line.channels[k];
      const double closer_m = departure.dot(radar_.tx_position_m[channel / radar_.receivers()]) +
                              arrival.dot(radar_.rx_position_m[channel % radar_.receivers()]);
      sum[k] += std::polar(1.0, -2 * M_PI * closer_m / wavelength_m_);
    }
  };
  constexpr int kSteps = 256;  // of the sine, each way
  std::vector<char> used(images.size(), 0);
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (used[i]) continue;
    Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(channels);
    addChannels(images[i], sum);
    std::vector<int> reversed(images[i].facets.rbegin(), images[i].facets.rend());
    for (std::size_t j = i + 1; j < images.size(); ++j) {
      if (used[j] || images[j].facets != reversed) continue;
      addChannels(images[j], sum);
      used[j] = 1;
    }
    std::vector<double> beam(2 * kSteps + 1);
    for (int u = -kSteps; u <= kSteps; ++u) {
      std::complex<double> total = 0;
      for (int k = 0; k < channels; ++k) {
        total += sum[k] * std::polar(1.0, 2 * M_PI * line.places[k] * line.pitch_m * u / kSteps / wavelength_m_);
      }
      beam[u + kSteps] = std::abs(total) / channels;
    }
    const double most = *std::max_element(beam.begin(), beam.end());
    for (int u = 1; u < 2 * kSteps; ++u) {
      if (beam[u] < beam[u - 1] || beam[u] <= beam[u + 1] || level_db(beam[u] / most) < kLobeFloor_db) continue;
      ResponseRegion region;
      region.range_m = images[i].length_m / 2;
      region.azimuth_rad = std::asin(static_cast<double>(u - kSteps) / kSteps);
      region.field = field_.fieldAt(region.range_m, region.azimuth_rad);
      if (region.field == Field::kExcluded) continue;
      region.kind = RegionKind::kImage;
      region.point = images[i].vertices[images[i].vertices.size() / 2];
      region.support_db = level_db(wavelength_m_ / (4 * M_PI * images[i].length_m) * images[i].aperture * beam[u]);
      for (int facet : images[i].facets) {
        const int actor = scene_.facets[facet].actor;
        if (std::find(region.actors.begin(), region.actors.end(), actor) == region.actors.end()) {
          region.actors.push_back(actor);
        }
      }
      out.push_back(region);
    }
  }
}

void RegionModel::addExtents(const Eigen::Isometry3d& T, double floor_db, std::vector<ResponseRegion>& out) const {
  for (std::size_t actor = 0; actor < probes_.size(); ++actor) addExtentsOf(static_cast<int>(actor), T, floor_db, out);
}

void RegionModel::addExtentsOf(int actor, const Eigen::Isometry3d& T, double floor_db,
                               std::vector<ResponseRegion>& out) const {
  struct Visible {
    double range_m, azimuth_rad, power;
    Eigen::Vector3d point;
    Field field;
  };
  const Eigen::Vector3d radar = T.translation();
  const SeenSides sides(scene_, radar);
  const double S = field_.config().regions.extent_scattering;
  const double scale = wavelength_m_ / (4 * M_PI) * S;
  std::vector<Visible> visible;
  ResponseRegion place_of;
  for (const Probe& probe : probes_[actor]) {
    if (!place(T, probe.point, place_of)) continue;
    const Facet& f = scene_.facets[probe.facet];
    const double r = place_of.range_m, cosine = f.normal.dot(radar - probe.point) / r;
    if (!sides.isOpen(f, probe.point, radar)) continue;
    if (!seen(radar, probe.point, (cosine > 0 ? 1.0 : -1.0) * f.normal)) continue;
    // Lambertian backscatter of a patch, power: (lambda/(4 pi r^2) S cos)^2 dA/pi.
    visible.push_back({r, place_of.azimuth_rad,
                       scale * scale * cosine * cosine * probe.area_m2 / (M_PI * r * r * r * r), probe.point,
                       place_of.field});
  }
  const MatchWindow &tight = field_.config().tight, &wide = field_.config().wide;
  // The tight window of an extent keeps off the wide windows of the actor's other regions on its surface, and off the
  // tight windows of its images.
  const auto around = [&](const ResponseRegion& r) -> const MatchWindow& {
    return r.kind == RegionKind::kImage ? tight : wide;
  };
  const auto apart = [&](const Visible& v) {
    return std::none_of(out.begin(), out.end(), [&](const ResponseRegion& r) {
      return std::find(r.actors.begin(), r.actors.end(), actor) != r.actors.end() &&
             std::abs(r.range_m - v.range_m) < field_.halfRange_m(around(r)) + field_.halfRange_m(tight) &&
             std::abs(r.azimuth_rad - v.azimuth_rad) <
                 field_.halfAzimuth_rad(around(r), r.azimuth_rad) + field_.halfAzimuth_rad(tight, v.azimuth_rad);
    });
  };
  while (true) {
    visible.erase(std::remove_if(visible.begin(), visible.end(), [&](const Visible& v) { return !apart(v); }),
                  visible.end());
    ResponseRegion best;
    double best_power = 0;
    for (const Visible& center : visible) {
      double sum = 0, range = 0, azimuth = 0;
      for (const Visible& v : visible) {
        if (!field_.inWindow(tight, center.range_m, center.azimuth_rad, v.range_m, v.azimuth_rad)) continue;
        sum += v.power;
        range += v.power * v.range_m;
        azimuth += v.power * v.azimuth_rad;
      }
      if (sum <= best_power) continue;
      best_power = sum;
      best.range_m = range / sum;
      best.azimuth_rad = azimuth / sum;
      best.point = center.point;
      best.field = field_.fieldAt(best.range_m, best.azimuth_rad);
    }
    best.support_db = level_db(std::sqrt(best_power));
    if (best_power <= 0 || best.support_db < floor_db) return;
    best.kind = RegionKind::kExtent;
    best.actors = {actor};
    out.push_back(best);
  }
}

std::vector<ResponseRegion> RegionModel::merged(std::vector<ResponseRegion> found) const {
  std::stable_sort(found.begin(), found.end(),
                   [](const ResponseRegion& a, const ResponseRegion& b) { return a.support_db > b.support_db; });
  std::vector<ResponseRegion> kept;
  for (ResponseRegion& r : found) {
    const bool absorbed = std::any_of(kept.begin(), kept.end(), [&](const ResponseRegion& k) {
      const bool shared = std::any_of(r.actors.begin(), r.actors.end(), [&](int actor) {
        return std::find(k.actors.begin(), k.actors.end(), actor) != k.actors.end();
      });
      return shared && field_.inWindow(field_.config().tight, k.range_m, k.azimuth_rad, r.range_m, r.azimuth_rad);
    });
    if (!absorbed) kept.push_back(r);
  }
  return kept;
}

std::vector<ResponseRegion> RegionModel::regions(const Eigen::Isometry3d& T_map_radar) const {
  std::vector<ResponseRegion> found;
  addFacets(T_map_radar, found);
  addCorners(T_map_radar, found);
  double strongest = -300;
  for (const ResponseRegion& r : found) {
    if (r.field == Field::kCentral) strongest = std::max(strongest, r.support_db);
  }
  addImages(T_map_radar, found);
  const double floor = strongest + field_.config().regions.support_floor_db;
  found.erase(
      std::remove_if(found.begin(), found.end(), [floor](const ResponseRegion& r) { return r.support_db < floor; }),
      found.end());
  found = merged(std::move(found));
  const double extent_floor = field_.config().regions.extent_floor_db;
  addExtents(T_map_radar, strongest + extent_floor, found);
  // Where nothing faces the radar, the strongest extent sets the level.
  for (const ResponseRegion& r : found) {
    if (r.field == Field::kCentral) strongest = std::max(strongest, r.support_db);
  }
  found.erase(std::remove_if(found.begin(), found.end(),
                             [&](const ResponseRegion& r) {
                               return r.kind == RegionKind::kExtent && r.support_db < strongest + extent_floor;
                             }),
              found.end());
  for (ResponseRegion& r : found) {
    for (int actor : r.actors) {
      const Actor& a = scene_.actors[actor];
      r.actor += (r.actor.empty() ? "" : ";") + a.name;
      r.material += (r.material.empty() ? "" : ";") + a.material_tag;
    }
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const ResponseRegion& a, const ResponseRegion& b) { return a.range_m < b.range_m; });
  return found;
}

}  // namespace mmradartwin
