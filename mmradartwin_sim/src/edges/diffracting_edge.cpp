#include "edges/diffracting_edge.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "edges/wedge_diffraction.h"
#include "physics/aperture.h"
#include "scene/vertex_weld.h"

namespace mmradartwin {
namespace {

constexpr double kSmallestFold_rad = 20 * M_PI / 180;
constexpr double kTouch_m = 0.003;  // another facet this near covers the edge
constexpr double kShortest_m = 0.02;
constexpr double kSmallestFactor = 0.01;

/// A triangle's side that lies between two facets or bounds one.
struct Piece {
  Eigen::Vector3d p, q;                // ends
  Eigen::Vector3d beside_a, beside_b;  // third vertices of the triangles
};

using Pieces = std::map<std::pair<int, int>, std::vector<Piece>>;  // by facets

void addPieces(const Scene& scene, const Actor& actor, EdgesOf those, Pieces& pieces) {
  struct Side {
    int u, v, triangle, third;
  };
  const std::vector<int> weld = weldVertices(actor.vertices);
  std::vector<Side> sides;
  for (std::size_t t = 0; t < actor.triangles.size(); ++t) {
    if (actor.triangle_facet[t] < 0) continue;
    for (int i = 0; i < 3; ++i) {
      const int a = weld[actor.triangles[t][i]], b = weld[actor.triangles[t][(i + 1) % 3]];
      const int c = weld[actor.triangles[t][(i + 2) % 3]];
      if (a != b) sides.push_back({std::min(a, b), std::max(a, b), static_cast<int>(t), c});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::make_tuple(x.u, x.v, x.triangle) < std::make_tuple(y.u, y.v, y.triangle);
  });
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].u == sides[i].u && sides[end].v == sides[i].v) ++end;
    if (end - i <= 2) {
      Side first = sides[i], last = sides[end - 1];
      int a = actor.triangle_facet[first.triangle], b = actor.triangle_facet[last.triangle];
      if (a > b) {
        std::swap(a, b);
        std::swap(first, last);
      }
      const bool rim = end - i == 1;
      const bool chords = scene.facets[a].curved >= 0 && scene.facets[a].curved == scene.facets[b].curved;
      const bool counts = those == EdgesOf::kAllFacets || (scene.facets[a].reflects && scene.facets[b].reflects);
      if ((rim || (a != b && !chords)) && counts) {
        pieces[{a, b}].push_back({actor.vertices[first.u], actor.vertices[first.v], actor.vertices[first.third],
                                  actor.vertices[last.third]});
      }
    }
    i = end;
  }
}

/// Whether a point of an edge of a and b is covered by another facet, or lies inside facet a itself.
class Cover {
 public:
  explicit Cover(const Scene& scene) : scene_(scene) {
    for (const Facet& f : scene.facets) {
      Eigen::AlignedBox3d box;
      for (double x : {0.0, f.size1_m}) {
        for (double y : {0.0, f.size2_m}) box.extend(f.origin + x * f.e1 + y * f.e2);
      }
      boxes_.emplace_back(box.min().array() - kTouch_m, box.max().array() + kTouch_m);
    }
  }
  std::vector<int> near(const Eigen::AlignedBox3d& edge, int a, int b) const {
    std::vector<int> found;
    for (std::size_t i = 0; i < boxes_.size(); ++i) {
      const int id = static_cast<int>(i);
      if (id != a && id != b && scene_.facets[i].present && boxes_[i].intersects(edge)) found.push_back(id);
    }
    return found;
  }
  bool covered(const Eigen::Vector3d& p, const std::vector<int>& candidates) const {
    for (int id : candidates) {
      const Facet& f = scene_.facets[id];
      if (std::abs(f.planeDistance(p)) < kTouch_m && f.contains(p, kTouch_m)) return true;
    }
    return false;
  }

 private:
  const Scene& scene_;
  std::vector<Eigen::AlignedBox3d> boxes_;
};

Eigen::Vector3d inFace(const Facet& face, const Eigen::Vector3d& along, const Eigen::Vector3d& origin,
                       const Eigen::Vector3d& beside) {
  Eigen::Vector3d into = face.normal.cross(along).normalized();
  return into.dot(beside - origin) < 0 ? Eigen::Vector3d(-into) : into;
}

