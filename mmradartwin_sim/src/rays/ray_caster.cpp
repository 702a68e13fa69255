#include "mmradartwin_sim/ray_caster.h"

#include <embree3/rtcore.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <limits>
#include <set>
#include <stdexcept>

namespace mmradartwin {

struct RayCaster::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
  RTCScene still = nullptr;                          // what stands, where other actors may move; else null
  RTCScene passed_actors = nullptr;                  // actors that rays pass, null where there are none
  std::vector<std::vector<Facet>> passed_facets;     // [actor], empty for the others
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // single precision inside, so coordinates stay small
  double radius_m = 0;
  std::vector<std::vector<int>> facet_of_triangle;  // [actor][triangle]
  std::vector<bool> solid;                          // actors that can have an inside
  std::vector<Eigen::AlignedBox3d> bounds;
  struct Instance {
    int actor;
    RTCScene scene;
    RTCGeometry geometry;        // in the scene above, released with it
    Eigen::AlignedBox3d bounds;  // on construction
  };
  std::vector<Instance> instances;

  ~Embree() {
    if (scene) rtcReleaseScene(scene);
    if (still) rtcReleaseScene(still);
    for (const Instance& i : instances) rtcReleaseScene(i.scene);
    if (passed_actors) rtcReleaseScene(passed_actors);
    if (device) rtcReleaseDevice(device);
  }
};

namespace {

/// Origins further out than this lose all digits in single precision.
constexpr double kFarthest_m = 1e9;

/// False where Embree would abort (Debian builds it with assertions on rays) or nothing can be met. NaN fails every
/// comparison.
bool castable(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double length) {
  return origin.squaredNorm() < kFarthest_m * kFarthest_m && direction.squaredNorm() < 1.001 && length > 0 &&
         length < 2 * kFarthest_m;
}

/// castable() of a ray of this square length.
bool castable(const Eigen::Vector3d& origin, double square_length) {
  return origin.squaredNorm() < kFarthest_m * kFarthest_m && square_length < 4 * kFarthest_m * kFarthest_m;
}

/// Four numbers that the compiler keeps in one register.
using Float4 = float __attribute__((vector_size(16)));

/// Whole vectors are stored, as Embree loads them: a load of what was stored in parts waits until all of it has left
/// the processor's store buffer.
void fill(RTCRay& ray, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double near, double far) {
  const Float4 from = {static_cast<float>(origin.x()), static_cast<float>(origin.y()), static_cast<float>(origin.z()),
                       static_cast<float>(near)};
  const Float4 along = {static_cast<float>(direction.x()), static_cast<float>(direction.y()),
                        static_cast<float>(direction.z()), 0.0F};
  static_assert(offsetof(RTCRay, tnear) == offsetof(RTCRay, org_x) + 12 && offsetof(RTCRay, dir_x) % 16 == 0 &&
                    offsetof(RTCRay, time) == offsetof(RTCRay, dir_x) + 12,
                "RTCRay holds origin and tnear, direction and time side by side");
  std::memcpy(&ray.org_x, &from, sizeof from);
  std::memcpy(&ray.dir_x, &along, sizeof along);
  ray.tfar = static_cast<float>(far);
  ray.mask = static_cast<unsigned>(-1);  // Debian's Embree has ray masks on
  ray.id = 0;
  ray.flags = 0;
}

/// gone: facets that others cover; rays are to meet those.
void attach(RTCDevice device, RTCScene scene, const Actor& actor, const std::set<int>& gone,
            const Eigen::Vector3d& center, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                               3 * sizeof(float), actor.vertices.size()));
  auto* triangles = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                   3 * sizeof(unsigned), actor.triangles.size()));
  if (!vertices || !triangles) throw std::runtime_error("Embree has no memory for actor " + actor.name);
  for (std::size_t i = 0; i < actor.vertices.size(); ++i) {
    const Eigen::Vector3f v = (actor.vertices[i] - center).cast<float>();
    std::memcpy(vertices + 3 * i, v.data(), 3 * sizeof(float));
  }
  for (std::size_t i = 0; i < actor.triangles.size(); ++i) {
    const bool covered = !gone.empty() && gone.count(actor.triangle_facet[i]) > 0;
    for (int k = 0; k < 3; ++k) triangles[3 * i + k] = static_cast<unsigned>(actor.triangles[i][covered ? 0 : k]);
  }
  rtcSetGeometryMask(geometry, static_cast<unsigned>(-1));
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(scene, geometry, id);
  rtcReleaseGeometry(geometry);
}

