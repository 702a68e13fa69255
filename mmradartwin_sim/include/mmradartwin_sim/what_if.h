#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_sim/twin.h"
#include "mmradartwin_sim/what_if_entry.h"

namespace mmradartwin {

/// A twin as given, and the same twin as somebody changes it by hand. After a change only what it touches is computed
/// again: levels of known paths for materials, weights and the receiver; paths near an actor that moved; paths of one
/// mechanism. The result is that of a twin made anew of what save() writes. Not to be used from several threads at
/// once.
///
/// A moved actor is the mechanism actor_moved, a hidden one actor_absent, a turned radar radar_yaw_offset and so on:
/// save() writes twin.yaml alone, but for materials, which stand in the scene's files.
class WhatIf {
 public:
  /// Throws InputError as Twin does.
  explicit WhatIf(TwinDescription given, std::uint64_t seed = 1);
  ~WhatIf();
  WhatIf(WhatIf&&) noexcept;

  const Twin& given() const { return *given_; }
  const Twin& now() const { return *now_; }

  using Entry = WhatIfEntry;
  const std::vector<Entry>& entries() const { return state_.entries; }
  /// Where an actor stands, from where the scene has it: turned about its centroid (of surface area), then shifted.
  struct Placement {
    Eigen::Vector3d shift_m = Eigen::Vector3d::Zero();  ///< along map's axes
    double yaw_deg = 0;
    bool hidden = false;
  };
  Placement placement(const std::string& actor) const;
  /// Materials by name: of the scene's materials.yaml, with the values that were changed.
  const std::map<std::string, Material>& materials() const { return state_.materials; }
  /// The material's name of an actor.
  const std::string& materialOf(const std::string& actor) const;

  // Each throws InputError, and changes nothing, where the twin that would be cannot be simulated.
  void setMaterial(const std::string& actor, const std::string& material);
  /// Of all actors that are of the material.
  void setMaterialValue(const std::string& material, const std::string& key, double value);
  /// Of one actor, whose material gets a name of its own where others are of it, too.
  void setActorMaterialValue(const std::string& actor, const std::string& key, double value);
  void moveActor(const std::string& actor, const Eigen::Vector3d& shift_m, double yaw_deg);
  void hideActor(const std::string& actor, bool hidden);
  /// Switches entry number `entry` of this mechanism's entries; one more than there are begins another, about
  /// `subject` (an actor's or material's name) where the mechanism can be. Numbers that it needs begin where it does
  /// nothing.
  void switchMechanism(const std::string& mechanism, std::size_t entry, bool on, const std::string& subject = "");
  void setParameter(const std::string& mechanism, std::size_t entry, const std::string& key, double value);
  /// From where poses say: forward and left in m, turned to the left, nose down.
  void placeRadar(double forward_m, double left_m, double yaw_deg, double pitch_deg);

  /// What was done since the twin as given, in words; a line each.
  std::vector<std::string> edits() const;
  /// Makes the next change one with the last, where that concerns the same thing: the steps of one slider.
  void continueLast() { continues_ = true; }
  /// Takes the last change back; false where there is none.
  bool undo();
  /// Back to the twin as given, as a change that can be undone; false where it is that already.
  bool revert();

  /// As now().simulate(); valid until the next call. Throws InputError for a pose that is NaN or inside an actor.
  const Simulation& simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0);

  /// What the last simulate() had to do, in mechanisms that make paths.
  struct Work {
    int traced = 0;     ///< all paths found again
    int updated = 0;    ///< those near an actor that moved
    int reflected = 0;  ///< known paths have other materials
    int kept = 0;       ///< as they were
    bool traces() const { return traced + updated > 0; }
  };
  const Work& work() const { return work_; }

  /// Writes twin.yaml into a folder that exists, and where materials changed scene.yaml and materials.yaml.
  /// copy_meshes: the scene's mesh files, too, where the scene is written (those of a bag go with the process). Returns
  /// the files' names. Throws InputError where they cannot be written.
  std::vector<std::string> save(const std::string& folder, bool copy_meshes = false) const;

 private:
  struct State {
    std::vector<Entry> entries;
    std::vector<std::string> material_of;  ///< by actor
    std::map<std::string, Material> materials;
    std::string words;    ///< what led here
    std::string subject;  ///< what it concerned
    bool differs() const { return !words.empty(); }
  };
  /// Paths of one mechanism, before any weight.
  struct Part {
    std::string key;
    std::vector<PathRecord> records;
  };
  std::size_t actorIndex(const std::string& actor) const;
  void change(State next, const std::string& subject, const std::string& words);
  void become(State next);
  std::shared_ptr<const Twin> makeTwin(const State& state) const;
  void findPaths(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns);
  bool changesScene() const;
  void writeScene(const std::string& folder, bool copy_meshes, std::vector<std::string>& files) const;

  std::string materials_file_;
  std::shared_ptr<const Twin> given_, now_;
  State state_, first_;
  std::vector<State> undone_;  ///< what each undo() goes back to
  bool continues_ = false;

  Simulation simulation_;
  std::vector<Part> parts_;                                      ///< as the path stages of traced_by_
  std::shared_ptr<const Twin> traced_by_;                        ///< null where parts_ are of no pose
  Eigen::Isometry3d traced_at_ = Eigen::Isometry3d::Identity();  ///< where the twin's radar was, mechanisms and all
  Work work_;
};

}  // namespace mmradartwin
