#pragma once

#include <vector>

#include "scan/planes/plane_regions.h"

namespace mmradartwin {

/// An upright box.
struct UprightBox {
  double yaw_rad = 0;
  Eigen::AlignedBox3d box;  ///< in axes turned by yaw about map's z
  double share = 0;         ///< of the samples within the tolerance of its surface
  double rms_m = 0, largest_m = 0;

  Eigen::Vector3d toBox(const Eigen::Vector3d& p_map) const;
  Eigen::Vector3d toMap(const Eigen::Vector3d& p_box) const;
};

/// The box whose surface holds most of the samples, along one of some directions; its faces stand where samples that
/// look along them are.
UprightBox fitBox(const ScanSamples& samples, const std::vector<int>& indices, const std::vector<double>& yaws_rad,
                  double tolerance_m);

struct UprightCylinder {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double radius_m = 0, low_m = 0, high_m = 0;
  double share = 0, rms_m = 0, largest_m = 0;
};
/// How far the scan bears a box out.
struct BoxEvidence {
  double covered = 0;  ///< share of the top and of the sides that has samples
  double inward = 0;   ///< share of the samples on it that were seen from within: of an oriented scan
};
BoxEvidence evidenceOf(const ScanSamples& samples, const std::vector<int>& indices, const UprightBox& box,
                       double tolerance_m);

/// By least squares through its upright side (Kasa 1976).
UprightCylinder fitCylinder(const ScanSamples& samples, const std::vector<int>& indices, double tolerance_m);

struct FittedSphere {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius_m = 0, share = 0, rms_m = 0, largest_m = 0;
};
FittedSphere fitSphere(const ScanSamples& samples, const std::vector<int>& indices, double tolerance_m);

/// A flat part as a thin box: its rectangle, behind the side that was seen.
struct Plate {
  Eigen::Vector3d corner, e1, e2, back;  ///< e1, e2: its sides; back: from the seen face to the other one
};
Plate plateOf(const ScanSamples& samples, const std::vector<int>& indices, const Eigen::Vector3d& normal,
              double offset_m, double thickness_m);
void addPlate(const Plate& plate, ScanThing& thing);

/// Closed triangle bodies, added to a thing's mesh.
void addBox(const UprightBox& box, ScanThing& thing);
void addCylinder(const UprightCylinder& cylinder, ScanThing& thing);
void addSphere(const FittedSphere& sphere, ScanThing& thing);

}  // namespace mmradartwin
