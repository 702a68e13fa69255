#pragma once

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/finding.h"

namespace mmradartwin::diagnosis::receiver {

/// Measures level and phase of an iq_imbalance by the correlation of images with their hosts, conj(x) at the mirrored
/// frequency of the same pose: no echo of the room has that phase. Levels from the power alone are some 2 dB too high.
/// Returns false and leaves the finding unchanged where no cell holds only an image, and with fewer than three
/// locations.
bool measureImage(const ChannelData& data, Finding& f);
/// Subtracts the image of an iq_imbalance of known level and phase from the data.
void subtractImage(const NamedParameters& iq_imbalance, ChannelData& data);

}  // namespace mmradartwin::diagnosis::receiver
