#include "rays/image_paths.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace mmradartwin {
namespace {

constexpr double kInside_m = 1e-9;
constexpr double kOnPlane_m = 1e-7;
constexpr double kBesideInset_m = 0.01;  // within its boundary, where a facet returns what passes beside it

/// How far beside a facet a path's vertex may lie at most.
double besideReach_m(const ImageSearch::Limits& limits) {
  return limits.wavelength_m > 0 ? kDarkReach * std::sqrt(limits.wavelength_m * limits.max_length_m / 8) : 0;
}

/// The view of a point through a rectangle: the pyramid over it, outward normals as rows.
class Beam {
 public:
  Beam(const Eigen::Vector3d& apex, const Eigen::Matrix<double, 3, 4>& window) {
    const Eigen::Matrix<double, 3, 4> way = window.colwise() - apex;
    const Eigen::Vector3d middle = way.rowwise().sum();
    for (int i = 0; i < 4; ++i) {
      Eigen::Vector3d n = way.col(i).cross(way.col((i + 1) % 4));
      if (n.dot(middle) > 0) n = -n;
      sides_.row(i) = n;
    }
    limit_ = sides_ * apex + Eigen::Vector4d::Constant(1e-9);
  }
  /// False where all of a rectangle lies beyond one side.
  bool meets(const Eigen::Matrix<double, 3, 4>& corners) const {
    return ((sides_ * corners).rowwise().minCoeff() - limit_).maxCoeff() <= 0;
  }

 private:
  Eigen::Matrix<double, 4, 3> sides_;
  Eigen::Vector4d limit_;
};

}  // namespace

double legGap(const Facet& facet, const Eigen::Vector3d& direction) {
  const double cosine = std::max(0.1, std::abs(facet.normal.dot(direction)));
  return std::max(1e-3, 2 * facet.flatness_m / cosine);
}

PathLeg makeLeg(const Scene& scene, const Eigen::Vector3d& from, int from_facet, const Eigen::Vector3d& to,
                int to_facet, double before_m, double total_m) {
  const Eigen::Vector3d way = to - from;
  PathLeg leg{from, to, {from_facet, to_facet}, way.norm(), 1e-3, before_m, total_m};
  for (int facet : leg.facets) {
    if (facet < 0) continue;
    leg.gap_m = std::max(leg.gap_m, legGap(scene.facets[static_cast<std::size_t>(facet)], way / leg.length_m));
  }
  return leg;
}

PathLegs legsOf(const Scene& scene, const Eigen::Vector3d& p, const PerInteraction<int>& facets,
                const PerInteraction<Eigen::Vector3d>& vertices) {
  PathLegs legs;
  double before_m = 0;
  for (std::size_t i = 0; i <= vertices.size(); ++i) {
    const bool first = i == 0, last = i == vertices.size();
    legs.push_back(makeLeg(scene, first ? p : vertices[i - 1], first ? -1 : facets[i - 1], last ? p : vertices[i],
                           last ? -1 : facets[i], before_m, 0));
    before_m += legs.back().length_m;
  }
  for (PathLeg& leg : legs) leg.total_m = before_m;
  return legs;
}

ImageSearch::ImageSearch(const Scene& scene, bool all_orientations)
    : scene_(scene), all_orientations_(all_orientations) {
  build();
}

void ImageSearch::build() {
  reflectors_.clear();
  on_side_.clear();
  for (const Facet& f : scene_.facets) {
    if (takesPart(f)) reflectors_.push_back(f.id);
  }
  corners_.resize(reflectors_.size());
  mirrors_.resize(reflectors_.size());
  for (std::size_t i = 0; i < reflectors_.size(); ++i) place(i);
  if (exhaustiveOrder() >= 3) findSides(std::vector<char>(reflectors_.size(), 1));
}

bool ImageSearch::takesPart(const Facet& f) const {
  return f.present && f.curved < 0 && (f.reflects || all_orientations_);
}

void ImageSearch::place(std::size_t reflector) {
  const Facet& f = scene_.facets[static_cast<std::size_t>(reflectors_[reflector])];
  corners_[reflector].point << f.origin, f.origin + f.size1_m * f.e1, f.origin + f.size1_m * f.e1 + f.size2_m * f.e2,
      f.origin + f.size2_m * f.e2;
  mirrors_[reflector] = {f.normal,           f.e1,      f.e2,     f.normal.dot(f.origin), f.e1.dot(f.origin),
                         f.e2.dot(f.origin), f.size1_m, f.size2_m};
}