/// Puts a committed scene into another as an instance that stands where it was made.
RTCGeometry attachInstance(RTCDevice device, RTCScene to, RTCScene what, unsigned id) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, what);
  rtcSetGeometryMask(geometry, static_cast<unsigned>(-1));
  rtcCommitGeometry(geometry);
  rtcAttachGeometryByID(to, geometry, id);
  rtcReleaseGeometry(geometry);
  return geometry;
}

/// Builds on the calling thread, so that the tree, and with it the last digit of a hit, is the same every time.
void commitAlone(RTCScene scene) {
  const tbb::global_control alone(tbb::global_control::max_allowed_parallelism, 1);
  rtcCommitScene(scene);
}

// Not RTC_BUILD_QUALITY_HIGH: its spatial splits end the program in rooms whose walls stand at an angle to the axes
// (assertion in heuristic_spatial_array.h of 3.13; RenderKit/embree pull request 489).
constexpr RTCBuildQuality kQuality = RTC_BUILD_QUALITY_MEDIUM;

}  // namespace

RayCaster::RayCaster(const Scene& scene, const std::vector<int>& movable) : embree_(new Embree) {
  Embree& e = *embree_;
  // No "threads=1" here: Embree would hold all of TBB to one thread for as long as the device lives.
  e.device = rtcNewDevice("set_affinity=0");
  if (!e.device) throw std::runtime_error("Embree cannot be started");
  e.scene = rtcNewScene(e.device);
  rtcSetSceneBuildQuality(e.scene, kQuality);
  RTCScene standing = e.scene;
  if (!movable.empty()) {
    standing = e.still = rtcNewScene(e.device);
    rtcSetSceneBuildQuality(e.still, kQuality);
  }
  Eigen::AlignedBox3d all;
  for (const Actor& actor : scene.actors) {
    for (const auto& v : actor.vertices) all.extend(v);
  }
  if (!all.isEmpty()) {
    e.center = all.center();
    e.radius_m = 0.5 * all.diagonal().norm();
  }
  e.passed_facets.resize(scene.actors.size());
  const double volume = all.isEmpty() ? 0 : (all.sizes().array() + 0.01).prod();
  for (std::size_t a = 0; a < scene.actors.size(); ++a) {
    const Actor& actor = scene.actors[a];
    e.facet_of_triangle.push_back(actor.triangle_facet);
    e.bounds.push_back(actor.bounds);
    // A shell that encloses most of the scene is the room itself: the radar is meant to be inside it.
    e.solid.push_back(actor.present && !actor.bounds.isEmpty() && actor.bounds.sizes().prod() < 0.5 * volume);
    if (!actor.present || actor.triangles.empty()) continue;
    RTCScene target = standing;
    if (actor.occludes && std::find(movable.begin(), movable.end(), static_cast<int>(a)) != movable.end()) {
      target = rtcNewScene(e.device);
      rtcSetSceneBuildQuality(target, kQuality);
      e.instances.push_back({static_cast<int>(a), target, nullptr, actor.bounds});
    } else if (!actor.occludes) {
      if (!e.passed_actors) e.passed_actors = rtcNewScene(e.device);
      target = e.passed_actors;
      for (int id : actor.facets) e.passed_facets[a].push_back(scene.facets[id]);
    }
    std::set<int> gone;
    if (!scene.uncut.empty() && target == standing) {
      for (int id : actor.facets) {
        if (!scene.facets[static_cast<std::size_t>(id)].present) gone.insert(id);
      }
    }
    attach(e.device, target, actor, gone, e.center, static_cast<unsigned>(a));
  }
  for (std::size_t i = 0; i < scene.occluders_only.size(); ++i) {
    attach(e.device, standing, scene.occluders_only[i], {}, e.center, static_cast<unsigned>(scene.actors.size() + i));
  }
  if (e.passed_actors) commitAlone(e.passed_actors);
  if (e.still) {
    commitAlone(e.still);
    attachInstance(e.device, e.scene, e.still, 0);
    unsigned id = 1;
    for (Embree::Instance& i : e.instances) {
      commitAlone(i.scene);
      i.geometry = attachInstance(e.device, e.scene, i.scene, id++);
    }
  }
  commitAlone(e.scene);
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;

void RayCaster::place(int actor, const Eigen::Isometry3d& T) {
  Embree& e = *embree_;
  const auto found =
      std::find_if(e.instances.begin(), e.instances.end(), [&](const auto& i) { return i.actor == actor; });
  if (found == e.instances.end()) {
    throw std::invalid_argument("RayCaster::place: actor " + std::to_string(actor) + " is not movable");
  }
  Eigen::Matrix<float, 3, 4> about_center;
  about_center.leftCols<3>() = T.linear().cast<float>();
  about_center.col(3) = (T * e.center - e.center).cast<float>();
  rtcSetGeometryTransform(found->geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, about_center.data());
  rtcCommitGeometry(found->geometry);
  commitAlone(e.scene);
  Eigen::AlignedBox3d& bounds = e.bounds[static_cast<std::size_t>(actor)];
  bounds = found->bounds.transformed(T);
  for (int i = 0; i < 8; ++i) {
    const auto corner = static_cast<Eigen::AlignedBox3d::CornerType>(i);
    e.radius_m = std::max(e.radius_m, (bounds.corner(corner) - e.center).norm());
  }
}

bool RayCaster::visible(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double gap_m) const {
  // Embree wants no unit direction: with the whole way as direction the ray need not wait for a root and a division,
  // which say only where on it the search begins and ends.
  const Eigen::Vector3d d = b - a, origin = a - embree_->center;
  const double square = d.squaredNorm();
  if (square <= 4 * gap_m * gap_m) return true;
  if (!castable(origin, square)) return false;
  const double gap = gap_m / std::sqrt(square);
  RTCRay ray;
  fill(ray, origin, d, gap, 1 - gap);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(embree_->scene, &context, &ray);
  if (ray.tfar < 0) return false;
  return !embree_->passed_actors || passesThroughActors(a, b, gap_m);
}

std::vector<char> RayCaster::visible(const Eigen::Vector3d& a, const std::vector<Eigen::Vector3d>& points,
                                     const std::vector<double>& gap_m) const {
  if (points.size() != gap_m.size()) throw std::invalid_argument("RayCaster::visible: one gap per point");
  constexpr std::size_t kPacket = 8;
  std::vector<char> free(points.size(), 1);
  const Eigen::Vector3d from = a - embree_->center;
  alignas(32) int valid[kPacket];
  RTCRay8 rays;
  for (std::size_t first = 0; first < points.size(); first += kPacket) {
    const std::size_t count = std::min(kPacket, points.size() - first);
    for (std::size_t i = 0; i < kPacket; ++i) {
      valid[i] = 0;
      if (i >= count) continue;
      const Eigen::Vector3d d = points[first + i] - a;
      const double square = d.squaredNorm(), gap_here_m = gap_m[first + i];
      if (square <= 4 * gap_here_m * gap_here_m) continue;  // nothing has room between them
      if (!castable(from, square)) {
        free[first + i] = 0;
        continue;
      }
      const double gap = gap_here_m / std::sqrt(square);
      valid[i] = -1;
      rays.org_x[i] = static_cast<float>(from.x());
      rays.org_y[i] = static_cast<float>(from.y());
      rays.org_z[i] = static_cast<float>(from.z());
      rays.dir_x[i] = static_cast<float>(d.x());
      rays.dir_y[i] = static_cast<float>(d.y());
      rays.dir_z[i] = static_cast<float>(d.z());
      rays.tnear[i] = static_cast<float>(gap);
      rays.tfar[i] = static_cast<float>(1 - gap);
      rays.time[i] = 0;
      rays.mask[i] = static_cast<unsigned>(-1);
      rays.id[i] = rays.flags[i] = 0;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcOccluded8(valid, embree_->scene, &context, &rays);
    for (std::size_t i = 0; i < count; ++i) {
      if (!valid[i]) continue;
      free[first + i] = !(rays.tfar[i] < 0) &&
                        (!embree_->passed_actors || passesThroughActors(a, points[first + i], gap_m[first + i]));
    }
  }
  return free;
}

bool RayCaster::passesThroughActors(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double gap_m) const {
  const Eigen::Vector3d unit = (b - a).normalized();
  const auto ends_on = [&](const std::vector<Facet>& facets) {
    for (const Facet& f : facets) {
      for (const Eigen::Vector3d& p : {a, b}) {
        if (std::abs(f.planeDistance(p)) < gap_m + f.flatness_m && f.contains(p, gap_m)) return true;
      }
    }
    return false;
  };
  const double length = (b - a).norm() - gap_m;
  double from = gap_m;
  while (from < length) {
    const Eigen::Vector3d origin = a + from * unit - embree_->center;
    if (!castable(origin, unit, length - from)) return true;
    RTCRayHit query;
    fill(query.ray, origin, unit, 0, length - from);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.primID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect1(embree_->passed_actors, &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return true;
    if (ends_on(embree_->passed_facets[query.hit.geomID])) return false;
    from += query.ray.tfar + 1e-4;
  }
  return true;
}

std::optional<RayCaster::Hit> RayCaster::firstHit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                                  double max_m) const {
  const double square = direction.squaredNorm();
  if (!(square > 0)) return std::nullopt;
  const Eigen::Vector3d from = origin - embree_->center;
  Eigen::Vector3d unit = direction;
  if (std::abs(square - 1) > 1e-14) unit /= std::sqrt(square);
  const double length = std::min(max_m, kFarthest_m);  // Embree wants finite rays
  if (!castable(from, unit, length)) return std::nullopt;
  RTCRayHit query;
  fill(query.ray, from, unit, 0, length);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Hit hit;
  hit.distance_m = query.ray.tfar;
  hit.actor = static_cast<int>(query.hit.geomID);
  // A screen's hit has the index behind the last actor and no facet.
  const auto& facets = embree_->facet_of_triangle;
  hit.facet = hit.actor < static_cast<int>(facets.size()) ? facets[hit.actor][query.hit.primID] : -1;
  hit.point = origin + hit.distance_m * unit;
  return hit;
}

std::optional<int> RayCaster::insideActor(const Eigen::Vector3d& p) const {
  // Directions without symmetry, so that none runs along a wall.
  static const std::array<Eigen::Vector3d, 7> kDirections = {
      Eigen::Vector3d(0.9137, 0.3711, 0.1653),  Eigen::Vector3d(-0.8321, 0.5113, 0.2149),
      Eigen::Vector3d(0.2917, -0.9211, 0.2579), Eigen::Vector3d(-0.3571, -0.8837, -0.3023),
      Eigen::Vector3d(0.1931, 0.4127, 0.8902),  Eigen::Vector3d(0.5483, -0.3319, -0.7676),
      Eigen::Vector3d(-0.4127, 0.6733, -0.6133)};
  std::vector<int> votes(embree_->bounds.size(), 0);
  for (const Eigen::Vector3d& d : kDirections) {
    std::vector<int> crossings(votes.size(), 0);
    Eigen::Vector3d from = p;
    for (int i = 0; i < 4096; ++i) {
      const auto hit = firstHit(from, d, std::numeric_limits<double>::infinity());
      if (!hit) break;
      if (hit->actor < static_cast<int>(crossings.size())) ++crossings[hit->actor];
      from = hit->point + 1e-4 * d.normalized();
    }
    for (std::size_t a = 0; a < votes.size(); ++a) votes[a] += crossings[a] % 2;
  }
  for (std::size_t a = 0; a < votes.size(); ++a) {
    if (votes[a] >= 6 && embree_->solid[a] && embree_->bounds[a].contains(p)) return static_cast<int>(a);
  }
  return std::nullopt;
}

}  // namespace mmradartwin
