#include "scene/facet_relations.h"

#include <algorithm>
#include <cmath>

#include "scene/polygon_set.h"

namespace mmradartwin {
namespace {

constexpr double kParallel = 0.7;          // |cos| of the angle between layers
constexpr double kLeastLayer_m2 = 2.5e-3;  // smaller ones are a scan's noise, and no reflection forms on them
constexpr double kStrip_m = 0.25;
constexpr double kMostStrips = 256;
constexpr double kOnePlane = 1 - 1e-6;  // and between faces of one plane; their corners tell the rest
constexpr double kApart_m = 1e-5;       // layers keep this distance everywhere
constexpr double kOnBody = 0.999;       // of a sheet's area: it lies on a body's face and is seen from there alone
constexpr double kHollow = 0.5;         // of the scene's volume: a shell about more is the room itself

Eigen::AlignedBox3d boxOf(const Facet& f, double margin_m) {
  Eigen::AlignedBox3d box;
  for (double x : {0.0, f.size1_m}) {
    for (double y : {0.0, f.size2_m}) box.extend(f.origin + x * f.e1 + y * f.e2);
  }
  return {box.min() - Eigen::Vector3d::Constant(margin_m), box.max() + Eigen::Vector3d::Constant(margin_m)};
}

Eigen::Vector2d inPlane(const Facet& f, const Eigen::Vector3d& p) {
  return {(p - f.origin).dot(f.e1), (p - f.origin).dot(f.e2)};
}

/// Heights of b's plane over a's at the corners of the rectangle of a in which both lie; false where that is empty.
bool heightsOver(const Facet& a, const Facet& b, std::array<double, 4>& height_m) {
  Eigen::AlignedBox2d common;
  for (double x : {0.0, b.size1_m}) {
    for (double y : {0.0, b.size2_m}) common.extend(inPlane(a, b.origin + x * b.e1 + y * b.e2));
  }
  common = common.intersection(Eigen::AlignedBox2d(Eigen::Vector2d::Zero(), Eigen::Vector2d(a.size1_m, a.size2_m)));
  if (common.isEmpty() || common.sizes().minCoeff() < kApart_m) return false;
  const double cosine = a.normal.dot(b.normal);
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector2d q = common.corner(static_cast<Eigen::AlignedBox2d::CornerType>(i));
    height_m[i] = -b.planeDistance(a.origin + q.x() * a.e1 + q.y() * a.e2) / cosine;
  }
  return true;
}

/// b's loops in a's plane, outer ones counter-clockwise there.
PlaneLoops loopsIn(const Facet& a, const Facet& b) {
  PlaneLoops loops;
  for (const auto& loop : b.loops) {
    loops.emplace_back();
    for (const Eigen::Vector2d& q : loop) loops.back().push_back(inPlane(a, b.origin + q.x() * b.e1 + q.y() * b.e2));
    if (a.normal.dot(b.normal) < 0) std::reverse(loops.back().begin(), loops.back().end());
  }
  return loops;
}

class Relations {
 public:
  explicit Relations(Scene& scene) : scene_(scene) {
    Eigen::AlignedBox3d room;
    for (const Actor& a : scene.actors) room.extend(a.bounds);
    const double volume = room.isEmpty() ? 0 : (room.sizes().array() + 0.01).prod();
    for (const Actor& a : scene.actors)
      hollow_.push_back(!a.bounds.isEmpty() && a.bounds.sizes().prod() >= kHollow * volume);
  }

  void find() {
    sweep(0.5 * kLayer_m, kLeastLayer_m2, [this](Facet& a, Facet& b) { addLayers(a, b); });
    sweep(0.5 * kSamePlane_m, 0, [this](const Facet& a, const Facet& b) { addOverlap(a, b); });
    for (Facet& f : scene_.facets) std::sort(f.layers.begin(), f.layers.end());
    std::sort(found_.begin(), found_.end(),
              [](const Pair& p, const Pair& q) { return std::make_pair(p.a, p.b) < std::make_pair(q.a, q.b); });
    cutAll();
  }

