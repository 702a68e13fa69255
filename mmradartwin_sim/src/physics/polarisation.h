#pragma once

#include <Eigen/Geometry>
#include <complex>

#include "mmradartwin_sim/material.h"

namespace mmradartwin {

using ComplexVector = Eigen::Matrix<std::complex<double>, 3, 1>;

/// Unit field vector of a vertical antenna (axis `up`) for propagation along `direction`.
inline Eigen::Vector3d verticalField(const Eigen::Vector3d& up, const Eigen::Vector3d& direction) {
  const Eigen::Vector3d e = up - up.dot(direction) * direction;
  const double norm = e.norm();
  return norm > 1e-12 ? Eigen::Vector3d(e / norm) : Eigen::Vector3d::Zero();
}

/// Direction of TE at a plane: across the plane of incidence. Any direction in the plane at normal incidence.
inline Eigen::Vector3d transverse(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d s = direction.cross(normal);
  const double norm = s.norm();
  return norm > 1e-9 ? Eigen::Vector3d(s / norm) : normal.unitOrthogonal();
}

/// Field after reflection of `field`, which travels along `in`, at a plane. In the exp(-jkL) convention.
inline ComplexVector reflectField(const ComplexVector& field, const Eigen::Vector3d& in, const Eigen::Vector3d& normal,
                                  const Material& material, double frequency_hz) {
  const double cosine = std::min(1.0, std::abs(in.dot(normal)));
  const Eigen::Vector3d out = in - 2 * in.dot(normal) * normal;
  const Eigen::Vector3d s = transverse(in, normal);
  const Fresnel r = fresnel(material, cosine, frequency_hz);
  const std::complex<double> te = field.dot(s.cast<std::complex<double>>());  // conj(field).s
  const std::complex<double> tm = field.dot(in.cross(s).cast<std::complex<double>>());
  return r.te * std::conj(te) * s.cast<std::complex<double>>() +
         r.tm * std::conj(tm) * out.cross(s).cast<std::complex<double>>();
}

}  // namespace mmradartwin
