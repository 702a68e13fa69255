#include "scan/proposed_materials.h"

#include <algorithm>
#include <optional>

#include "mmradartwin_sim/material_presets.h"

namespace mmradartwin {
namespace {

struct KindOfThing {
  const char* klass;
  const char* tag;
  double confidence;
  const char* why;
};

// What such things are made of in most offices and flats; none is sure without a look.
constexpr KindOfThing kKinds[] = {{"cabinet", "Wood", 0.5, "most cabinets are of wood or metal"},
                                  {"bookshelf", "Wood", 0.7, "shelves are mostly of wood"},
                                  {"shelf", "Wood", 0.7, "shelves are mostly of wood"},
                                  {"table", "TableTop", 0.8, "a table's top"},
                                  {"chair", "Plastic", 0.4, "chairs are of plastic, wood or fabric"},
                                  {"sofa", "Carpet", 0.7, "fabric over foam"},
                                  {"bed", "Carpet", 0.7, "fabric over foam"},
                                  {"carpet", "Carpet", 0.8, "flat on the floor"},
                                  {"screen", "Glass", 0.7, "a screen's front"},
                                  {"device", "Plastic", 0.5, "a device's housing"},
                                  {"radiator", "Metal", 0.9, "a radiator"},
                                  {"door", "Wood", 0.7, "most doors are of wood"},
                                  {"board", "Metal", 0.5, "boards for writing are of coated metal"},
                                  {"partition", "Carpet", 0.4, "partitions are mostly covered by fabric"},
                                  {"pillar", "Concrete", 0.8, "a pillar of the building"},
                                  {"bin", "Plastic", 0.5, "a bin"},
                                  {"lamp", "Metal", 0.4, "a lamp's housing"}};

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
  return p;
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
  if (kind != std::end(kKinds)) {
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
  if (!color) return p;
  const bool may_be_wood = thing.klass == "cabinet" || thing.klass == "chair" || thing.klass == "table" || p.unknown;
  if (looksLikeWood(*color) && may_be_wood && p.tag != "TableTop") {
    p.tag = "Wood", p.unknown = false, p.confidence = 0.5, p.source = "colour: brown as wood";
  } else if (looksLikeWood(*color) && p.tag == "Wood") {
    p.confidence = std::min(0.9, p.confidence + 0.2), p.source += "; colour: brown as wood";
  } else if (looksLikePaintedSteel(*color) && thing.klass == "cabinet") {
    p.tag = "Metal", p.confidence = 0.5, p.source = "colour: grey as painted steel";
  }
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
