#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_sim/mechanism.h"

namespace mmradartwin {

// One maker per mechanism, each defined in the file that bears its name.
std::unique_ptr<Mechanism> makeSpecular();
std::unique_ptr<Mechanism> makeCorner();
std::unique_ptr<Mechanism> makeDiffuse();
std::unique_ptr<Mechanism> makeRadarYawOffset();
std::unique_ptr<Mechanism> makeRadarPositionOffset();
std::unique_ptr<Mechanism> makeRangeBias();
std::unique_ptr<Mechanism> makeRangeScale();
std::unique_ptr<Mechanism> makeMaterialReflectivity();
std::unique_ptr<Mechanism> makeActorAbsent();
std::unique_ptr<Mechanism> makeActorMoved();
std::unique_ptr<Mechanism> makeElementPattern();
std::unique_ptr<Mechanism> makeElevationPattern();
std::unique_ptr<Mechanism> makeTxRxLeakage();
std::unique_ptr<Mechanism> makeChannelPhaseError();
std::unique_ptr<Mechanism> makeTxImbalance();
std::unique_ptr<Mechanism> makeIfHighpass();

inline ParameterSpec numberSpec(const char* name, const char* unit, double min, double max, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.unit = unit;
  s.min = min;
  s.max = max;
  s.meaning = meaning;
  return s;
}

inline ParameterSpec numberSpec(const char* name, const char* unit, double min, double max, double default_value,
                                const char* meaning) {
  ParameterSpec s = numberSpec(name, unit, min, max, meaning);
  s.required = false;
  s.default_value = default_value;
  return s;
}

/// Says at which value a diagnosis finds the mechanism doing nothing, and at which plainly something.
inline ParameterSpec tried(ParameterSpec spec, double neutral, double typical) {
  spec.neutral = neutral;
  spec.typical = typical;
  return spec;
}

/// Says that traced paths do not depend on the parameter.
inline ParameterSpec weighing(ParameterSpec spec) {
  spec.weighs = true;
  return spec;
}

inline ParameterSpec textSpec(const char* name, bool required, const char* default_value, const char* meaning) {
  ParameterSpec s;
  s.name = name;
  s.kind = ParameterKind::kText;
  s.required = required;
  s.default_value = std::string(default_value);
  s.meaning = meaning;
  return s;
}

/// Throws InputError naming mechanism and known actors where there is no such actor.
int requireActor(const Scene& scene, const std::string& mechanism, const std::string& actor);

/// The radar's elements at one pose, in map.
struct ElementsInMap {
  explicit ElementsInMap(const PoseContext& context);
  std::vector<Eigen::Vector3d> tx, rx;
  Eigen::Vector3d p;   ///< origin of radar_link
  Eigen::Vector3d up;  ///< axis of the vertical antennas

  /// Full lengths by way of one point, per virtual element.
  PerChannel<double> lengthsVia(const Eigen::Vector3d& point) const;
  /// Full lengths where `image` maps a transmitter to its image.
  template <typename Image>
  PerChannel<double> lengthsByImage(Image image) const {
    PerChannel<double> lengths;
    lengths.reserve(tx.size() * rx.size());
    for (const auto& t : tx) {
      const Eigen::Vector3d i = image(t);
      for (const auto& r : rx) lengths.push_back((i - r).norm());
    }
    return lengths;
  }
};

}  // namespace mmradartwin
