#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::receiver {

/// Amplitude of the strongest tone at any pose.
double strongestMeasured(const ChannelData& data);

/// Refers a finding's level to the strongest echo at which the twin has one, as several echoes may share a cell in the
/// data. Does nothing to a finding without a level.
void referToStrongestEcho(const Twin& twin, const ChannelData& data, Finding& f);
/// Refers a level that was fitted relative to the twin's strongest `amplitude` to the strongest echo of the room.
/// log_gain: natural logarithm of the measured power over the twin's.
void referToStrongestHost(const Twin& twin, const ChannelData& data, double log_gain, double amplitude, Finding& f);

}  // namespace mmradartwin::diagnosis::receiver
