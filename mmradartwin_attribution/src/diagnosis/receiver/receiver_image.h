#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Measures level and phase of an iq_imbalance by the correlation of images with their hosts, conj(x) at the mirrored
/// frequency of the same pose: no echo of the room has that phase. Levels from the power there alone come out some 2 dB
/// high. False, with the finding unchanged, where no cell is its host's image alone, and with fewer than three
/// locations.
bool measureImage(const ChannelData& data, Finding& f);
/// Takes the image of an iq_imbalance of known level and phase out of the data.
void subtractImage(const NamedParameters& iq_imbalance, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
