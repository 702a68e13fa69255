#pragma once

#include <cstdint>
#include <string>

#include "mmradartwin_dsp/radar_config.h"

namespace mmradartwin {

/// Payload of a full packet, as cards send it.
constexpr double kFullPayloadBytes = 1456;
/// Shortest packet delay that TI gives a throughput for (SPRUIJ4A, table 19).
constexpr double kShortestDelay_us = 5;

/// Rates that a radar's samples need from its LVDS lanes to this host, and that this link carries. Rates count sample
/// bytes only, averaged over a frame: the card's memory smooths variations within a frame.
struct LinkBudget {
  double delay_us = 0;               ///< between packets
  double needed_bit_per_s = 0;       ///< bytes_per_frame / frame_period
  double card_bit_per_s = 0;         ///< one full packet every delay + 11.2 us, 706 Mbit/s at most (SPRUIJ4A, table 19)
  double ethernet_bit_per_s = 0;     ///< full packets back to back on 1 Gbit/s: 12.26 us each
  double lvds_per_chirp_s = 0;       ///< a chirp's bytes over all lanes
  double chirp_s = 0;                ///< idle + ramp_end; NaN where radar.yaml does not say
  double carried_bit_per_s() const;  ///< the smaller of card and Ethernet
  double share() const { return needed_bit_per_s / carried_bit_per_s(); }
};

/// lane_bit_per_s: rate of one LVDS lane, 600 Mbit/s as the AWR2243 is configured.
LinkBudget linkBudget(const RadarConfig& radar, double delay_us, double lane_bit_per_s = 600e6);

/// Throws InputError where the link cannot carry the samples. The message names the rates, and the frame period,
/// samples per chirp, loops and packet delay (us and ticks of the card) that would fit, where they exist.
void checkLinkBudget(const RadarConfig& radar, double delay_us, double lane_bit_per_s = 600e6);

/// Summary of a budget, such as "0.3 of 325.0 Mbit/s at a packet delay of 25 us".
std::string describe(const LinkBudget& link);

}  // namespace mmradartwin
