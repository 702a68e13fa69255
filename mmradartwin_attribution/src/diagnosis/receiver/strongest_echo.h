#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::receiver {

/// Amplitude of the strongest tone of all poses.
double strongestMeasured(const ChannelData& data);

/// The same where a twin tells where its strongest echoes stand: in the data several may stand in one cell. Does
/// nothing to a finding without a level.
void referToStrongestEcho(const Twin& twin, const ChannelData& data, Finding& f);
/// A level against its host that was fitted beside the twin's strongest amplitude, as one at the strongest echo of the
/// room. `log_gain`: what the measured power has more than the twin's.
void referToStrongestHost(const Twin& twin, const ChannelData& data, double log_gain, double amplitude, Finding& f);

}  // namespace mmradartwin::diagnosis::receiver