 private:
  /// Calls f with each two facets, the lower id first, whose bounding boxes come as near as twice the margin.
  template <typename F>
  void sweep(double margin_m, double least_m2, F f) {
    struct Box {
      Eigen::AlignedBox3d box;
      int id;
    };
    std::vector<Box> boxes;
    Eigen::AlignedBox3d all;
    for (const Facet& facet : scene_.facets) {
      if (!scene_.actors[static_cast<std::size_t>(facet.actor)].present || facet.area_m2 < least_m2) continue;
      boxes.push_back({boxOf(facet, margin_m), facet.id});
      all.extend(boxes.back().box);
    }
    if (boxes.empty()) return;
    std::stable_sort(boxes.begin(), boxes.end(),
                     [](const Box& a, const Box& b) { return a.box.min().x() < b.box.min().x(); });
    // Along x within strips of y; two boxes are met in the first strip that both lie in.
    const double width_m = std::max(kStrip_m, all.sizes().y() / kMostStrips);
    const auto strip = [&](double y) { return static_cast<std::size_t>((y - all.min().y()) / width_m); };
    std::vector<std::vector<Box>> strips(strip(all.max().y()) + 1);
    for (const Box& b : boxes) {
      for (std::size_t i = strip(b.box.min().y()); i <= strip(b.box.max().y()); ++i) strips[i].push_back(b);
    }
    for (std::size_t s = 0; s < strips.size(); ++s) {
      const std::vector<Box>& in = strips[s];
      for (std::size_t i = 0; i < in.size(); ++i) {
        for (std::size_t j = i + 1; j < in.size() && in[j].box.min().x() <= in[i].box.max().x(); ++j) {
          if (!in[i].box.intersects(in[j].box)) continue;
          if (strip(std::max(in[i].box.min().y(), in[j].box.min().y())) != s) continue;
          f(scene_.facets[static_cast<std::size_t>(std::min(in[i].id, in[j].id))],
            scene_.facets[static_cast<std::size_t>(std::max(in[i].id, in[j].id))]);
        }
      }
    }
  }

  /// Side that a facet is seen from, in the direction of a normal: 0 where from both.
  int side(const Facet& f, const Eigen::Vector3d& normal) const {
    if (hollow_[static_cast<std::size_t>(f.actor)]) return 0;
    return f.normal.dot(normal) > 0 ? f.outside : -f.outside;
  }

  void addLayers(Facet& a, Facet& b) const {
    std::array<double, 4> height_m;
    if (std::abs(a.normal.dot(b.normal)) < kParallel || !heightsOver(a, b, height_m)) return;
    const double low = *std::min_element(height_m.begin(), height_m.end());
    const double high = *std::max_element(height_m.begin(), height_m.end());
    const double apart = kApart_m + a.flatness_m + b.flatness_m;
    if ((low > apart && low < kLayer_m) || (high < -apart && high > -kLayer_m)) {
      a.layers.push_back(b.id);
      b.layers.push_back(a.id);
    }
  }

  void addOverlap(const Facet& a, const Facet& b) {
    std::array<double, 4> height_m;
    if (std::abs(a.normal.dot(b.normal)) < kOnePlane || !heightsOver(a, b, height_m)) return;
    const double low = *std::min_element(height_m.begin(), height_m.end());
    const double high = *std::max_element(height_m.begin(), height_m.end());
    if (low > kSamePlane_m || high < -kSamePlane_m) return;
    const int side_a = side(a, a.normal), side_b = side(b, a.normal);
    if (side_a * side_b < 0) return;  // bodies that touch: neither is seen there
    const PlaneLoops common = commonPart(a.loops, loopsIn(a, b));
    double extent = 0;
    for (const auto& loop : common) {
      Eigen::AlignedBox2d box;
      for (const Eigen::Vector2d& q : loop) {
        box.extend(q);
        if (std::abs(b.planeDistance(a.origin + q.x() * a.e1 + q.y() * a.e2)) > kSamePlane_m) return;
      }
      extent = std::max(extent, box.sizes().maxCoeff());
    }
    const double area = areaWithin(common);
    if (area <= kSamePlane_m * extent) return;  // they lie side by side
    found_.push_back({a.id, b.id, side_a, side_b, area});
  }

