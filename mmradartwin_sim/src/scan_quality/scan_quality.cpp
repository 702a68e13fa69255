#include "mmradartwin_sim/scan_quality.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <unordered_set>

#include "mmradartwin_sim/ray_caster.h"
#include "mmradartwin_sim/scene.h"
#include "scan_quality/scan_pictures.h"
#include "scan_quality/traced_actors.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kPlaces = 200, kDraws = 20000, kRaysEach = 64, kNeighbours = 24;
constexpr double kFree_m = 0.3;  ///< around a place where a radar may stand
constexpr double kCell_m = 0.1;  ///< of the grid of what the scan has
// Around a ray that left through a slot of 5 cm, rays on a circle of 10 cm leave on 16 % of it; in the corner of an
// opening on 25 %.
constexpr double kCircle_m = 0.1, kSlot = 0.2;
constexpr double kFar_m = 200;          ///< rays that meet nothing within it have left
constexpr double kWavelength_m = 4e-3;  ///< at 77 GHz; a facet that is narrower reflects no beam
constexpr double kPatch_m = 0.5;        ///< patches that ScanPlane::bow_m is the rms of

using Cell = std::array<int, 3>;

struct CellHash {
  std::size_t operator()(const Cell& c) const {
    return static_cast<std::size_t>(c[0]) * 73856093u ^ static_cast<std::size_t>(c[1]) * 19349663u ^
           static_cast<std::size_t>(c[2]) * 83492791u;
  }
};

/// Cells of the scan's samples, and the columns that have a floor.
class ScannedCells {
 public:
  explicit ScannedCells(const ScanScene& scene) {
    for (std::size_t i = 0; i < scene.samples.size(); ++i) {
      const Eigen::Vector3d p = scene.samples[i].cast<double>();
      filled_.insert(cell(p));
      const int owner = scene.sample_owner[i];
      const bool floor = owner >= 0 && static_cast<std::size_t>(owner) < scene.planes.size() &&
                         scene.planes[static_cast<std::size_t>(owner)].kind == PlaneKind::kFloor;
      if (!floor) continue;
      Cell c = cell(p);
      c[2] = 0;
      floor_.insert(c);
      bounds.extend(p);
    }
  }

  /// Whether a radar may stand there by what the scan shows.
  bool free(const Eigen::Vector3d& p) const {
    Cell below = cell(p);
    below[2] = 0;
    if (!floor_.count(below)) return false;
    const int reach = static_cast<int>(std::ceil(kFree_m / kCell_m));
    const Cell c = cell(p);
    for (int x = -reach; x <= reach; ++x) {
      for (int y = -reach; y <= reach; ++y) {
        for (int z = -reach; z <= reach; ++z) {
          if (filled_.count({c[0] + x, c[1] + y, c[2] + z})) return false;
        }
      }
    }
    return true;
  }

  Eigen::AlignedBox3d bounds;  ///< of the floor

 private:
  static Cell cell(const Eigen::Vector3d& p) {
    return {static_cast<int>(std::floor(p.x() / kCell_m)), static_cast<int>(std::floor(p.y() / kCell_m)),
            static_cast<int>(std::floor(p.z() / kCell_m))};
  }

  std::unordered_set<Cell, CellHash> filled_, floor_;
};

/// The i-th number of the Halton sequence of a base: even draws from 0 to 1 without a random generator.
double halton(std::size_t i, unsigned base) {
  double fraction = 1, value = 0;
  for (++i; i > 0; i /= base) {
    fraction /= base;
    value += fraction * static_cast<double>(i % base);
  }
  return value;
}

std::vector<Eigen::Vector3d> freePlaces(const ScanScene& scene) {
  const ScannedCells cells(scene);
  std::vector<Eigen::Vector3d> found;
  if (cells.bounds.isEmpty()) return found;
  const double top = scene.frame.has_ceiling ? std::min(1.8, scene.frame.ceiling_m - kFree_m) : 1.8;
  const Eigen::Vector3d low(cells.bounds.min().x(), cells.bounds.min().y(), std::min(0.5, top));
  const Eigen::Vector3d size(cells.bounds.sizes().x(), cells.bounds.sizes().y(), top - low.z());
  for (std::size_t i = 0; i < kDraws && found.size() < kPlaces; ++i) {
    const Eigen::Vector3d p = low + size.cwiseProduct(Eigen::Vector3d(halton(i, 2), halton(i, 3), halton(i, 5)));
    if (cells.free(p)) found.push_back(p);
  }
  return found;
}

