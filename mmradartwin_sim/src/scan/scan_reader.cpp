#include <pcl/PCLPointCloud2.h>
#include <pcl/console/print.h>
#include <pcl/io/pcd_io.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "mesh/ply_reader.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_sim/scan_to_scene.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {
namespace {

// What two gigabytes hold with all that is made of it.
constexpr std::size_t kMostPoints = 12000000, kMostTriangles = 6000000;
constexpr std::uintmax_t kMostBytes = 1000000000;  // of a text mesh, which grows on reading
constexpr double kLargeCoordinate = 1000;  // of a file's units: beyond, single precision begins to blur millimetres

std::string extensionOf(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  return extension;
}

[[noreturn]] void refuseTooMany(const std::string& file, std::size_t count, const char* what, std::size_t most) {
  throw InputError(file + ": holds " + std::to_string(count) + " " + what + ", more than the " + std::to_string(most) +
                   " that fit into memory; thin it to 1 cm and give it again");
}

/// Fills a scan from points in double precision: large coordinates are taken off, what is no number is left out.
class ScanFiller {
 public:
  ScanFiller(RawScan& scan, const std::vector<Eigen::Vector3d>& points) : scan_(scan), index_(points.size(), -1) {
    for (const Eigen::Vector3d& p : points) {
      if (!p.allFinite()) continue;
      // Whole hundreds, so that a person can add them again in the head.
      if (p.cwiseAbs().maxCoeff() > kLargeCoordinate) scan.offset = (p / 100).array().round().matrix() * 100;
      break;
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = points[i] - scan.offset;
      if (!p.allFinite() || p.cwiseAbs().maxCoeff() > 1e9) {
        ++scan.left_out;
        continue;
      }
      index_[i] = static_cast<int>(scan.points.size());
      scan.points.push_back(p.cast<float>());
    }
  }
  void addColor(std::size_t point, const std::array<unsigned char, 3>& color) {
    if (index_[point] >= 0) scan_.colors.push_back(color);
  }
  void addTriangle(int a, int b, int c) {
    const auto i = [this](int v) { return index_[static_cast<std::size_t>(v)]; };
    if (i(a) >= 0 && i(b) >= 0 && i(c) >= 0) scan_.triangles.push_back({i(a), i(b), i(c)});
  }

 private:
  RawScan& scan_;
  std::vector<int> index_;  // of the file's points in the scan's, -1 where one was left out
};

void readPlyFile(RawScan& scan) {
  const PlyMesh mesh = readPlyScan(scan.file, kMostPoints, kMostTriangles);
  ScanFiller filler(scan, mesh.vertices);
  for (std::size_t i = 0; i < mesh.colors.size(); ++i) filler.addColor(i, mesh.colors[i]);
  for (const std::vector<int>& face : mesh.faces) {
    for (std::size_t k = 2; k < face.size(); ++k) filler.addTriangle(face[0], face[k - 1], face[k]);
  }
}

/// Value of a field of a PCD point, NaN where its type is none that coordinates have.
double fieldValue(const pcl::PCLPointField& field, const std::uint8_t* point) {
  if (field.datatype == pcl::PCLPointField::FLOAT32) {
    float value;
    std::memcpy(&value, point + field.offset, sizeof value);
    return static_cast<double>(value);
  }
  if (field.datatype == pcl::PCLPointField::FLOAT64) {
    double value;
    std::memcpy(&value, point + field.offset, sizeof value);
    return value;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

void readPcdFile(RawScan& scan) {
  pcl::PCLPointCloud2 cloud;
  Eigen::Vector4f origin;
  Eigen::Quaternionf orientation;
  int version = 0;
  std::error_code error;
  if (std::filesystem::file_size(scan.file, error) < 64 || error) {
    throw InputError(scan.file + ": is empty, or too short for a PCD file; write it again");
  }
  pcl::console::setVerbosityLevel(pcl::console::L_ALWAYS);  // what is wrong is said once, below
  if (pcl::PCDReader().read(scan.file, cloud, origin, orientation, version) < 0) {
    throw InputError(scan.file + ": cannot be read as a PCD file; write it again, best as binary");
  }
  const pcl::PCLPointField* axes[3] = {};
  const pcl::PCLPointField* color = nullptr;
  for (const pcl::PCLPointField& f : cloud.fields) {
    if (f.name == "x" || f.name == "y" || f.name == "z") axes[f.name[0] - 'x'] = &f;
    if (f.name == "rgb" || f.name == "rgba") color = &f;
  }
  if (cloud.data.size() < static_cast<std::size_t>(cloud.width) * cloud.height * cloud.point_step) {
    throw InputError(scan.file + ": its data end before its last point; write it again");
  }
  if (!axes[0] || !axes[1] || !axes[2]) throw InputError(scan.file + ": its points have no x, y and z");
  const std::size_t count = static_cast<std::size_t>(cloud.width) * cloud.height;
  if (count > kMostPoints) refuseTooMany(scan.file, count, "points", kMostPoints);
  std::vector<Eigen::Vector3d> points(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint8_t* at = cloud.data.data() + i * cloud.point_step;
    for (int k = 0; k < 3; ++k) points[i][k] = fieldValue(*axes[k], at);
  }
  ScanFiller filler(scan, points);
  for (std::size_t i = 0; color && i < count; ++i) {
    const std::uint8_t* at = cloud.data.data() + i * cloud.point_step + color->offset;
    filler.addColor(i, {at[2], at[1], at[0]});  // blue comes first
  }
  // A frame of a depth camera keeps its rows, and all of it lies before the camera.
  scan.camera_axes = cloud.height > 1 && origin.head<3>().isZero() &&
                     std::all_of(scan.points.begin(), scan.points.end(), [](const auto& p) { return p.z() > 0; });
}

/// Lines of x y z, with or without r g b behind; what begins otherwise is a comment or a count of points.
void readXyzFile(RawScan& scan) {
  std::ifstream in(scan.file);
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<unsigned char, 3>> colors;
  std::string line;
  while (std::getline(in, line)) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == ';'; }, ' ');
    double value[7];
    int count = 0;
    const char* at = line.c_str();
    for (char* end = nullptr; count < 7; ++count, at = end) {
      value[count] = std::strtod(at, &end);
      if (end == at) break;
    }
    if (count < 3) continue;
    points.emplace_back(value[0], value[1], value[2]);
    if (points.size() > kMostPoints) refuseTooMany(scan.file, points.size(), "points", kMostPoints);
    const int first = count == 7 ? 4 : 3;  // an intensity may stand before the colour
    const auto isLevel = [](double v) { return v >= 0 && v <= 255 && v == std::floor(v); };
    if (count >= 6 && std::all_of(value + first, value + first + 3, isLevel)) {
      std::array<unsigned char, 3> color;
      for (int k = 0; k < 3; ++k) color[static_cast<std::size_t>(k)] = static_cast<unsigned char>(value[first + k]);
      colors.push_back(color);
    }
  }
  ScanFiller filler(scan, points);
  if (colors.size() == points.size()) {
    for (std::size_t i = 0; i < colors.size(); ++i) filler.addColor(i, colors[i]);
  }
}

