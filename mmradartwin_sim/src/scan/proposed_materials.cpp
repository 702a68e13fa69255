#include "scan/proposed_materials.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_dsp/units.h"
#include "mmradartwin_sim/material.h"
#include "mmradartwin_sim/material_presets.h"

namespace mmradartwin {
namespace {

struct KindOfThing {
  const char* klass;
  const char* tag;
  double confidence;
  const char* why;
  std::vector<const char*> else_of;  ///< what such things are of otherwise
};

// What such things are made of in most offices and flats; none is sure without a look.
const std::vector<KindOfThing> kKinds = {
    {"cabinet", "Wood", 0.5, "most cabinets are of wood or metal", {"Metal", "Plastic"}},
    {"bookshelf", "Wood", 0.7, "shelves are mostly of wood", {"Metal"}},
    {"shelf", "Wood", 0.7, "shelves are mostly of wood", {"Metal", "Glass"}},
    {"table", "TableTop", 0.8, "a table's top", {"Wood", "Glass", "Metal"}},
    {"chair", "Plastic", 0.4, "chairs are of plastic, wood or fabric", {"Wood", "Carpet", "Metal"}},
    {"sofa", "Carpet", 0.7, "fabric over foam", {"Plastic"}},
    {"bed", "Carpet", 0.7, "fabric over foam", {"Wood"}},
    {"carpet", "Carpet", 0.8, "flat on the floor", {"Plastic"}},
    {"screen", "Glass", 0.7, "a screen's front", {"Plastic"}},
    {"device", "Plastic", 0.5, "a device's housing", {"Metal"}},
    {"radiator", "Metal", 0.9, "a radiator", {"Plastic"}},
    {"door", "Wood", 0.7, "most doors are of wood", {"Metal", "Glass"}},
    {"board", "Metal", 0.5, "boards for writing are of coated metal", {"Glass", "Plastic", "Wood"}},
    {"partition", "Carpet", 0.4, "partitions are mostly covered by fabric", {"Plastic", "Wood", "Glass", "Metal"}},
    {"pillar", "Concrete", 0.8, "a pillar of the building", {"Plasterboard", "Metal"}},
    {"bin", "Plastic", 0.5, "a bin", {"Metal"}},
    {"lamp", "Metal", 0.4, "a lamp's housing", {"Plastic", "Glass"}}};
const std::vector<const char*> kWallsElse = {"Concrete", "Plasterboard", "Wood", "Glass"};

/// Level of a preset's specular echo at normal incidence against that of metal, dB, at 77 GHz.
std::map<std::string, double> echoLevels() {
  constexpr double kFrequency_hz = 77e9;
  std::map<std::string, double> levels;
  for (const MaterialPreset& preset : materialPresets()) {
    YamlMap yaml = YamlMap::parse(std::string("preset: ") + preset.yaml, preset.tag).map("preset");
    Material material;
    if (yaml.text("model") == "conductor") material.model = MaterialModel::kConductor;
    for (const MaterialNumber& number : materialNumbers(material.model)) {
      if (yaml.has(number.key)) material.*number.member = yaml.number(number.key, number.min, number.max);
    }
    const double reflected = std::abs(fresnel(material, 1, kFrequency_hz).te) * specularShare(material);
    levels[preset.tag] = dbOfAmplitude(reflected);
  }
  return levels;
}

/// rms of the level's error: with the proposal's confidence none, else as likely that of each other material.
double levelStd_db(const MaterialProposal& proposal, const std::vector<const char*>& others) {
  static const std::map<std::string, double> levels = echoLevels();
  double squares = 0;
  int count = 0;
  for (const std::string tag : others) {
    if (tag == proposal.tag) continue;
    squares += std::pow(levels.at(tag) - levels.at(proposal.tag), 2), ++count;
  }
  return count ? std::sqrt((1 - proposal.confidence) * squares / count) : 0;
}

std::vector<const char*> allTags() {
  std::vector<const char*> tags;
  for (const MaterialPreset& preset : materialPresets()) tags.push_back(preset.tag);
  return tags;
}

/// Brown: red over green over blue, neither grey nor a signal's colour.
bool looksLikeWood(const Eigen::Vector3f& color) {
  return color.x() > color.y() + 0.06F && color.y() > color.z() + 0.04F && color.x() > 0.25F &&
         color.x() - color.z() < 0.6F;
}

/// Grey: painted sheet metal; boards are brown or white.
bool looksLikePaintedSteel(const Eigen::Vector3f& color) {
  return color.maxCoeff() - color.minCoeff() < 0.1F && color.mean() > 0.3F && color.mean() < 0.85F;
}

/// Mean colour of samples; nothing where the scan has no colours.
std::optional<Eigen::Vector3f> meanColor(const ScanSamples& samples, const std::vector<int>& indices) {
  if (samples.colors.empty() || indices.empty()) return std::nullopt;
  Eigen::Vector3f color = Eigen::Vector3f::Zero();
  for (int i : indices) color += samples.colors[static_cast<std::size_t>(i)];
  return color / static_cast<float>(indices.size());
}

MaterialProposal proposalOfPlane(const ScanPlane& plane, const std::optional<Eigen::Vector3f>& color) {
  MaterialProposal p;
  p.actor = plane.name;
  p.tag = "Concrete";
  p.confidence = plane.kind == PlaneKind::kWall ? 0.4 : 0.5;
  p.source = plane.kind == PlaneKind::kWall    ? "place: a wall; plasterboard is as usual"
             : plane.kind == PlaneKind::kFloor ? "place: the floor; carpet is as usual"
                                               : "place: the ceiling; plasterboard is as usual";
  if (color && plane.kind == PlaneKind::kWall && looksLikeWood(*color)) {
    p.tag = "Wood", p.confidence = 0.5, p.source = "colour: brown as wood";
  }
  p.level_std_db = levelStd_db(p, kWallsElse);
  return p;
}

void colorSays(const Eigen::Vector3f& color, const std::string& klass, MaterialProposal& p) {
  const bool may_be_wood = klass == "cabinet" || klass == "chair" || klass == "table" || p.unknown;
  if (looksLikeWood(color) && may_be_wood && p.tag != "TableTop") {
    p.tag = "Wood", p.unknown = false, p.confidence = 0.5, p.source = "colour: brown as wood";
  } else if (looksLikeWood(color) && p.tag == "Wood") {
    p.confidence = std::min(0.9, p.confidence + 0.2), p.source += "; colour: brown as wood";
  } else if (looksLikePaintedSteel(color) && klass == "cabinet") {
    p.tag = "Metal", p.confidence = 0.5, p.source = "colour: grey as painted steel";
  }
}

MaterialProposal proposalOfThing(const ScanThing& thing, const std::optional<Eigen::Vector3f>& color) {
  MaterialProposal p;
  p.actor = thing.name;
  if (!thing.material.empty()) {
    p.tag = thing.material, p.confidence = 1, p.source = "stated for this object";
    return p;
  }
  const auto kind =
      std::find_if(std::begin(kKinds), std::end(kKinds), [&](const KindOfThing& k) { return thing.klass == k.klass; });
  std::vector<const char*> others = allTags();
  if (kind != std::end(kKinds)) {
    others = kind->else_of;
    others.push_back(kind->tag);
    p.tag = kind->tag;
    p.confidence = kind->confidence * thing.class_confidence;
    p.source = "class " + thing.klass + ": " + kind->why;
  } else if (const MaterialPreset* preset = thing.klass == "unknown" ? nullptr : presetOfName(thing.klass)) {
    p.tag = preset->tag;
    p.confidence = 0.5 * thing.class_confidence;
    p.source = "name " + thing.name;
  } else {
    p.tag = "Unknown";
    p.unknown = true;
    p.source = "nothing tells";
  }
  if (color) colorSays(*color, thing.klass, p);
  p.level_std_db = levelStd_db(p, others);
  return p;
}

}  // namespace

std::vector<MaterialProposal> proposeMaterials(const ScanScene& scene, const std::vector<std::vector<int>>& of_things,
                                               const ScanSamples& samples) {
  std::vector<std::vector<int>> of_planes(scene.planes.size());
  for (std::size_t i = 0; i < scene.sample_owner.size(); ++i) {
    const int owner = scene.sample_owner[i];
    if (owner < 0 || owner >= static_cast<int>(of_planes.size())) continue;
    of_planes[static_cast<std::size_t>(owner)].push_back(static_cast<int>(i));
  }
  std::vector<MaterialProposal> proposals;
  for (std::size_t k = 0; k < of_planes.size(); ++k) {
    proposals.push_back(proposalOfPlane(scene.planes[k], meanColor(samples, of_planes[k])));
  }
  for (std::size_t t = 0; t < scene.things.size(); ++t) {
    proposals.push_back(proposalOfThing(scene.things[t], meanColor(samples, of_things[t])));
  }
  return proposals;
}

}  // namespace mmradartwin