void addEdges(const Scene& scene, const Cover& cover, std::pair<int, int> facets, std::vector<Piece> pieces,
              std::vector<DiffractingEdge>& edges) {
  const Facet &a = scene.facets[facets.first], &b = scene.facets[facets.second];
  const double off_line = 0.002 + a.flatness_m + b.flatness_m;
  while (!pieces.empty()) {
    // The longest piece tells the line; all pieces on it are one edge.
    const auto longest = std::max_element(pieces.begin(), pieces.end(), [](const Piece& x, const Piece& y) {
      return (x.q - x.p).norm() < (y.q - y.p).norm() * (1 - 1e-9);
    });
    const Piece seed = *longest;
    const Eigen::Vector3d along = (seed.q - seed.p).normalized();
    const auto offLine = [&](const Eigen::Vector3d& x) { return (x - seed.p).cross(along).norm(); };
    std::vector<std::pair<double, double>> intervals;
    std::vector<Piece> rest;
    for (const Piece& piece : pieces) {
      if (offLine(piece.p) < off_line && offLine(piece.q) < off_line) {
        const double t = (piece.p - seed.p).dot(along), u = (piece.q - seed.p).dot(along);
        intervals.emplace_back(std::min(t, u), std::max(t, u));
      } else {
        rest.push_back(piece);
      }
    }
    pieces = std::move(rest);
    std::sort(intervals.begin(), intervals.end());
    DiffractingEdge edge;
    edge.a = a.id;
    edge.b = b.id;
    edge.along = along;
    edge.into_a = inFace(a, along, seed.p, seed.beside_a);
    if (a.id == b.id) {
      edge.n = 2;
      edge.side = edge.into_a.cross(along).normalized();
      edge.outward = -edge.into_a;
    } else {
      const Eigen::Vector3d into_b = inFace(b, along, seed.p, seed.beside_b);
      const double inner = std::acos(std::min(1.0, std::max(-1.0, edge.into_a.dot(into_b))));
      if (M_PI - inner < kSmallestFold_rad || inner < 0.01) continue;
      edge.n = 2 - inner / M_PI;
      edge.side = -(into_b - into_b.dot(edge.into_a) * edge.into_a).normalized();
      edge.outward = -(edge.into_a + into_b).normalized();
    }
    for (std::size_t i = 0; i < intervals.size();) {
      double low = intervals[i].first, high = intervals[i].second;
      for (++i; i < intervals.size() && intervals[i].first < high + 1e-4; ++i)
        high = std::max(high, intervals[i].second);
      if (high - low < kShortest_m) continue;
      const int steps = std::max(4, static_cast<int>(std::ceil((high - low) / 0.05)));
      const double step = (high - low) / steps;
      Eigen::AlignedBox3d box(seed.p + low * along);
      box.extend(seed.p + high * along);
      const std::vector<int> candidates = cover.near(box, a.id, b.id);
      int begin = -1;
      for (int k = 0; k <= steps; ++k) {
        bool open = k < steps;
        if (open) {
          const Eigen::Vector3d p = seed.p + (low + (k + 0.5) * step) * along;
          open = !cover.covered(p, candidates);
          if (a.id == b.id) open = open && !a.contains(p - kTouch_m * edge.into_a);
        }
        if (open && begin < 0) begin = k;
        if (!open && begin >= 0) {
          edge.origin = seed.p + (low + begin * step) * along;
          edge.length_m = (k - begin) * step;
          begin = -1;
          if (edge.length_m >= kShortest_m) edges.push_back(edge);
        }
      }
    }
  }
}

/// Reflection coefficients (soft, hard) of a face for rays at a grazing angle to it.
Fresnel faceReflection(const Material& material, double cosine, double frequency_hz) {
  Fresnel r = fresnel(material, cosine, frequency_hz);
  if (material.model == MaterialModel::kDielectric && std::isfinite(material.thickness_m)) {
    r = slab(material, cosine, frequency_hz).reflection;
  }
  const double share = specularShare(material);
  return {share * r.te, share * r.tm};
}

}  // namespace

std::vector<DiffractingEdge> findDiffractingEdges(const Scene& scene, EdgesOf those) {
  std::vector<DiffractingEdge> edges;
  const Cover cover(scene);
  for (const Actor& actor : scene.actors) {
    if (!actor.present) continue;
    Pieces pieces;
    addPieces(scene, actor, those, pieces);
    for (auto& [facets, list] : pieces) addEdges(scene, cover, facets, std::move(list), edges);
  }
  return edges;
}

