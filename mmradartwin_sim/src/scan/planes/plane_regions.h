#pragma once

#include <cstddef>
#include <vector>

#include "scan/samples/scan_samples.h"

namespace mmradartwin {

/// A connected flat part of a scan.
struct PlaneRegion {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< unit; of an oriented scan towards where it was seen from
  double offset_m = 0;                                ///< normal . p = offset
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  std::vector<int> samples;  ///< ascending
  double area_m2 = 0;
  double rms_m = 0;          ///< of the samples
  double bow_m = 0;          ///< rms of the residuals' means over patches of 0.5 m
  double angle_std_rad = 0;  ///< of the normal
  double offset_std_m = 0;   ///< of the offset at the middle
  double turned_rad = 0;     ///< by regularisation

  double distance(const Eigen::Vector3d& p) const { return normal.dot(p) - offset_m; }
};

/// How far a sample may lie from its plane: three standard deviations of its noise along the plane's normal.
double planeTolerance(const ScanSamples& samples, int i, const Eigen::Vector3d& normal);
/// The same of a region, over whose samples the noise is averaged.
double planeTolerance(const ScanSamples& samples, const PlaneRegion& region);
/// The same at large, where no plane is at hand.
double planeTolerance(const ScanSamples& samples);

/// Least squares through samples, twice, the second time without what lies farther off than its tolerance and than
/// `least_m`. Sets all but `samples`; the normal keeps its side.
void fitPlane(const ScanSamples& samples, double least_m, PlaneRegion& region);
/// rms, bow and standard deviations of a plane that is given.
void measurePlane(const ScanSamples& samples, PlaneRegion& region);

/// Grows planes from the flattest samples, largest first; parts of one plane that touch are one. Source: region growing
/// by normals and distance, Rabbani et al. 2006, with the plane instead of the neighbour as what a sample must fit.
std::vector<PlaneRegion> growPlanes(const ScanSamples& samples, double smallest_m2, const Progress& progress);

/// Offset of a plane of a given normal: from the median of all points of its samples, the mean of what lies within two
/// of their deviations, so that a door that stands a little before its wall does not draw the wall along.
void fitOffset(const ScanSamples& samples, PlaneRegion& region);

}  // namespace mmradartwin
