#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_sim/material.h"
#include "mmradartwin_sim/what_if_entry.h"

namespace mmradartwin {

/// Sets one number of a material. Throws InputError for a key that its model has not, or a value out of range.
void setValue(Material& material, const std::string& key, double value);
/// Sets one number of a mechanism, within the range of its parameter. Throws InputError.
void setNumber(NamedParameters& mechanism, const std::string& key, double value);
/// A mechanism with its defaults; numbers that it needs begin where it does nothing. Where it can name something in the
/// room, that is the actor or, where it asks for one, the material; both may be "". Throws InputError where it has to
/// name something that is not given.
NamedParameters newMechanism(const std::string& name, const std::string& actor, const std::string& material);
/// Throws InputError where two mechanisms cannot stand in one twin.
void refuseExclusions(const std::vector<NamedParameters>& mechanisms);

/// The entry number `entry` of those of a mechanism; null where there are not so many.
WhatIfEntry* entryNumber(std::vector<WhatIfEntry>& entries, const std::string& mechanism, std::size_t entry);
/// The entry of a mechanism for one actor; null where there is none.
const WhatIfEntry* entryAbout(const std::vector<WhatIfEntry>& entries, const std::string& mechanism,
                              const std::string& actor);
/// Switches a mechanism's entry for one actor, which is made where there is none.
void switchAbout(std::vector<WhatIfEntry>& entries, const std::string& mechanism, const std::string& actor, bool on);
/// An actor stands so far from where the scene has it.
void placeActor(std::vector<WhatIfEntry>& entries, const std::string& actor, const Eigen::Vector3d& shift_m,
                double yaw_deg);
/// Sets numbers of a mechanism that stands once; it is off where all of them are 0.
void setMounting(std::vector<WhatIfEntry>& entries, const std::string& mechanism,
                 const std::vector<std::pair<std::string, double>>& values);

}  // namespace mmradartwin
