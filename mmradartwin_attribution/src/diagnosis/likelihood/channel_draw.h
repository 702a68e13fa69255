#pragma once

#include <random>

#include "diagnosis/likelihood/channel_likelihood.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

/// Channels [M][N] of a pose as the model expects them, drawn anew: each cell's strongest echo with its level and a
/// phase of its own, all else normal. Cells are independent of each other. The bins before firstBin() are 0.
Eigen::MatrixXcd drawnChannels(const ChannelLikelihood& model, const PoseEchoes& echoes, const SessionLatents& latents,
                               int pose, std::mt19937& random);

}  // namespace mmradartwin::diagnosis::likelihood
