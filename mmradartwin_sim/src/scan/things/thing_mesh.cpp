#include "scan/things/thing_mesh.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/gp3.h>
#include <vtkCellArray.h>
#include <vtkCleanPolyData.h>
#include <vtkDecimatePro.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "scan/samples/scan_bounds.h"

namespace mmradartwin {
namespace {

struct Surface {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// The file's triangles whose points are a thing's.
Surface ownTriangles(const RawScan& scan, const ScanSamples& samples, const ScanFrame& frame,
                     const std::vector<int>& indices) {
  std::set<int> wanted;
  for (int i : indices) {
    const auto s = static_cast<std::size_t>(i);
    wanted.insert(samples.dense_triangle.begin() + static_cast<std::ptrdiff_t>(samples.dense_first[s]),
                  samples.dense_triangle.begin() + static_cast<std::ptrdiff_t>(samples.dense_first[s + 1]));
  }
  Surface surface;
  std::map<int, int> places;
  for (int t : wanted) {
    std::array<int, 3> triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const int v = scan.triangles[static_cast<std::size_t>(t)][k];
      const auto [place, is_new] = places.try_emplace(v, static_cast<int>(surface.vertices.size()));
      if (is_new) {
        const Eigen::Vector3d p = scan.points[static_cast<std::size_t>(v)].cast<double>() + scan.offset;
        surface.vertices.push_back(frame.T_map_file * (frame.unit_m * p));
      }
      triangle[k] = place->second;
    }
    surface.triangles.push_back(triangle);
  }
  return surface;
}

Surface meshedCloud(const ScanSamples& samples, const std::vector<int>& indices) {
  pcl::PointCloud<pcl::PointNormal>::Ptr cloud(new pcl::PointCloud<pcl::PointNormal>);
  Surface surface;
  for (int i : indices) {
    const Eigen::Vector3f &p = samples.points[static_cast<std::size_t>(i)],
                          &n = samples.normals[static_cast<std::size_t>(i)];
    if (n.isZero()) continue;
    surface.vertices.push_back(p.cast<double>());
    cloud->push_back(pcl::PointNormal(p.x(), p.y(), p.z(), n.x(), n.y(), n.z()));
  }
  if (cloud->size() < 30) return {};
  pcl::GreedyProjectionTriangulation<pcl::PointNormal> greedy;
  pcl::search::KdTree<pcl::PointNormal>::Ptr tree(new pcl::search::KdTree<pcl::PointNormal>);
  tree->setInputCloud(cloud);
  greedy.setSearchRadius(4 * samples.spacing_m);
  greedy.setMu(2.5);
  greedy.setMaximumNearestNeighbors(60);
  greedy.setMaximumSurfaceAngle(M_PI / 4);
  greedy.setMinimumAngle(M_PI / 18);
  greedy.setMaximumAngle(2 * M_PI / 3);
  greedy.setNormalConsistency(false);
  greedy.setInputCloud(cloud);
  greedy.setSearchMethod(tree);
  std::vector<pcl::Vertices> polygons;
  greedy.reconstruct(polygons);
  for (const pcl::Vertices& p : polygons) {
    if (p.vertices.size() == 3) {
      surface.triangles.push_back(
          {static_cast<int>(p.vertices[0]), static_cast<int>(p.vertices[1]), static_cast<int>(p.vertices[2])});
    }
  }
  return surface;
}

/// With at most so many triangles, if the limit of the error allows it.
Surface decimated(const Surface& surface, double error_m, std::size_t most, bool last) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const Eigen::Vector3d& v : surface.vertices) points->InsertNextPoint(v.data());
  vtkNew<vtkCellArray> cells;
  for (const auto& t : surface.triangles) {
    const vtkIdType corners[3] = {t[0], t[1], t[2]};
    cells->InsertNextCell(3, corners);
  }
  vtkNew<vtkPolyData> mesh;
  mesh->SetPoints(points);
  mesh->SetPolys(cells);
  vtkNew<vtkCleanPolyData> clean;  // scans come with vertices of their own for each triangle
  clean->SetInputData(mesh);
  clean->ToleranceIsAbsoluteOn();
  clean->SetAbsoluteTolerance(1e-5);
  clean->ConvertPolysToLinesOff();
  vtkNew<vtkDecimatePro> decimate;
  decimate->SetInputConnection(clean->GetOutputPort());
  const double share =
      static_cast<double>(most) / static_cast<double>(std::max<std::size_t>(1, surface.triangles.size()));
  decimate->SetTargetReduction(std::clamp(1 - share, 0.0, 0.99));
  decimate->SetFeatureAngle(30);
  decimate->SplittingOff();
  decimate->BoundaryVertexDeletionOn();
  decimate->SetErrorIsAbsolute(1);
  decimate->SetAbsoluteError(error_m);
  decimate->Update();
  vtkPolyData* out = decimate->GetOutput();
  // Surfaces of scraps have no inner vertices to go; where the limit of triangles stays exceeded, edges go by quadrics.
  vtkNew<vtkQuadricDecimation> collapse;
  const auto left = static_cast<double>(out->GetNumberOfPolys());
  if (last && left > static_cast<double>(most)) {
    collapse->SetInputData(out);
    collapse->SetTargetReduction(1 - static_cast<double>(most) / left);
    collapse->Update();
    out = collapse->GetOutput();
  }
  Surface result;
  for (vtkIdType i = 0; i < out->GetNumberOfPoints(); ++i) {
    Eigen::Vector3d p;
    out->GetPoint(i, p.data());
    result.vertices.push_back(p);
  }
  vtkCellArray* polys = out->GetPolys();
  polys->InitTraversal();
  vtkIdType count = 0;
  const vtkIdType* corners = nullptr;
  while (polys->GetNextCell(count, corners)) {
    if (count == 3)
      result.triangles.push_back(
          {static_cast<int>(corners[0]), static_cast<int>(corners[1]), static_cast<int>(corners[2])});
  }
  return result;
}

