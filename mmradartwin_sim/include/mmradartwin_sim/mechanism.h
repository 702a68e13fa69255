#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/mechanism_stages.h"
#include "mmradartwin_sim/parameters.h"
#include "mmradartwin_sim/scene.h"
#include "mmradartwin_sim/scene_change.h"

namespace mmradartwin {

/// One unit of the physical model: its name, its parameters and what it precomputes. An implementation derives from
/// this and from the stages that it acts in (mechanism_stages.h).
class Mechanism {
 public:
  virtual ~Mechanism() = default;
  virtual const std::string& name() const = 0;
  virtual std::vector<ParameterSpec> parameters() const = 0;
  /// Takes checked parameters; throws InputError where they do not fit the scene or radar (an unknown actor, say).
  virtual void configure(const Parameters& values, const Scene& scene, const RadarConfig& radar) = 0;
  /// Precomputes what depends on the scene alone: once, after all SceneStage::editScene(). The scene outlives the
  /// mechanism.
  virtual void build(const Scene&, const RadarConfig&) {}
  /// Some actors of build()'s scene stand elsewhere now; ids are the same.
  virtual void sceneChanged(const Scene& scene, const RadarConfig& radar, const SceneChange&) { build(scene, radar); }

  /// True where a twin may have it several times, each for another thing in the room.
  virtual bool standsSeveralTimes() const { return false; }
  /// Notes for the user about this scene with this mechanism, a line each; asked for after build().
  virtual std::vector<std::string> notes() const { return {}; }
  /// Order within a stage: the lower rank acts first, equal ranks by name. The order in twin.yaml never matters.
  virtual int rank() const { return 0; }
  /// True where a stage of it asks for PoseContext::strongest_amplitude.
  virtual bool needsStrongestAmplitude() const { return false; }
};

}  // namespace mmradartwin