void ImageSearch::findSides(const std::vector<char>& marked) {
  const int count = static_cast<int>(reflectors_.size());
  const auto n = static_cast<std::size_t>(count);
  sides_.resize(n * n);
  on_side_.resize(2 * n);
  for (auto& list : on_side_) list.clear();
  for (int a = 0; a < count; ++a) {
    for (int b = 0; b < count; ++b) {
      char& known = sides_[static_cast<std::size_t>(a) * n + static_cast<std::size_t>(b)];
      if (marked[static_cast<std::size_t>(a)] || marked[static_cast<std::size_t>(b)]) {
        known = static_cast<char>((faces(a, false, b) ? 1 : 0) + (faces(a, true, b) ? 2 : 0));
      }
      if (known & 1) on_side_[static_cast<std::size_t>(2 * a)].push_back(b);
      if (known & 2) on_side_[static_cast<std::size_t>(2 * a + 1)].push_back(b);
    }
  }
}

void ImageSearch::update(const std::vector<int>& actors) {
  std::vector<char> marked(reflectors_.size(), 0);
  for (int actor : actors) {
    for (int id : scene_.actors[static_cast<std::size_t>(actor)].facets) {
      const auto at = std::lower_bound(reflectors_.begin(), reflectors_.end(), id);
      const bool known = at != reflectors_.end() && *at == id;
      if (known != takesPart(scene_.facets[static_cast<std::size_t>(id)])) {
        build();  // it lies down, or stands up again: other reflectors take part
        return;
      }
      if (!known) continue;
      const auto i = static_cast<std::size_t>(at - reflectors_.begin());
      marked[i] = 1;
      place(i);
    }
  }
  if (exhaustiveOrder() >= 3) findSides(marked);
}

int ImageSearch::exhaustiveOrder() const {
  const double n = static_cast<double>(reflectors_.size());
  if (n * n * n < 5e8) return 3;
  return n * n < 4e6 ? 2 : 1;
}

bool ImageSearch::faces(int a, bool positive_side, int b) const {
  const Facet& plane = scene_.facets[reflectors_[a]];
  const Eigen::RowVector4d d = plane.normal.transpose() * (corners_[b].point.colwise() - plane.origin);
  return positive_side ? d.maxCoeff() > kOnPlane_m : d.minCoeff() < -kOnPlane_m;
}

bool ImageSearch::solve(const Eigen::Vector3d& p, const PerInteraction<int>& sequence, const RayCaster& rays,
                        const Limits& limits, ImagePath& path) const {
  return solve(p, sequence, rays, limits, SeenSides(scene_, p), path);
}

