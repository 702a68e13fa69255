#pragma once

#include <string>
#include <vector>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {

struct CaptureCheckOptions {
  /// What to do with captures that begin within a frame: refuse them, read them from their first whole chirp on as the
  /// user wishes, or the same and leave it to the caller to say so (Recording::begins_within).
  enum class Misaligned { kRefused, kAligned, kFound };
  Misaligned misaligned = Misaligned::kRefused;
};

/// Are these bytes what radar.yaml says? Looks at the first chirps of each capture, before any physics:
/// - receivers that deliver nothing at all poses are left out of the recording, its radar (whole_line_rx_m) and its
///   channel correction; a pose whose samples are all zero goes to `problems`;
/// - bytes that look like another layout, or like real samples, are refused;
/// - captures that begin within a frame are found.
/// Returns notes for the user, one line each. Throws InputError for bytes that are not what radar.yaml says, and where
/// no pose is left. Bytes that do not tell are taken as what they are said to be.
std::vector<std::string> checkCaptures(Recording& recording, const CaptureCheckOptions& options = {});

/// A twin's radar with the receivers that were left out of a recording's left out as well.
void leaveOutReceivers(const RadarConfig& recorded, RadarConfig& radar);

}  // namespace mmradartwin
