#pragma once

#include <array>
#include <complex>
#include <limits>
#include <map>
#include <string>
#include <vector>

namespace mmradartwin {

enum class MaterialModel { kDielectric, kConductor, kScalar };

/// One material of materials.yaml (docs/reference/contracts.md section 5). NaN = not given.
struct Material {
  std::string name;
  MaterialModel model = MaterialModel::kDielectric;
  // dielectric
  double relative_permittivity = std::numeric_limits<double>::quiet_NaN();
  double conductivity_s_per_m = 0;
  double roughness_rms_m = 0;
  double scattering_coefficient = 0;  ///< S: S^2 of the reflected power scatters
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

/// Amplitude of diffuse backscatter of a surface at incidence angle cos_theta, without spreading: a patch dA returns
/// lambda/(4 pi r^2) * backscatterAmplitude * sqrt(dA/pi). te and tm are the shares of the incident field's power in
/// the two polarisations. Lambertian: S |Gamma| cos(theta). The scalar lobe's own law is in the comment at
/// scalarReflection().
double backscatterAmplitude(const Material& material, double cos_theta, double te_share, double frequency_hz);

/// sqrt(1 - S^2): what scattering leaves of a specular amplitude. 1 for scalar materials.
double specularShare(const Material& material);

/// The paper's scalar lobe materials. The paper gives the scalars without their formula; this is the one chosen here:
///   lobe(theta)        = cos(theta)^(back_exp/2)
///   |Gamma|(theta)     = 10^(base_rcs_db/20) ((1 - mix) + mix lobe)
///   backscatter(theta) = 10^(diff_back_db/20) cos(theta)^norm_exp lobe
/// lobe is the amplitude of the backscatter lobe (power cos^back_exp); base_rcs_db holds at normal incidence, of which
/// the share mix falls off like the lobe; norm_exp = 1 is Lambert's projected area. diff_back_db <= -90 means none.
/// Signs are those of a conductor (TE -, TM +).
double scalarReflection(const Material& material, double cos_theta);

/// A number of a material that materials.yaml may state.
struct MaterialNumber {
  const char* key;
  const char* unit;  ///< "1" where it has none
  double Material::*member;
  double min, max;
  bool required;
};
/// Those of a model, in the order in which they are written.
const std::vector<MaterialNumber>& materialNumbers(MaterialModel model);
/// True where both reflect and scatter alike, whatever they are called.
bool sameSurface(const Material& a, const Material& b);
/// What stands behind a material's name in materials.yaml; reads back as the same material.
std::string toYaml(const Material& material);

/// Reads materials.yaml strictly. Throws InputError.
std::map<std::string, Material> loadMaterials(const std::string& file);

/// Fresnel coefficients of a half space for incidence angle cos_theta, in the exp(-jkL) convention (conjugate once
/// where a record is made). TE: E perpendicular to the plane of incidence. Source: ITU-R P.2040-3 section 2.2.2.1.
struct Fresnel {
  std::complex<double> te, tm;
};
Fresnel fresnel(const Material& material, double cos_theta, double frequency_hz);

/// Coefficients of a slab of thickness_m in air, field against field at its two faces, in the exp(-jkL) convention.
/// Source: ITU-R P.2040-3 section 2.2.2.2 (single layer). Without a thickness: those of the half space, nothing gets
/// through. Only mechanisms that say so ask for it; specular reflection is that of the half space.
struct Slab {
  Fresnel reflection, transmission;
};
Slab slab(const Material& material, double cos_theta, double frequency_hz);
/// exp(-2 (k sigma cos theta)^2): what roughness leaves of a reflection's coherent amplitude (Rayleigh, Ament).
double roughnessLoss(double roughness_rms_m, double cos_theta, double frequency_hz);

}  // namespace mmradartwin