bool ImageSearch::solve(const Eigen::Vector3d& p, const PerInteraction<int>& sequence, const RayCaster& rays,
                        const Limits& limits, const SeenSides& sides, ImagePath& path) const {
  const int order = static_cast<int>(sequence.size());
  if (order < 1 || order > 8) return false;
  std::array<Eigen::Vector3d, 8> image;
  image.fill(p);
  Eigen::Vector3d at = p;
  for (int i = 0; i < order; ++i) image[i] = at = mirror(at, scene_.facets[sequence[i]]);
  if ((image[order - 1] - p).norm() > limits.max_length_m) return false;
  std::array<Eigen::Vector3d, 8> vertex = image, met = image;
  const double total_m = (image[order - 1] - p).norm();
  bool beside = false;
  at = p;
  for (int i = order - 1; i >= 0; --i) {
    const Facet& f = scene_.facets[sequence[i]];
    const double here = f.planeDistance(at), there = f.planeDistance(image[i]);
    if (!(here * there < 0) || std::abs(here) < kOnPlane_m || std::abs(there) < kOnPlane_m) return false;
    vertex[i] = at + here / (here - there) * (image[i] - at);
    met[i] = vertex[i];
    if (!f.contains(vertex[i], kInside_m)) {
      const Eigen::Vector3d way = vertex[i] - at;
      const double length_m = way.norm();
      if (beside || !(limits.wavelength_m > 0) || length_m < 1e-9) return false;
      double after_m = length_m;
      for (int k = i + 1; k < order; ++k) after_m += (vertex[k] - (k + 1 == order ? p : vertex[k + 1])).norm();
      const double zone_m = std::sqrt(limits.wavelength_m * after_m * (total_m - after_m) / (2 * total_m));
      const double cosine = std::max(0.1, std::abs(f.normal.dot(way)) / length_m);
      if (!f.contains(vertex[i], std::min(kDarkReach * zone_m / cosine, besideReach_m(limits)))) return false;
      beside = true;
      met[i] = f.nearest(vertex[i], kBesideInset_m);
    }
    at = vertex[i];
  }
  if (limits.in_view &&
      (!limits.in_view((met[0] - p).normalized()) || !limits.in_view((met[order - 1] - p).normalized()))) {
    return false;
  }
  for (int i = 0; i < order; ++i) {
    const Facet& f = scene_.facets[sequence[i]];
    if (!sides.isOpen(f, met[i], i == 0 ? p : met[i - 1]) ||
        !sides.isOpen(f, met[i], i + 1 == order ? p : met[i + 1])) {
      return false;
    }
  }
  double before_m = 0;
  for (int i = 0; i <= order; ++i) {
    const bool first = i == 0, last = i == order;
    const PathLeg leg = makeLeg(scene_, first ? p : met[i - 1], first ? -1 : sequence[i - 1], last ? p : met[i],
                                last ? -1 : sequence[i], before_m, total_m);
    if (leg.length_m < 1e-9) return false;
    if (!rays.visible(leg.from, leg.to, leg.gap_m) && !(limits.passes && limits.passes(leg))) return false;
    before_m += leg.length_m;
  }
  path.facets = sequence;
  path.vertices.assign(vertex.begin(), vertex.begin() + order);
  path.met.assign(met.begin(), met.begin() + order);
  path.beside = beside;
  path.image = image[order - 1];
  return true;
}

/// One search from one point.
class ImageSearch::Finder {
 public:
  Finder(const ImageSearch& search, const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
         int min_order)
      : search_(search),
        p_(p),
        rays_(rays),
        limits_(limits),
        sides_(search.scene_, p),
        min_order_(min_order),
        reach_m_(std::max(1e-6, besideReach_m(limits))),
        in_front_(search.reflectors_.size(), 1),
        wanted_(search.reflectors_.size(), 1),
        ways_to_(limits.max_order < 3 ? 0 : search.reflectors_.size()) {
    const int count = static_cast<int>(search.reflectors_.size());
    for (int i = 0; i < count; ++i) {
      if (limits.forward.squaredNorm() > 0) {
        in_front_[i] = (limits.forward.transpose() * (search.corners_[i].point.colwise() - p)).maxCoeff() > 0;
      }
      if (limits.only_actor >= 0) wanted_[i] = facet(i).actor == limits.only_actor;
      if (search.on_side_.empty()) all_.push_back(i);
      windows_.push_back(window(static_cast<std::size_t>(i)));
    }
    for (const Mirror& m : search.mirrors_) {
      own_.push_back({m.normal.dot(p) - m.offset_m, m.e1.dot(p) - m.first1_m, m.e2.dot(p) - m.first2_m});
    }
  }

  std::vector<ImagePath> find() {
    for (int a = 0; a < static_cast<int>(in_front_.size()); ++a) {
      if (in_front_[a]) addFrom(a);
    }
    for (std::size_t b = 0; b < ways_to_.size(); ++b) addOver(static_cast<int>(b));
    return distinct();
  }

 private:
  // The point's distance from a plane, and its place in the rectangle's axes.
  struct Own {
    double distance_m, along1_m, along2_m;
  };
  struct Way {
    int first;
    Eigen::Vector3d image;  // of p in the first facet
  };

  const Facet& facet(int reflector) const { return search_.scene_.facets[search_.reflectors_[reflector]]; }

  /// The bounding rectangle with what lies beside it and still counts.
  Eigen::Matrix<double, 3, 4> window(std::size_t reflector) const {
    Eigen::Matrix<double, 3, 4> corners = search_.corners_[reflector].point;
    if (!(limits_.wavelength_m > 0)) return corners;
    const Mirror& m = search_.mirrors_[reflector];
    const Eigen::Vector3d sum = reach_m_ * (m.e1 + m.e2), difference = reach_m_ * (m.e1 - m.e2);
    corners.col(0) -= sum;
    corners.col(1) += difference;
    corners.col(2) += sum;
    corners.col(3) -= difference;
    return corners;
  }

