#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// A material that make_scene proposes: the shipped physical table's values (ITU-R P.2040 at 77 GHz), and the words by
/// which people name such things.
struct MaterialPreset {
  const char* tag;
  const char* yaml;                ///< what stands behind its name in materials.yaml
  std::vector<const char*> words;  ///< in names of actors and tags, lower case
};
const std::vector<MaterialPreset>& materialPresets();
/// The preset whose tag or words occur in a name, or null.
const MaterialPreset* presetOfName(const std::string& name);

}  // namespace mmradartwin
