#pragma once

#include "mmradartwin_sim/twin_description.h"

namespace mmradartwin {

/// A mechanism that a twin has, or had before somebody switched it off.
struct WhatIfEntry {
  NamedParameters named;
  bool on = true;
  bool given = false;  ///< stands in the twin as given
};

}  // namespace mmradartwin
