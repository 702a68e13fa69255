#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/pcap_reader.h"
#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Flaw in a frame of a capture that was made from packets.
struct CaptureFlaw {
  std::uint64_t frame = 0;       ///< its index in the capture
  std::uint64_t lost_bytes = 0;  ///< these are zeros in the capture
  std::vector<int> chirps;       ///< that are incomplete
};

struct PcapCapture {
  std::uint64_t frames = 0;               ///< written
  std::int64_t first_stamp_ns = 0;        ///< start of the first one
  std::uint64_t before_file = 0;          ///< frames of a recording that had begun before the file; left out
  std::vector<CaptureFlaw> flaws;         ///< in order
  std::uint64_t lost_packets = 0;         ///< by the gaps in their numbers
  std::vector<std::uint64_t> recordings;  ///< index of each recording's first frame
  std::vector<std::uint64_t> cut_off;     ///< bytes of each recording's last frame, where it was incomplete; left out
  FrameAssembler::Counters counters;
};

/// Assembles the samples in a pcap as those that arrive live, and writes them as a capture: consecutive frames at their
/// positions, with zeros for missing packets. A recording begins with the card's answer to RECORD_START, where the file
/// has it, and after a hole of more than 64 MB. A file that begins within a recording gives the frames from its first
/// packet on. Throws InputError: unreadable file, no packet of samples, packets of several cards of which `source`
/// chooses none, losses that dwarf the samples, output that cannot be written.
PcapCapture pcapToCapture(const std::string& pcap, const RadarConfig& radar, const std::string& output,
                          const PcapSource& source = {});

}  // namespace mmradartwin