/// Unit vector number i of n, spread evenly over the sphere along a spiral.
Eigen::Vector3d spread(std::size_t i, std::size_t n) {
  const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(n);
  const double angle = M_PI * (3 - std::sqrt(5.0)) * static_cast<double>(i), flat = std::sqrt(1 - z * z);
  return {flat * std::cos(angle), flat * std::sin(angle), z};
}

/// A gap, where most rays beside one that left meet something; none where the scene is open.
std::optional<SceneGap> gapAt(const Scene& scene, const RayCaster& rays, const Eigen::Vector3d& place,
                              const Eigen::Vector3d& direction) {
  const Eigen::Vector3d across = direction.unitOrthogonal(), third = direction.cross(across);
  std::vector<double> distances;
  std::map<int, int> met;
  for (std::size_t k = 0; k < kNeighbours; ++k) {
    const double angle = 2 * M_PI * static_cast<double>(k) / kNeighbours;
    const Eigen::Vector3d beside = place + kCircle_m * (std::cos(angle) * across + std::sin(angle) * third);
    const auto hit = rays.firstHit(beside, direction, kFar_m);
    if (!hit) continue;
    distances.push_back(hit->distance_m);
    ++met[hit->actor];
  }
  if (static_cast<double>(distances.size()) < (1 - kSlot) * kNeighbours) return std::nullopt;
  std::sort(distances.begin(), distances.end());
  const auto most =
      std::max_element(met.begin(), met.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  return SceneGap{place, direction, place + distances[distances.size() / 2] * direction,
                  scene.actorOf(most->first).name};
}

void castRays(const Scene& scene, const RayCaster& rays, const std::vector<Eigen::Vector3d>& places,
              ScanQuality& quality) {
  std::set<std::string> named;
  std::map<int, int> holding;
  for (const Eigen::Vector3d& place : places) {
    if (const auto inside = rays.insideActor(place)) ++holding[*inside];
    for (std::size_t k = 0; k < kRaysEach; ++k) {
      const Eigen::Vector3d direction = spread(k, kRaysEach);
      ++quality.rays;
      if (rays.firstHit(place, direction, kFar_m)) continue;
      // Where triangles of two actors meet, single precision lets a ray in a million pass; a second one 1 mm beside
      // does not.
      if (rays.firstHit(place + 1e-3 * direction.unitOrthogonal(), direction, kFar_m)) continue;
      const auto gap = gapAt(scene, rays, place, direction);
      ++(gap ? quality.through_gaps : quality.through_openings);
      if (gap && named.insert(gap->beside).second) quality.gaps.push_back(*gap);
    }
  }
  for (const auto& [actor, count] : holding) quality.bodies.emplace_back(scene.actorOf(actor).name, count);
}

/// Area that two actors claim, and facets that are too narrow to reflect.
void lookAtFacets(const Scene& scene, ScanQuality& quality) {
  const auto owner = [&](int facet) { return scene.actorOf(scene.facets[static_cast<std::size_t>(facet)].actor).name; };
  std::map<std::string, double> shared;
  for (const FaceOverlap& o : scene.overlaps) shared[owner(o.cut) + " in " + owner(o.kept)] += o.area_m2;
  for (const Actor& actor : scene.actors) {
    if (actor.repeated_m2 > 0) shared[actor.name + " with itself"] += actor.repeated_m2;
  }
  for (const auto& [pair, area_m2] : shared) {
    // Less than a palm reflects less than what is above the clutter.
    if (area_m2 > 0.01) quality.coincide.emplace_back(pair, area_m2);
  }
  std::map<std::string, int> narrow;
  for (const Facet& f : scene.facets) {
    if (f.reflects && std::min(f.size1_m, f.size2_m) < kWavelength_m) ++narrow[scene.actorOf(f.actor).name];
  }
  quality.slivers.assign(narrow.begin(), narrow.end());
}

/// A plane's patches of kPatch_m lie off it by bow_m (rms). That is the path's error of range. Heights of rms b that
/// are alike within L, as exp(-(r/L)^2), have curvatures of rms sqrt(12) b / L^2; a mirror of curvature c changes the
/// amplitude at distance R by 1/sqrt(1 + c R) for each of its two axes.
PathExpectation expectationOf(const ScanPlane& plane) {
  PathExpectation e;
  e.plane = plane.name;
  e.range_m = plane.bow_m;
  const double curvature = std::sqrt(12.0) * plane.bow_m / (kPatch_m * kPatch_m);
  e.level_db = std::sqrt(2.0) * 10 / std::log(10.0) * curvature * kExpectedRange_m;
  return e;
}

bool upright(const ScanPlane& plane) { return std::abs(plane.normal.z()) < std::sqrt(0.5); }

template <typename List>
void writeCounts(std::ostream& out, const std::string& key, const List& list) {
  out << "  " << key << ": {";
  bool first = true;
  for (const auto& [name, value] : list) {
    out << (first ? "" : ", ") << '"' << name << "\": " << value;
    first = false;
  }
  out << "}\n";
}

std::string counted(const std::vector<std::pair<std::string, int>>& list) {
  std::ostringstream text;
  for (std::size_t i = 0; i < list.size(); ++i)
    text << (i ? ", " : "") << list[i].first << " (" << list[i].second << ")";
  return text.str();
}

}  // namespace