  double beyond_m(int b, const Eigen::Vector3d& image) const {
    const Mirror& m = search_.mirrors_[static_cast<std::size_t>(b)];
    return m.normal.dot(image) - m.offset_m;
  }

  /// The last facet is tried by where the straight line from p to the image meets its plane, which is cheap. beyond_m:
  /// distance of the image before from the plane.
  bool meetsLast(int b, double beyond_m, const Eigen::Vector3d& image_before) const {
    const Mirror& m = search_.mirrors_[static_cast<std::size_t>(b)];
    const Own& o = own_[static_cast<std::size_t>(b)];
    if (!(o.distance_m * beyond_m > 0)) return false;
    const double share = o.distance_m / (o.distance_m + beyond_m);
    const double x = o.along1_m + share * (m.e1.dot(image_before) - m.first1_m - o.along1_m);
    if (!(x > -reach_m_ && x < m.size1_m + reach_m_)) return false;
    const double y = o.along2_m + share * (m.e2.dot(image_before) - m.first2_m - o.along2_m);
    if (!(y > -reach_m_ && y < m.size2_m + reach_m_)) return false;
    const double beside_m = std::max({-x, x - m.size1_m, -y, y - m.size2_m});
    if (beside_m < 1e-6) return true;
    // What solve() will ask for: the path goes straight to the image beyond the plane.
    const double normal_m = std::abs(o.distance_m + beyond_m), difference_m = o.distance_m - beyond_m;
    const double length2 = (image_before - p_).squaredNorm() - difference_m * difference_m + normal_m * normal_m;
    const double zone2 = 0.5 * limits_.wavelength_m * std::sqrt(length2) * share * (1 - share);
    return beside_m * beside_m * normal_m * normal_m <= kDarkReach * kDarkReach * zone2 * length2 * 1.0001;
  }

  void addSolved(const PerInteraction<int>& sequence) {
    if (search_.solve(p_, sequence, rays_, limits_, sides_, path_)) found_.push_back(path_);
  }

  /// Adds paths of one and two bounces whose first facet is a, and keeps the ways over it for those of three.
  void addFrom(int a) {
    const Facet& fa = facet(a);
    const double da = fa.planeDistance(p_);
    if (std::abs(da) < kOnPlane_m) return;
    if (min_order_ <= 1 && wanted_[a]) addSolved({fa.id});
    if (limits_.max_order < 2) return;
    const Eigen::Vector3d image1 = mirror(p_, fa);
    const Beam beam(image1, windows_[static_cast<std::size_t>(a)]);
    const bool any_side = search_.on_side_.empty();
    for (int b : any_side ? all_ : search_.on_side_[static_cast<std::size_t>(2 * a + (da > 0))]) {
      // Cheap tests first: few facets pass them where no third bounce follows.
      const double db = beyond_m(b, image1);
      if (b == a || std::abs(db) < kOnPlane_m) continue;
      const bool last = min_order_ <= 2 && (wanted_[a] || wanted_[b]) && in_front_[b] && meetsLast(b, db, image1);
      if ((!last && limits_.max_order < 3) || (any_side && !search_.faces(a, da > 0, b))) continue;
      if (!beam.meets(windows_[static_cast<std::size_t>(b)])) continue;
      const Facet& fb = facet(b);
      if (last && !perpendicular(fa, fb)) addSolved({fa.id, fb.id});
      if (limits_.max_order >= 3) ways_to_[static_cast<std::size_t>(b)][db > 0].push_back({a, image1});
    }
  }

  /// Adds paths of three bounces whose middle facet is b.
  void addOver(int b) {
    const Facet& fb = facet(b);
    for (const std::vector<Way>& ways : ways_to_[static_cast<std::size_t>(b)]) {
      for (std::size_t i = 0; i < ways.size(); ++i) {
        const int a = ways[i].first;
        const int fa = search_.reflectors_[a];
        const Eigen::Vector3d image2 = mirror(ways[i].image, fb);
        for (std::size_t j = i; j < ways.size(); ++j) {
          const int c = ways[j].first;
          if (!(wanted_[a] || wanted_[b] || wanted_[c]) || !meetsLast(c, beyond_m(c, image2), image2)) continue;
          const int fc = search_.reflectors_[c];
          addSolved({fa, fb.id, fc});
          if (c != a) addSolved({fc, fb.id, fa});
        }
      }
    }
  }

