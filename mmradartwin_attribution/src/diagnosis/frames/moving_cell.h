#pragma once

#include <Eigen/Core>

#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::frames {

/// Moving echo: one cell of range and Doppler of a frame with many loops.
struct MovingCell {
  int bin = 0;                ///< range bin
  double turn_rad = 0;        ///< phase from one transmitter's slot to the next
  double power = 0;           ///< ratio to the noise
  Eigen::VectorXcd channels;  ///< [M] as delivered, up to a common factor
};

}  // namespace mmradartwin::diagnosis::frames
