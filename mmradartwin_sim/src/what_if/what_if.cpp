#include "mmradartwin_sim/what_if.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "twin/assembled_twin.h"
#include "what_if/edited_entries.h"

namespace mmradartwin {
namespace {

std::string number(double value) {
  std::ostringstream text;
  text.precision(4);
  text << value;
  return text.str();
}

}  // namespace

WhatIf::WhatIf(TwinDescription given, std::uint64_t seed)
    : given_(std::make_shared<const Twin>(std::move(given), seed)), now_(given_) {
  const TwinDescription& description = given_->description();
  YamlMap scene = YamlMap::load(description.scene_file);
  materials_file_ = resolvePath(scene.text("materials"), description.scene_file);
  state_.materials = loadMaterials(materials_file_);
  for (const Actor& actor : given_->scene().actors) state_.material_of.push_back(actor.material_tag);
  for (const NamedParameters& named : description.mechanisms) state_.entries.push_back({named, true, true});
  first_ = state_;
}

WhatIf::~WhatIf() = default;
WhatIf::WhatIf(WhatIf&&) noexcept = default;

std::size_t WhatIf::actorIndex(const std::string& actor) const {
  const int index = given_->scene().actorIndex(actor);
  if (index < 0) throw InputError("the scene has no actor " + actor + "; known: " + given_->scene().knownActors());
  return static_cast<std::size_t>(index);
}

WhatIf::Placement WhatIf::placement(const std::string& actor) const {
  Placement placement;
  if (const Entry* moved = entryAbout(state_.entries, "actor_moved", actor); moved && moved->on) {
    const Parameters& values = moved->named.values;
    placement.shift_m = {values.number("dx_m"), values.number("dy_m"), values.number("dz_m")};
    placement.yaw_deg = values.number("dyaw_deg");
  }
  const Entry* absent = entryAbout(state_.entries, "actor_absent", actor);
  placement.hidden = absent && absent->on;
  return placement;
}

const std::string& WhatIf::materialOf(const std::string& actor) const { return state_.material_of[actorIndex(actor)]; }

void WhatIf::setMaterial(const std::string& actor, const std::string& material) {
  const std::size_t index = actorIndex(actor);
  if (state_.materials.count(material) == 0) throw InputError(materials_file_ + " has no material " + material);
  State next = state_;
  next.material_of[index] = material;
  change(std::move(next), "material " + actor, actor + " is of " + material);
}

void WhatIf::setMaterialValue(const std::string& material, const std::string& key, double value) {
  State next = state_;
  const auto found = next.materials.find(material);
  if (found == next.materials.end()) throw InputError(materials_file_ + " has no material " + material);
  setValue(found->second, key, value);
  change(std::move(next), "value " + material + " " + key, material + ": " + key + " " + number(value));
}

void WhatIf::setActorMaterialValue(const std::string& actor, const std::string& key, double value) {
  const std::size_t index = actorIndex(actor);
  State next = state_;
  std::string& name = next.material_of[index];
  if (std::count(next.material_of.begin(), next.material_of.end(), name) > 1) {
    Material own = next.materials.at(name);
    std::string own_name = name + "_" + actor;
    while (next.materials.count(own_name) > 0) own_name += "_";
    own.name = own_name;
    next.materials[own_name] = own;
    name = own_name;
  }
  setValue(next.materials.at(name), key, value);
  change(std::move(next), "value of " + actor + " " + key, actor + ": " + key + " " + number(value));
}

void WhatIf::moveActor(const std::string& actor, const Eigen::Vector3d& shift_m, double yaw_deg) {
  actorIndex(actor);
  State next = state_;
  placeActor(next.entries, actor, shift_m, std::remainder(yaw_deg, 360.0));
  change(std::move(next), "place " + actor,
         actor + " moved by (" + number(shift_m.x()) + ", " + number(shift_m.y()) + ", " + number(shift_m.z()) +
             ") m, turned by " + number(yaw_deg) + " deg");
}

void WhatIf::hideActor(const std::string& actor, bool hidden) {
  actorIndex(actor);
  State next = state_;
  switchAbout(next.entries, "actor_absent", actor, hidden);
  change(std::move(next), "presence " + actor, actor + (hidden ? " is not there" : " is there"));
}

void WhatIf::switchMechanism(const std::string& mechanism, std::size_t entry, bool on, const std::string& subject) {
  State next = state_;
  if (Entry* known = entryNumber(next.entries, mechanism, entry)) {
    known->on = on;
  } else if (on) {
    const int actor = given_->scene().actorIndex(subject);
    if (!subject.empty() && actor < 0 && next.materials.count(subject) == 0) {
      throw InputError("the scene has no actor or material " + subject);
    }
    const std::string& material = actor < 0 ? subject : next.material_of[static_cast<std::size_t>(actor)];
    next.entries.push_back({newMechanism(mechanism, actor < 0 ? "" : subject, material), true, false});
  } else {
    throw InputError("the twin has no mechanism " + mechanism + " of number " + std::to_string(entry));
  }
  change(std::move(next), "mechanism " + mechanism + " " + std::to_string(entry), mechanism + (on ? " on" : " off"));
}

void WhatIf::setParameter(const std::string& mechanism, std::size_t entry, const std::string& key, double value) {
  State next = state_;
  Entry* known = entryNumber(next.entries, mechanism, entry);
  if (!known) throw InputError("the twin has no mechanism " + mechanism + " of number " + std::to_string(entry));
  setNumber(known->named, key, value);
  change(std::move(next), "parameter " + mechanism + " " + std::to_string(entry) + " " + key,
         mechanism + ": " + key + " " + number(value));
}

void WhatIf::placeRadar(double forward_m, double left_m, double yaw_deg, double pitch_deg) {
  State next = state_;
  setMounting(next.entries, "radar_position_offset", {{"forward_m", forward_m}, {"left_m", left_m}});
  setMounting(next.entries, "radar_yaw_offset", {{"yaw_deg", std::remainder(yaw_deg, 360.0)}});
  setMounting(next.entries, "radar_pitch_offset", {{"pitch_deg", pitch_deg}});
  change(std::move(next), "radar",
         "radar " + number(forward_m) + " m forward, " + number(left_m) + " m to the left, turned by " +
             number(yaw_deg) + " deg, nose down by " + number(pitch_deg) + " deg");
}

std::vector<std::string> WhatIf::edits() const {
  std::vector<std::string> words;
  for (const State& s : undone_) {
    if (!s.differs()) words.clear();
    if (s.differs()) words.push_back(s.words);
  }
  if (!state_.differs()) words.clear();
  if (state_.differs()) words.push_back(state_.words);
  return words;
}

void WhatIf::change(State next, const std::string& subject, const std::string& words) {
  const bool continues = std::exchange(continues_, false) && state_.differs() && state_.subject == subject;
  next.subject = subject;
  next.words = words;
  State before = state_;
  become(std::move(next));
  if (!continues) undone_.push_back(std::move(before));
}

bool WhatIf::undo() {
  if (undone_.empty()) return false;
  become(undone_.back());
  undone_.pop_back();
  return true;
}

bool WhatIf::revert() {
  if (!state_.differs()) return false;
  State before = state_;
  become(first_);
  undone_.push_back(std::move(before));
  return true;
}

void WhatIf::become(State next) {
  now_ = next.differs() ? makeTwin(next) : given_;
  state_ = std::move(next);
}

std::shared_ptr<const Twin> WhatIf::makeTwin(const State& state) const {
  const AssembledTwin& given = *given_->impl_;
  auto made = std::make_unique<AssembledTwin>();
  made->description = given.description;
  made->description.mechanisms.clear();
  for (const Entry& entry : state.entries) {
    if (entry.on) made->description.mechanisms.push_back(entry.named);
  }
  refuseExclusions(made->description.mechanisms);
  made->seed = given.seed;
  made->scene = given.scene;
  for (std::size_t i = 0; i < made->scene.actors.size(); ++i) {
    made->scene.actors[i].material_tag = state.material_of[i];
    made->scene.actors[i].material = state.materials.at(state.material_of[i]);
  }
  made->rays = given.rays;
  made->strongest = given.strongest;
  made->session_ns = given.session_ns;
  made->reported = given.reported;
  made->assemble();
  return std::shared_ptr<const Twin>(new Twin(std::move(made)));
}

const Simulation& WhatIf::simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns) {
  findPaths(T_map_radar, stamp_ns);
  std::vector<PathRecord> traced;
  std::size_t count = 0;
  for (const Part& part : parts_) count += part.records.size();
  traced.reserve(count);
  for (const Part& part : parts_) traced.insert(traced.end(), part.records.begin(), part.records.end());
  simulation_ = now_->weigh(T_map_radar, std::move(traced), stamp_ns);
  return simulation_;
}

}  // namespace mmradartwin