void readMeshFile(RawScan& scan) {
  std::error_code error;
  const std::uintmax_t bytes = std::filesystem::file_size(scan.file, error);
  if (!error && bytes > kMostBytes) {
    throw InputError(scan.file + ": has " + std::to_string(bytes / 1000000) +
                     " MB, more than fits into memory; thin it to 1 cm, or write it as binary PLY");
  }
  const std::vector<Actor> actors = loadMesh(scan.file);
  std::vector<Eigen::Vector3d> points;
  for (const Actor& a : actors) points.insert(points.end(), a.vertices.begin(), a.vertices.end());
  if (points.size() > 3 * kMostTriangles) refuseTooMany(scan.file, points.size(), "corners", 3 * kMostTriangles);
  ScanFiller filler(scan, points);
  int base = 0;
  for (const Actor& a : actors) {
    for (const auto& t : a.triangles) filler.addTriangle(base + t[0], base + t[1], base + t[2]);
    base += static_cast<int>(a.vertices.size());
  }
  const std::string extension = extensionOf(scan.file);
  // loadMesh() has turned and scaled what the format declares.
  scan.metres = extension != ".obj" && extension != ".stl";
}

bool isCloudFormat(const std::string& extension) {
  return extension == ".pcd" || extension == ".xyz" || extension == ".txt" || extension == ".pts" ||
         extension == ".csv";
}

}  // namespace

RawScan readScan(const std::string& file, std::size_t fewest) {
  requireRegularFile(file);
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) throw InputError(file + ": no such file");
  RawScan scan;
  scan.file = file;
  const std::string extension = extensionOf(file);
  if (extension == ".e57" || extension == ".las" || extension == ".laz") {
    throw InputError(file + ": this format is not read; write the scan as PLY");
  }
  if (extension == ".ply") {
    readPlyFile(scan);
  } else if (extension == ".pcd") {
    readPcdFile(scan);
  } else if (isCloudFormat(extension)) {
    readXyzFile(scan);
  } else {
    readMeshFile(scan);
  }
  if (scan.points.size() < fewest && scan.triangles.size() < fewest) {
    const std::string bad =
        scan.left_out ? " and " + std::to_string(scan.left_out) + " that are no finite numbers" : std::string();
    throw InputError(file + ": holds " + std::to_string(scan.points.size()) + " point(s)" + bad + "; a scan of " +
                     (fewest == kFewestPointsOfRoom ? "a room" : "an object") + " has " + std::to_string(fewest) +
                     " at least");
  }
  return scan;
}

bool isScan(const std::string& file) {
  const std::string extension = extensionOf(file);
  requireRegularFile(file);
  if (isCloudFormat(extension)) return true;
  // PLY and STL name no parts; few triangles are a drawing.
  constexpr std::size_t kDrawing = 2000;
  if (extension == ".ply") {
    std::ifstream in(file, std::ios::binary);
    std::string line;
    long faces = 0;
    for (int i = 0; i < 100 && std::getline(in, line) && line.rfind("end_header", 0) != 0; ++i) {
      if (line.rfind("element face ", 0) == 0) faces = std::strtol(line.c_str() + 13, nullptr, 10);
    }
    return faces == 0 || faces > static_cast<long>(kDrawing);
  }
  const std::vector<Actor> actors = loadMesh(file);
  std::size_t most = 0, all = 0;
  for (const Actor& a : actors) most = std::max(most, a.triangles.size()), all += a.triangles.size();
  // Exporters cut a scan into some chunks of many triangles each; a model has its triangles in parts with names.
  return all > kDrawing && most > all / 2;
}

}  // namespace mmradartwin
