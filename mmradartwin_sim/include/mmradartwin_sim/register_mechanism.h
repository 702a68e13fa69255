#pragma once

#include <class_loader/register_macro.hpp>

#include "mmradartwin_sim/mechanism.h"

/// Makes a mechanism of a plug-in library known; once per class, at global scope of a .cpp. The class derives from
/// Mechanism and from the stages that it acts in (mechanism_stages.h), and needs a default constructor; twin.yaml calls
/// it by what its name() returns.
#define MMRADARTWIN_REGISTER_MECHANISM(Class) CLASS_LOADER_REGISTER_CLASS(Class, mmradartwin::Mechanism)
