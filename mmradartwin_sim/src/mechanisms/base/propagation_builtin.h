#pragma once

#include "mechanisms/base/builtin.h"

namespace mmradartwin {

// Extensions of propagation, scene and pose; one maker per mechanism, each defined in the file that bears its name.
std::unique_ptr<Mechanism> makeActorUnmodelled();
std::unique_ptr<Mechanism> makeCarrierScale();
std::unique_ptr<Mechanism> makeCornerReflection();
std::unique_ptr<Mechanism> makeDiffuseScattering();
std::unique_ptr<Mechanism> makeEdgeDiffraction();
std::unique_ptr<Mechanism> makeEmpiricalLaw();
std::unique_ptr<Mechanism> makeEmpiricalEcho();
std::unique_ptr<Mechanism> makeEchoReplica();
std::unique_ptr<Mechanism> makeExcessAttenuation();
std::unique_ptr<Mechanism> makeFloorCeilingMultipath();
std::unique_ptr<Mechanism> makePoseTimeLag();
std::unique_ptr<Mechanism> makeRadarPitchOffset();
std::unique_ptr<Mechanism> makeSceneRegistration();
std::unique_ptr<Mechanism> makeSurfaceRoughness();
std::unique_ptr<Mechanism> makeTransmission();
std::unique_ptr<Mechanism> makeWallGhost();

/// Adds them under their names.
void addPropagationMechanisms(MechanismRegistry& registry);

/// Which actors are of a material. Throws InputError naming mechanism and known materials where none is.
std::vector<bool> requireMaterial(const Scene& scene, const std::string& mechanism, const std::string& material);

inline ParameterSpec textsSpec(const char* name, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.kind = ParameterKind::kTexts;
  s.default_value = std::vector<std::string>();
  s.meaning = meaning;
  return s;
}

inline ParameterSpec optionalNumbersSpec(const char* name, const char* unit, double min, double max,
                                         const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, meaning);
  s.kind = ParameterKind::kNumbers;
  s.required = false;
  s.default_value = std::vector<double>();
  return s;
}

}  // namespace mmradartwin
