#include "mmradartwin_sim/material.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/strict_yaml.h"

namespace mmradartwin {
namespace {

constexpr double kVacuumPermittivity = 8.8541878128e-12;

const std::map<std::string, MaterialModel> kModels = {{"dielectric", MaterialModel::kDielectric},
                                                      {"conductor", MaterialModel::kConductor},
                                                      {"scalar", MaterialModel::kScalar}};

Material readMaterial(const std::string& name, YamlMap yaml) {
  Material m;
  m.name = name;
  m.model = kModels.at(yaml.choice("model", {"dielectric", "conductor", "scalar"}));
  for (const MaterialNumber& n : materialNumbers(m.model)) {
    if (n.required || yaml.has(n.key)) m.*n.member = yaml.number(n.key, n.min, n.max);
  }
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

const std::vector<MaterialNumber>& materialNumbers(MaterialModel model) {
  static const MaterialNumber kRoughness = {"roughness_rms_m", "m", &Material::roughness_rms_m, 0, 0.1, false},
                              kScattering =
                                  {"scattering_coefficient", "1", &Material::scattering_coefficient, 0, 1, false},
                              kThickness = {"thickness_m", "m", &Material::thickness_m, 1e-6, 10, false};
  static const std::vector<MaterialNumber> kDielectric = {
      {"relative_permittivity", "1", &Material::relative_permittivity, 1, 1000, true},
      {"conductivity_s_per_m", "S/m", &Material::conductivity_s_per_m, 0, 1e9, false},
      kRoughness,
      kScattering,
      kThickness};
  static const std::vector<MaterialNumber> kConductor = {kRoughness, kScattering, kThickness};
  static const std::vector<MaterialNumber> kScalar = {{"base_rcs_db", "dB", &Material::base_rcs_db, -200, 0, true},
                                                      {"back_exp", "1", &Material::back_exp, 0, 1000, true},
                                                      {"mix", "1", &Material::mix, 0, 1, true},
                                                      {"diff_back_db", "dB", &Material::diff_back_db, -200, 0, true},
                                                      {"norm_exp", "1", &Material::norm_exp, 0, 1000, true},
                                                      kThickness};
  return model == MaterialModel::kDielectric ? kDielectric : model == MaterialModel::kConductor ? kConductor : kScalar;
}

bool sameSurface(const Material& a, const Material& b) {
  if (a.model != b.model) return false;
  const std::vector<MaterialNumber>& numbers = materialNumbers(a.model);
  return std::all_of(numbers.begin(), numbers.end(), [&](const MaterialNumber& n) {
    return a.*n.member == b.*n.member || (std::isnan(a.*n.member) && std::isnan(b.*n.member));
  });
}

std::string toYaml(const Material& material) {
  std::string text = "{model: ";
  for (const auto& [name, model] : kModels) text += model == material.model ? name : "";
  for (const MaterialNumber& n : materialNumbers(material.model)) {
    if (!std::isnan(material.*n.member)) text += std::string(", ") + n.key + ": " + yamlNumber(material.*n.member);
  }
  if (material.valid_hz_min > 0 || std::isfinite(material.valid_hz_max)) {
    text += ", valid_hz: [" + yamlNumber(material.valid_hz_min) + ", " +
            yamlNumber(std::min(material.valid_hz_max, 1e15)) + "]";
  }
  if (material.extrapolated) text += ", extrapolated: true";
  text += ", color: [";
  for (std::size_t i = 0; i < 3; ++i) text += (i ? ", " : "") + yamlNumber(material.color[i]);
  return text + "]}";
}

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
