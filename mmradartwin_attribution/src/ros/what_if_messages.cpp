#include "ros/what_if_messages.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mmradartwin_attribution/ros/actor_handles.h"
#include "mmradartwin_sim/mechanism_registry.h"

namespace mmradartwin {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Mechanisms of which the panel has knobs of their own.
bool hasOwnKnobs(const std::string& mechanism) {
  const auto& own = {"actor_moved", "actor_absent", "radar_position_offset", "radar_yaw_offset", "radar_pitch_offset"};
  return std::find(own.begin(), own.end(), mechanism) != own.end();
}

std::vector<mmradartwin_msgs::WhatIfParameter> numbersOf(const NamedParameters& named) {
  std::vector<mmradartwin_msgs::WhatIfParameter> list;
  for (const ParameterSpec& s : MechanismRegistry::instance().create(named.mechanism)->parameters()) {
    if (s.kind != ParameterKind::kNumber && s.kind != ParameterKind::kInteger) continue;
    mmradartwin_msgs::WhatIfParameter p;
    p.key = s.name;
    p.unit = s.unit;
    p.meaning = s.meaning;
    p.min = s.min;
    p.max = s.max;
    p.value = kNone;
    const auto value = named.values.all().find(s.name);
    if (value != named.values.all().end()) {
      if (const auto* number = std::get_if<double>(&value->second)) p.value = *number;
    }
    list.push_back(p);
  }
  return list;
}

std::vector<mmradartwin_msgs::WhatIfParameter> numbersOf(const Material& material) {
  std::vector<mmradartwin_msgs::WhatIfParameter> list;
  for (const MaterialNumber& n : materialNumbers(material.model)) {
    mmradartwin_msgs::WhatIfParameter p;
    p.key = n.key;
    p.unit = n.unit;
    p.value = material.*n.member;
    p.min = n.min;
    p.max = n.max;
    list.push_back(p);
  }
  return list;
}

mmradartwin_msgs::WhatIfActor actorMsg(const WhatIf& what_if, const Actor& actor) {
  mmradartwin_msgs::WhatIfActor msg;
  const WhatIf::Placement placement = what_if.placement(actor.name);
  msg.name = actor.name;
  msg.material = what_if.materialOf(actor.name);
  msg.hidden = placement.hidden;
  const Eigen::Vector3d center = surfaceCentroid(actor), size = actor.bounds.sizes();
  msg.center.x = center.x();
  msg.center.y = center.y();
  msg.center.z = center.z();
  msg.size.x = size.x();
  msg.size.y = size.y();
  msg.size.z = size.z();
  for (std::size_t i = 0; i < 3; ++i) msg.shift_m[i] = placement.shift_m[static_cast<Eigen::Index>(i)];
  msg.yaw_deg = placement.yaw_deg;
  msg.material_values = numbersOf(what_if.materials().at(msg.material));
  return msg;
}

}  // namespace

mmradartwin_msgs::WhatIfNumbers toMsg(const TwinNumbers& numbers) {
  mmradartwin_msgs::WhatIfNumbers msg;
  msg.explained_power = numbers.explained_power;
  msg.recall = numbers.ledger.recall;
  msg.q1_energy = numbers.ledger.q1_energy;
  msg.q2_energy = numbers.ledger.q2_energy;
  msg.q3_median_db = numbers.ledger.q3_median_db;
  msg.q3_iqr_db = numbers.ledger.q3_iqr_db;
  return msg;
}

mmradartwin_msgs::WhatIfNumbers noNumbers() {
  TwinNumbers none;
  none.explained_power = kNone;
  for (const ResidualMetric& metric : kResidualMetrics) none.ledger.*metric.member = kNone;
  return toMsg(none);
}

void describe(const WhatIf& what_if, mmradartwin_msgs::WhatIf& msg) {
  msg.edits = what_if.edits();
  msg.materials.clear();
  for (const auto& [name, material] : what_if.materials()) msg.materials.push_back(name);
  msg.actors.clear();
  for (const Actor& actor : what_if.given().scene().actors) msg.actors.push_back(actorMsg(what_if, actor));
  msg.mechanisms.clear();
  std::map<std::string, std::uint32_t> count;
  for (const WhatIf::Entry& entry : what_if.entries()) {
    mmradartwin_msgs::WhatIfMechanism m;
    m.name = entry.named.mechanism;
    m.entry = count[m.name]++;
    m.on = entry.on;
    m.given = entry.given;
    m.subject = subjectOf(entry.named);
    m.parameters = numbersOf(entry.named);
    if (!hasOwnKnobs(m.name)) msg.mechanisms.push_back(m);
  }
  for (const std::string& name : MechanismRegistry::instance().names()) {
    if (count.count(name) > 0 || hasOwnKnobs(name)) continue;
    mmradartwin_msgs::WhatIfMechanism m;
    m.name = name;
    m.parameters = numbersOf(NamedParameters{name, {}});
    msg.mechanisms.push_back(m);
  }
}

}  // namespace mmradartwin