  struct Pair {
    int a, b, side_a, side_b;
    double area_m2;
  };

  const Facet& facet(int id) const { return scene_.facets[static_cast<std::size_t>(id)]; }
  bool alike(const Pair& p) const {
    return scene_.actors[static_cast<std::size_t>(facet(p.a).actor)].material_tag ==
           scene_.actors[static_cast<std::size_t>(facet(p.b).actor)].material_tag;
  }

  /// Cuts what is in the wrong place, in an order in which each part of a plane keeps one owner: faces of bodies where
  /// a sheet lies, then the smaller of one material, then the larger of two.
  void cutAll() {
    const auto larger = [&](const Pair& p) { return facet(p.b).area_m2 > facet(p.a).area_m2 * (1 + 1e-6) ? p.b : p.a; };
    std::vector<FaceOverlap> cuts[3];
    for (const Pair& p : found_) {
      const bool sheet_a = p.side_a == 0, sheet_b = p.side_b == 0;
      const bool equal = std::abs(facet(p.a).area_m2 - facet(p.b).area_m2) <= 1e-6 * facet(p.a).area_m2;
      int kept = larger(p), step = 1;
      const bool on_body = p.area_m2 > kOnBody * facet(sheet_a ? p.a : p.b).area_m2;
      if (sheet_a != sheet_b && !on_body) {
        kept = sheet_a ? p.a : p.b;
        step = 0;
      } else if (!alike(p)) {
        if (!equal) kept = p.a + p.b - kept;
        step = 2;
      }
      cuts[step].push_back({kept, p.a + p.b - kept, p.area_m2});
    }
    for (auto& list : cuts) {
      // By what was whole before this step, so that the order of pairs does not matter.
      const std::vector<Facet> before = list.empty() ? std::vector<Facet>() : scene_.facets;
      for (const FaceOverlap& c : list) {
        cut(scene_.facets[static_cast<std::size_t>(c.cut)], before[static_cast<std::size_t>(c.kept)]);
        if (&list != &cuts[0] || facesInto(facet(c.kept), facet(c.cut))) scene_.overlaps.push_back(c);
      }
    }
  }

  /// True where a body's face looks into the room whose wall it lies in, not out of it as furniture's back does.
  static bool facesInto(const Facet& room, const Facet& face) {
    return room.outside * face.outside * room.normal.dot(face.normal) < 0;
  }

  void cut(Facet& f, const Facet& by) {
    if (!f.present || !by.present) return;
    scene_.uncut.try_emplace(f.id, FacetShape{f.loops, f.area_m2, f.rectangle});
    const double whole_m2 = areaWithin(f.loops);
    PlaneLoops rest = without(f.loops, loopsIn(f, by));
    const double left_m2 = areaWithin(rest);
    if (left_m2 <= kSamePlane_m * std::max(f.size1_m, f.size2_m) || !(whole_m2 > 0)) {
      f.present = false;
      return;
    }
    f.area_m2 *= left_m2 / whole_m2;
    f.loops = std::move(rest);
    f.rectangle = false;
  }

  Scene& scene_;
  std::vector<char> hollow_;  // [actor]
  std::vector<Pair> found_;
};

}  // namespace

void relateFacets(Scene& scene) {
  for (const auto& [id, shape] : scene.uncut) {
    Facet& f = scene.facets[static_cast<std::size_t>(id)];
    f.loops = shape.loops;
    f.area_m2 = shape.area_m2;
    f.rectangle = shape.rectangle;
    f.present = scene.actors[static_cast<std::size_t>(f.actor)].present;
  }
  scene.uncut.clear();
  scene.overlaps.clear();
  for (Facet& f : scene.facets) f.layers.clear();
  Relations(scene).find();
}

}  // namespace mmradartwin
