#pragma once

#include <map>
#include <optional>
#include <string>

#include "body_fixed_tone.h"
#include "channel_data.h"
#include "channel_errors.h"
#include "delivery.h"
#include "hypothesis_fit.h"
#include "mmradartwin_attribution/diagnosis.h"
#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_attribution/frame_evidence.h"

namespace mmradartwin {

// What is wrong with frames and the receiver, as findings; their gain in maps is left open.

/// A recording that was read, and how it was delivered as far as leakage and echoes tell that without a scene: then
/// data are as they ought to have been.
struct ReceivedSession {
  ChannelData data;
  std::vector<FrameFinding> frames, unexplained;
  std::vector<Delivery> deliveries;
};
/// Tells options.on_progress of a stage as long as options are there; throws DiagnosisCancelled where they say so.
ReadingProgress readingProgress(const DiagnosisOptions& options, const std::string& stage);
/// `by_echoes`: looks how it was delivered. Throws InputError where no pose is left.
ReceivedSession receiveSession(const Recording& recording, bool by_echoes, const ReadingProgress& on_progress);

Finding findingOf(const FrameFinding& frames);
/// Sets a finding's gain in nats per pose, over nothing, from those by pose where there are any, else from its
/// evidence; nothing with fewer than two locations.
void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& f);
/// False where a mechanism of the twin says the same: for the same thing, or for a place near by, and no value
/// farther from the finding's than its interval is wide.
bool isNews(const Finding& f, const std::vector<NamedParameters>& stated);
/// What frames show and neither a cause nor the twin explains, as the `unknown` that stands last, and its terms for the
/// extended twin. Its gain is one in nats per pose: maps of averages do not show it.
void addUnexplained(const std::vector<FrameFinding>& frames, const ChannelData& data,
                    const std::vector<NamedParameters>& stated, Findings& findings,
                    std::vector<NamedParameters>& extended);
Finding findingOf(const Delivery& delivery, const RadarConfig& radar);
/// rest: the data without the tone, whose strongest echo levels refer to.
Finding findingOf(const BodyFixedTone& tone, const ChannelData& rest);
/// The same where a twin tells where its strongest echoes stand: in the data several may stand in one cell. Does
/// nothing to a finding without a level.
void referToStrongestEcho(const Twin& twin, const ChannelData& data, Finding& f);
/// A level against its host that was fitted beside the twin's strongest amplitude, as one at the strongest echo of the
/// room. `log_gain`: what the measured power has more than the twin's.
void referToStrongestHost(const Twin& twin, const ChannelData& data, double log_gain, double amplitude, Finding& f);

/// Level and phase of an iq_imbalance by what images share with their hosts, conj(x) at the mirrored frequency of the
/// same pose: no echo of the room has its phase. Levels of the power there alone come out some 2 dB high. False, and
/// all left as it is, where no cell is its host's image alone, and with fewer than three locations.
bool measureImage(const ChannelData& data, Finding& f);
/// Takes an image of a known level and phase out of the data.
void subtractImage(const NamedParameters& iq_imbalance, ChannelData& data);
Finding findingOf(const ChannelErrors& errors);
/// Where the noise departs from the level that the twin's noise_floor states.
std::optional<Finding> noiseFloorFinding(const ChannelData& data, const NamedParameters& stated);

}  // namespace mmradartwin