std::optional<EdgeReturn> diffract(const PoseContext& context, const DiffractingEdge& edge,
                                   const Eigen::Vector3d& source, const Eigen::Vector3d& observer,
                                   const std::function<ComplexVector(const Eigen::Vector3d& point)>& incident,
                                   const Eigen::Vector3d& up) {
  const auto across = [&edge](const Eigen::Vector3d& p) {
    const Eigen::Vector3d d = p - edge.origin;
    return Eigen::Vector3d(d.dot(edge.into_a), d.dot(edge.side), d.dot(edge.along));
  };
  const Eigen::Vector3d s = across(source), o = across(observer);
  const double rho_s = std::hypot(s.x(), s.y()), rho_o = std::hypot(o.x(), o.y());
  if (rho_s < 1e-3 || rho_o < 1e-3) return std::nullopt;
  const auto angle = [](const Eigen::Vector3d& p) {
    const double phi = std::atan2(p.y(), p.x());
    return phi < 0 ? phi + 2 * M_PI : phi;
  };
  const double phi_in = angle(s), phi = angle(o);
  if (phi_in >= edge.n * M_PI || phi >= edge.n * M_PI) return std::nullopt;

  const double at = (rho_s * o.z() + rho_o * s.z()) / (rho_s + rho_o);
  if (at < 0 || at > edge.length_m) return std::nullopt;
  EdgeReturn result;
  const double s1 = std::hypot(rho_s, at - s.z()), s2 = std::hypot(rho_o, at - o.z());
  const double sin_beta = rho_s / s1, wavelength = context.radar.wavelength_m();
  const double unit = sin_beta * std::sqrt(2 * (s1 + s2) / (wavelength * s1 * s2));
  const std::complex<double> ends = apertureAxis(-at * unit, (edge.length_m - at) * unit);
  if (std::abs(ends) < kSmallestFactor) return std::nullopt;
  result.point = edge.origin + at * edge.along;
  const Eigen::Vector3d in = (result.point - source) / s1, out = (observer - result.point) / s2;
  const auto turn = [&edge](double f) -> Eigen::Vector3d {
    return std::cos(f) * edge.side - std::sin(f) * edge.into_a;
  };
  const Eigen::Vector3d phi_hat_in = turn(phi_in), phi_hat = turn(phi);
  const Eigen::Vector3d beta_hat_in = in.cross(phi_hat_in), beta_hat = out.cross(phi_hat);
  const auto face = [&](int id, double grazing) {
    const Material& material = context.scene.actors[context.scene.facets[id].actor].material;
    return faceReflection(material, std::min(1.0, std::abs(std::sin(grazing)) * sin_beta), context.frequency_hz);
  };
  const Fresnel gamma_0 = face(edge.a, phi_in), gamma_n = face(edge.b, edge.n * M_PI - phi);
  const double k = 2 * M_PI / wavelength, L = s1 * s2 / (s1 + s2) * sin_beta * sin_beta;
  const WedgeGeometry wedge{edge.n, phi, phi_in, L, sin_beta};
  const std::complex<double> soft = wedgeCoefficient(wedge, k, gamma_0.te, gamma_n.te);
  const std::complex<double> hard = wedgeCoefficient(wedge, k, gamma_0.tm, gamma_n.tm);
  const ComplexVector field = incident(result.point);
  const Eigen::Vector3d receive = verticalField(up, -out);
  const auto dot = [](const ComplexVector& f, const Eigen::Vector3d& v) {
    return f.x() * v.x() + f.y() * v.y() + f.z() * v.z();
  };
  const std::complex<double> co =
      -soft * dot(field, beta_hat_in) * beta_hat.dot(receive) - hard * dot(field, phi_hat_in) * phi_hat.dot(receive);
  result.factor = co * ends / std::sqrt(s1 * s2 * (s1 + s2));
  return result;
}

double lengthOverEdge(const DiffractingEdge& edge, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d da = a - edge.origin, db = b - edge.origin;
  const double za = da.dot(edge.along), zb = db.dot(edge.along);
  const double ra = (da - za * edge.along).norm(), rb = (db - zb * edge.along).norm();
  return std::hypot(ra + rb, za - zb);
}

}  // namespace mmradartwin