ScanQuality checkScanScene(const ScanScene& scan) {
  ScanQuality quality;
  const Scene scene = tracedActors(scan);
  const RayCaster rays(scene);
  const std::vector<Eigen::Vector3d> places = freePlaces(scan);
  quality.places = places.size();
  castRays(scene, rays, places, quality);
  lookAtFacets(scene, quality);
  for (const ScanThing& t : scan.things) {
    if (!t.watertight) quality.open.push_back(t.name);
  }
  std::vector<const ScanPlane*> walls;
  for (const ScanPlane& p : scan.planes) {
    if (upright(p)) walls.push_back(&p);
  }
  std::stable_sort(walls.begin(), walls.end(),
                   [](const ScanPlane* a, const ScanPlane* b) { return a->area_m2 > b->area_m2; });
  for (const ScanPlane* p : walls) quality.expected.push_back(expectationOf(*p));
  return quality;
}

std::vector<std::string> qualityNotes(const ScanQuality& quality) {
  std::vector<std::string> notes;
  if (quality.places < kPlaces) {
    notes.push_back("only " + std::to_string(quality.places) + " free places of " + std::to_string(kPlaces) +
                    " were found above the floor to look from; the scan has little free floor");
  }
  if (quality.through_gaps > 0) {
    std::ostringstream text;
    text << std::setprecision(2) << std::fixed << quality.through_gaps << " of " << quality.rays
         << " rays leave through gaps narrower than some 5 cm:";
    for (const SceneGap& g : quality.gaps) {
      text << " beside " << g.beside << " (at " << g.at.x() << ", " << g.at.y() << ", " << g.at.z() << " m)";
    }
    notes.push_back(text.str());
  }
  if (quality.through_openings > 0) {
    notes.push_back(std::to_string(quality.through_openings) + " of " + std::to_string(quality.rays) +
                    " rays leave where the scan is open: windows, doorways, what was not scanned");
  }
  if (!quality.bodies.empty())
    notes.push_back("places that are free in the scan lie inside bodies: " + counted(quality.bodies) +
                    "; a radar there would be refused; look at them in top_view.png");
  if (!quality.coincide.empty()) {
    std::ostringstream text;
    text << std::setprecision(2) << "faces coincide, and each area returns once:";
    for (const auto& [pair, area_m2] : quality.coincide) text << " " << pair << " (" << area_m2 << " m2)";
    notes.push_back(text.str());
  }
  if (!quality.slivers.empty()) notes.push_back("facets are narrower than a wavelength: " + counted(quality.slivers));
  return notes;
}

void writeScanQuality(const ScanScene& scene, const ScanQuality& quality, const std::string& folder) {
  std::ofstream out(folder + "/quality.yaml");
  out << std::setprecision(4) << "format: mmradartwin_scan_quality/1\n"
      << "# Rays from free places inside the room: none should leave through a gap.\nchecks:\n"
      << "  places: " << quality.places << "\n  rays: " << quality.rays << "\n  through_gaps: " << quality.through_gaps
      << "\n  through_openings: " << quality.through_openings << "\n";
  writeCounts(out, "places_in_bodies", quality.bodies);
  writeCounts(out, "coincident_m2", quality.coincide);
  writeCounts(out, "slivers", quality.slivers);
  out << "  open_things: [";
  for (std::size_t i = 0; i < quality.open.size(); ++i) out << (i ? ", " : "") << '"' << quality.open[i] << '"';
  out << "]\n"
      << "# Of the planes' specular paths, 1 sigma, as far as the scan's residuals tell; the level at "
      << kExpectedRange_m << " m, in\n# proportion to the distance.\nexpected:\n";
  for (const PathExpectation& e : quality.expected) {
    out << "  - {plane: \"" << e.plane << "\", range_m: " << e.range_m << ", level_db: " << e.level_db << "}\n";
  }
  out.close();
  if (!out) throw std::runtime_error(folder + "/quality.yaml cannot be written; check the free space");
  drawTopView(scene, folder + "/top_view.png");
  drawResiduals(scene, folder + "/residuals.png");
  drawBeforeAfter(scene, folder + "/before_after.png");
}

}  // namespace mmradartwin
