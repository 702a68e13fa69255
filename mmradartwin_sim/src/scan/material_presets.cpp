#include "mmradartwin_sim/material_presets.h"

#include <algorithm>
#include <cctype>

namespace mmradartwin {
namespace {

std::string lowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

}  // namespace

const std::vector<MaterialPreset>& materialPresets() {
  static const std::vector<MaterialPreset> list = {
      {"Metal",
       "{model: conductor, color: [0.55, 0.60, 0.68]}",
       {"metal", "steel", "alumin", "iron", "radiator", "cabinet", "locker", "fridge"}},
      {"Glass",
       "{model: dielectric, relative_permittivity: 6.31, conductivity_s_per_m: 1.211, color: [0.55, 0.80, 0.88]}",
       {"glass", "window", "mirror", "screen", "monitor", "tv", "display"}},
      {"Wood",
       "{model: dielectric, relative_permittivity: 1.99, conductivity_s_per_m: 0.494, color: [0.62, 0.43, 0.24]}",
       {"wood", "door", "shelf", "bookcase", "wardrobe", "drawer", "chair"}},
      {"TableTop",
       "{model: dielectric, relative_permittivity: 2.58, conductivity_s_per_m: 0.643, color: [0.80, 0.68, 0.50]}",
       {"table", "desk", "counter", "worktop"}},
      {"Carpet",
       "{model: dielectric, relative_permittivity: 2.08, conductivity_s_per_m: 0.0317, scattering_coefficient: 0.4, "
       "extrapolated: true, color: [0.38, 0.42, 0.55]}",
       {"carpet", "rug", "sofa", "couch", "curtain", "fabric", "cushion", "bed"}},
      {"Plastic",
       "{model: dielectric, relative_permittivity: 2.57, conductivity_s_per_m: 0.49, color: [0.85, 0.85, 0.80]}",
       {"plastic", "acryl", "bin", "printer"}},
      {"Plasterboard",
       "{model: dielectric, relative_permittivity: 2.73, conductivity_s_per_m: 0.503, scattering_coefficient: 0.2, "
       "color: [0.88, 0.87, 0.84]}",
       {"plaster", "gypsum", "drywall", "partition"}},
      {"Concrete",
       "{model: dielectric, relative_permittivity: 5.24, conductivity_s_per_m: 1.38, scattering_coefficient: 0.5, "
       "color: [0.70, 0.69, 0.66]}",
       {"concrete", "wall", "floor", "ceiling", "column", "pillar", "cement"}},
      {"Unknown",
       "{model: dielectric, relative_permittivity: 2.57, conductivity_s_per_m: 0.49, scattering_coefficient: 0.3, "
       "color: [0.80, 0.40, 0.70]}  # stands for what nothing tells: the middle of wood, plastic, boards and fabric",
       {}}};
  return list;
}

const MaterialPreset* presetOfName(const std::string& name) {
  const std::string text = lowerCase(name);
  for (const MaterialPreset& p : materialPresets()) {
    if (text == lowerCase(p.tag)) return &p;
  }
  for (const MaterialPreset& p : materialPresets()) {
    if (std::any_of(p.words.begin(), p.words.end(),
                    [&text](const char* w) { return text.find(w) != std::string::npos; }))
      return &p;
  }
  return nullptr;
}

}  // namespace mmradartwin
