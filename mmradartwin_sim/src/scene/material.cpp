#include "mmradartwin_sim/material.h"

#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr double kVacuumPermittivity = 8.8541878128e-12;

Material readMaterial(const std::string& name, YamlMap yaml) {
  Material m;
  m.name = name;
  const std::string model = yaml.choice("model", {"dielectric", "conductor", "scalar"});
  if (model == "dielectric") {
    m.model = MaterialModel::kDielectric;
    m.relative_permittivity = yaml.number("relative_permittivity", 1, 1000);
    if (yaml.has("conductivity_s_per_m")) m.conductivity_s_per_m = yaml.number("conductivity_s_per_m", 0, 1e9);
  } else if (model == "conductor") {
    m.model = MaterialModel::kConductor;
  } else {
    m.model = MaterialModel::kScalar;
    m.base_rcs_db = yaml.number("base_rcs_db", -200, 0);
    m.back_exp = yaml.number("back_exp", 0, 1000);
    m.mix = yaml.number("mix", 0, 1);
    m.diff_back_db = yaml.number("diff_back_db", -200, 0);
    m.norm_exp = yaml.number("norm_exp", 0, 1000);
  }
  if (m.model != MaterialModel::kScalar) {
    if (yaml.has("roughness_rms_m")) m.roughness_rms_m = yaml.number("roughness_rms_m", 0, 0.1);
    if (yaml.has("scattering_coefficient")) m.scattering_coefficient = yaml.number("scattering_coefficient", 0, 1);
  }
  if (yaml.has("thickness_m")) m.thickness_m = yaml.number("thickness_m", 1e-6, 10);
  if (yaml.has("color")) {
    const std::vector<double> rgb = yaml.numbers("color", 0, 1);
    if (rgb.size() != 3) yaml.fail("color", "needs three numbers r, g, b from 0 to 1");
    m.color = {rgb[0], rgb[1], rgb[2]};
  }
  if (yaml.has("valid_hz")) {
    const std::vector<double> band = yaml.numbers("valid_hz", 0, 1e15);
    if (band.size() != 2 || band[0] > band[1]) yaml.fail("valid_hz", "needs [lowest, highest] in Hz");
    m.valid_hz_min = band[0];
    m.valid_hz_max = band[1];
  }
  if (yaml.has("extrapolated")) m.extrapolated = yaml.boolean("extrapolated");
  yaml.rejectUnknownKeys();
  return m;
}

}  // namespace

std::complex<double> Material::permittivity(double frequency_hz) const {
  return {relative_permittivity, -conductivity_s_per_m / (2 * M_PI * frequency_hz * kVacuumPermittivity)};
}

std::map<std::string, Material> loadMaterials(const std::string& file) {
  YamlMap yaml = YamlMap::load(file);
  YamlMap list = yaml.map("materials");
  std::map<std::string, Material> materials;
  for (const std::string& name : list.keys()) materials[name] = readMaterial(name, list.map(name));
  yaml.rejectUnknownKeys();
  if (materials.empty()) throw InputError(file + ": key materials: names no material; give at least one");
  return materials;
}

double scalarReflection(const Material& material, double cos_theta) {
  const double lobe = std::pow(std::max(0.0, cos_theta), 0.5 * material.back_exp);
  return std::pow(10.0, material.base_rcs_db / 20) * ((1 - material.mix) + material.mix * lobe);
}

Fresnel fresnel(const Material& material, double cos_theta, double frequency_hz) {
  if (material.model == MaterialModel::kConductor) return {-1.0, 1.0};
  if (material.model == MaterialModel::kScalar) {
    const double r = scalarReflection(material, cos_theta);
    return {-r, r};
  }
  const std::complex<double> eta = material.permittivity(frequency_hz);
  const std::complex<double> root = std::sqrt(eta - (1 - cos_theta * cos_theta));
  return {(cos_theta - root) / (cos_theta + root), (eta * cos_theta - root) / (eta * cos_theta + root)};
}

Slab slab(const Material& material, double cos_theta, double frequency_hz) {
  const Fresnel r = fresnel(material, cos_theta, frequency_hz);
  if (material.model != MaterialModel::kDielectric || !std::isfinite(material.thickness_m)) return {r, {0.0, 0.0}};
  const std::complex<double> root = std::sqrt(material.permittivity(frequency_hz) - (1 - cos_theta * cos_theta));
  const double wavelength = kSpeedOfLight_m_per_s / frequency_hz;
  const std::complex<double> once =
      std::exp(std::complex<double>(0, -2 * M_PI * material.thickness_m / wavelength) * root);
  const auto both = [&once](std::complex<double> face) {
    const std::complex<double> bottom = 1.0 - face * face * once * once;
    return std::make_pair(face * (1.0 - once * once) / bottom, (1.0 - face * face) * once / bottom);
  };
  const auto te = both(r.te), tm = both(r.tm);
  return {{te.first, tm.first}, {te.second, tm.second}};
}

double roughnessLoss(double roughness_rms_m, double cos_theta, double frequency_hz) {
  const double x = 2 * M_PI * frequency_hz / kSpeedOfLight_m_per_s * roughness_rms_m * cos_theta;
  return std::exp(-2 * x * x);
}

double backscatterAmplitude(const Material& material, double cos_theta, double te_share, double frequency_hz) {
  if (material.model == MaterialModel::kScalar) {
    if (material.diff_back_db <= -90) return 0;
    return std::pow(10.0, material.diff_back_db / 20) *
           std::pow(cos_theta, material.norm_exp + 0.5 * material.back_exp);
  }
  if (material.scattering_coefficient <= 0) return 0;
  const Fresnel r = fresnel(material, cos_theta, frequency_hz);
  const double power = te_share * std::norm(r.te) + (1 - te_share) * std::norm(r.tm);
  return material.scattering_coefficient * std::sqrt(power) * cos_theta;
}

double specularShare(const Material& material) {
  if (material.model == MaterialModel::kScalar) return 1;
  return std::sqrt(1 - material.scattering_coefficient * material.scattering_coefficient);
}

}  // namespace mmradartwin