  /// The paths found, in the order of facets. Where the line to an image runs through an edge, several orders of the
  /// same facets are one path.
  std::vector<ImagePath> distinct() {
    // Those that meet all their facets come first: they are the ones to keep.
    std::sort(found_.begin(), found_.end(), [](const ImagePath& a, const ImagePath& b) {
      return std::tie(a.beside, a.facets) < std::tie(b.beside, b.facets);
    });
    std::vector<ImagePath> unique;
    for (const ImagePath& f : found_) {
      PerInteraction<int> set = f.facets;
      std::sort(set.begin(), set.end());
      bool known = false;
      for (const ImagePath& u : unique) {
        if (u.facets.size() != f.facets.size() || f.facets.size() < 2 || (u.image - f.image).norm() > 1e-6) continue;
        PerInteraction<int> other = u.facets;
        std::sort(other.begin(), other.end());
        known = known || other == set;
      }
      if (!known) unique.push_back(f);
    }
    std::sort(unique.begin(), unique.end(), [](const ImagePath& a, const ImagePath& b) { return a.facets < b.facets; });
    return unique;
  }

  const ImageSearch& search_;
  const Eigen::Vector3d& p_;
  const RayCaster& rays_;
  const Limits& limits_;
  const SeenSides sides_;
  const int min_order_;
  const double reach_m_;        // how far beside a facet a path may meet its plane
  std::vector<char> in_front_;  // can be first or last: some of the facet lies in front of the radar
  std::vector<char> wanted_;    // of Limits::only_actor
  std::vector<Own> own_;
  std::vector<Eigen::Matrix<double, 3, 4>> windows_;
  std::vector<int> all_;  // reflectors, where sides are not known
  // Ways over one facet towards another, by the side of the other that they come to. A path of three bounces runs both
  // ways: it is one of these from either end, in the middle.
  std::vector<std::array<std::vector<Way>, 2>> ways_to_;
  std::vector<ImagePath> found_;
  ImagePath path_;  // one for all: its lists keep their memory
};

std::vector<ImagePath> ImageSearch::find(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                                         int min_order) const {
  return Finder(*this, p, rays, limits, min_order).find();
}

/// The facet that a place belongs to where several coincide.
const Facet& ImageSearch::ownerOf(const RayCaster::Hit& hit) const {
  for (const FaceOverlap& o : scene_.overlaps) {
    const Facet& kept = scene_.facets[static_cast<std::size_t>(o.kept)];
    if (o.cut == hit.facet && kept.contains(hit.point)) return kept;
  }
  return scene_.facets[static_cast<std::size_t>(hit.facet)];
}

std::vector<ImageSearch::Seed> ImageSearch::seeds(const Eigen::Vector3d& p, const RayCaster& rays, const Limits& limits,
                                                  int rays_launched, const Eigen::Matrix3d& R_map_radar,
                                                  double max_elevation_rad) const {
  std::map<PerInteraction<int>, bool> sequences;  // and whether an even ray met it
  const double golden = 0.6180339887498949;
  for (int i = 0; i < rays_launched; ++i) {
    const double azimuth = M_PI * ((i + 0.5) / rays_launched - 0.5);
    const double elevation = std::asin(std::sin(max_elevation_rad) * (2 * std::fmod(i * golden, 1.0) - 1));
    Eigen::Vector3d d = R_map_radar * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    Eigen::Vector3d from = p;
    PerInteraction<int> sequence;
    double length = 0;
    while (static_cast<int>(sequence.size()) < limits.max_order) {
      const auto hit = rays.firstHit(from, d, limits.max_length_m - length);
      if (!hit || hit->facet < 0) break;
      const Facet& f = ownerOf(*hit);
      if (!f.reflects || !f.present || f.curved >= 0) break;
      sequence.push_back(f.id);
      bool& even = sequences[sequence];
      even = even || i % 2 == 0;
      length += hit->distance_m;
      d -= 2 * d.dot(f.normal) * f.normal;
      const double side = f.planeDistance(from) > 0 ? 1.0 : -1.0;
      from = hit->point + (1e-4 + f.flatness_m) * side * f.normal;
    }
  }
  std::vector<Seed> found;
  for (const auto& [facets, even] : sequences) found.push_back({facets, even});
  return found;
}

}  // namespace mmradartwin
