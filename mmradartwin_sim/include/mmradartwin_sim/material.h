#pragma once

#include <array>
#include <complex>
#include <limits>
#include <map>
#include <string>

namespace mmradartwin {

enum class MaterialModel { kDielectric, kConductor, kScalar };

/// One material of materials.yaml (DESIGN section 5). NaN = not given.
struct Material {
  std::string name;
  MaterialModel model = MaterialModel::kDielectric;
  // dielectric
  double relative_permittivity = std::numeric_limits<double>::quiet_NaN();
  double conductivity_s_per_m = 0;
  double roughness_rms_m = 0;
  double scattering_coefficient = 0;      ///< S: S^2 of the reflected power scatters
  // scalar: the paper's table
  double base_rcs_db = 0, back_exp = 0, mix = 0, diff_back_db = -99, norm_exp = 1;
  // any
  double thickness_m = std::numeric_limits<double>::quiet_NaN();
  double valid_hz_min = 0, valid_hz_max = std::numeric_limits<double>::infinity();
  bool extrapolated = false;
  std::array<double, 3> color = {0.6, 0.6, 0.6};

  /// Complex relative permittivity eps - j sigma/(omega eps0), time convention exp(+j omega t).
  std::complex<double> permittivity(double frequency_hz) const;
};

/// Reads materials.yaml strictly. Throws InputError.
std::map<std::string, Material> loadMaterials(const std::string& file);

/// Fresnel coefficients of a half space for incidence angle cos_theta, in the exp(-jkL) convention (conjugate once where a
/// record is made). TE: E perpendicular to the plane of incidence. Source: ITU-R P.2040-3 section 2.2.2.1.
struct Fresnel { std::complex<double> te, tm; };
Fresnel fresnel(const Material& material, double cos_theta, double frequency_hz);

}  // namespace mmradartwin