/// Each edge joins two triangles.
bool isClosed(const Surface& surface) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : surface.triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++edges[std::minmax(t[k], t[(k + 1) % 3])];
  }
  return std::all_of(edges.begin(), edges.end(), [](const auto& e) { return e.second == 2; });
}

}  // namespace

bool addMesh(const RawScan& scan, const ScanSamples& samples, const ScanFrame& frame, const ScanOptions& options,
             const std::vector<int>& indices, ScanThing& thing) {
  Surface surface =
      scan.triangles.empty() ? meshedCloud(samples, indices) : ownTriangles(scan, samples, frame, indices);
  if (surface.triangles.size() < 8) return false;
  // A thing's part of the budget is that of its surface in the scan.
  const double share = static_cast<double>(indices.size()) / static_cast<double>(samples.size());
  const auto most = static_cast<std::size_t>(std::max(24.0, share * static_cast<double>(options.triangles)));
  // The limit of triangles comes first: a surface that is rougher than the limit of its silhouette gives way.
  double error_m = options.silhouette_m;
  for (int round = 0; round < 5 && surface.triangles.size() > most; ++round, error_m *= 2) {
    surface = decimated(surface, error_m, most, round == 4);
  }
  std::set<std::array<int, 3>> seen;
  const int base = static_cast<int>(thing.vertices.size());
  for (Eigen::Vector3d& v : surface.vertices) {
    v.z() = std::max(v.z(), bounds::kGap_m);  // what stands on the floor ends short of it
    thing.vertices.push_back(v);
    thing.bounds.extend(v);
  }
  Surface kept{surface.vertices, {}};
  for (const auto& t : surface.triangles) {
    std::array<int, 3> key = t;
    std::sort(key.begin(), key.end());
    const Eigen::Vector3d a = surface.vertices[static_cast<std::size_t>(t[0])],
                          b = surface.vertices[static_cast<std::size_t>(t[1])],
                          c = surface.vertices[static_cast<std::size_t>(t[2])];
    if (key[0] == key[1] || key[1] == key[2] || (b - a).cross(c - a).norm() < 2e-7 || !seen.insert(key).second)
      continue;
    kept.triangles.push_back(t);
    thing.triangles.push_back({base + t[0], base + t[1], base + t[2]});
  }
  if (kept.triangles.empty()) return false;
  thing.shape = ThingShape::kMesh;
  thing.watertight = isClosed(kept);
  thing.rms_m = samples.noise_m;
  thing.largest_m = std::max(options.silhouette_m, error_m / 2);
  return true;
}

}  // namespace mmradartwin
