#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Level and phase of an iq_imbalance by what images share with their hosts, conj(x) at the mirrored frequency of the
/// same pose: no echo of the room has its phase. Levels of the power there alone come out some 2 dB high. False, and
/// all left as it is, where no cell is its host's image alone, and with fewer than three locations.
bool measureImage(const ChannelData& data, Finding& f);
/// Takes an image of a known level and phase out of the data.
void subtractImage(const NamedParameters& iq_imbalance, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
