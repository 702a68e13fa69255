#include "mmradartwin_driver/link_budget.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr double kPacketCost_us = 11.2;  // fits table 19 of SPRUIJ4A within 0.5 us
constexpr double kCardFastest_bit_per_s = 706e6;
constexpr double kEthernetPacket_us = 12.26;  // 1456 + 10 + 28 + 18 + 20 bytes of preamble and gap
constexpr double kPayloadBits = 8 * kFullPayloadBytes;

std::string inFormat(const char* format, double value) {
  char text[48];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string mbit(double bit_per_s) { return inFormat("%.1f Mbit/s", bit_per_s * 1e-6); }

/// Largest delay, in the card's ticks, at which the card still sends this rate; negative where no delay of TI's range
/// does.
int ticksFor(double needed_bit_per_s) {
  const double delay_us = kPayloadBits / needed_bit_per_s * 1e6 - kPacketCost_us;
  const int ticks = static_cast<int>(std::floor(delay_us * 125 + 1e-6));
  const bool possible = ticks >= packetDelayTicks(kShortestDelay_us) && needed_bit_per_s <= kCardFastest_bit_per_s;
  return possible ? std::min(ticks, 65535) : -1;
}

std::string whatWouldFit(const RadarConfig& radar, const LinkBudget& link) {
  const double carried = link.carried_bit_per_s(), bits = 8.0 * static_cast<double>(radar.bytes_per_frame());
  std::string fits = "frame_period_s of at least " + inFormat("%.6g", std::ceil(bits / carried * 1e6) * 1e-6);
  int samples = static_cast<int>(std::floor(radar.samples_per_chirp / link.share() + 1e-9));
  if (radar.layout == CaptureLayout::kTwoLane) samples -= samples % 2;
  if (samples >= 2) fits += ", or samples_per_chirp of at most " + std::to_string(samples);
  const int loops = static_cast<int>(std::floor(radar.loops_per_frame / link.share() + 1e-9));
  if (loops >= 1) fits += ", or loops_per_frame of at most " + std::to_string(loops);
  const int ticks = ticksFor(link.needed_bit_per_s);
  if (ticks >= 0) {
    fits += ", or packet_delay_us of at most " + inFormat("%.6g", ticks / 125.0) + " (" + std::to_string(ticks) +
            " ticks of the card)";
  } else {
    fits += "; no packet delay carries it: the card's fastest, 5 us, is " +
            mbit(linkBudget(radar, kShortestDelay_us).carried_bit_per_s());
  }
  return fits;
}

}  // namespace

double LinkBudget::carried_bit_per_s() const { return std::min(card_bit_per_s, ethernet_bit_per_s); }

LinkBudget linkBudget(const RadarConfig& radar, double delay_us, double lane_bit_per_s) {
  LinkBudget link;
  link.delay_us = packetDelayTicks(delay_us) / 125.0;
  link.needed_bit_per_s = 8.0 * static_cast<double>(radar.bytes_per_frame()) / radar.frame_period_s;
  link.card_bit_per_s = std::min(kPayloadBits / (link.delay_us + kPacketCost_us) * 1e6, kCardFastest_bit_per_s);
  link.ethernet_bit_per_s = kPayloadBits / kEthernetPacket_us * 1e6;
  const int lanes = radar.layout == CaptureLayout::kTwoLane ? 2 : 4;
  link.lvds_per_chirp_s = 8.0 * static_cast<double>(radar.bytes_per_chirp()) / (lanes * lane_bit_per_s);
  link.chirp_s = radar.idle_s + radar.ramp_end_s;
  return link;
}

void checkLinkBudget(const RadarConfig& radar, double delay_us, double lane_bit_per_s) {
  const LinkBudget link = linkBudget(radar, delay_us, lane_bit_per_s);
  if (link.lvds_per_chirp_s > link.chirp_s) {  // false where the chirp's duration is unknown
    const double fitting = radar.samples_per_chirp * link.chirp_s / link.lvds_per_chirp_s;
    throw InputError("the LVDS lanes need " + inFormat("%.2f us", link.lvds_per_chirp_s * 1e6) +
                     " for a chirp's samples, and a chirp lasts " + inFormat("%.2f us", link.chirp_s * 1e6) +
                     ": this would fit: idle_s of at least " +
                     inFormat("%.6g", std::ceil((link.lvds_per_chirp_s - radar.ramp_end_s) * 1e8) * 1e-8) +
                     ", or samples_per_chirp of at most " + std::to_string(static_cast<int>(std::floor(fitting)) & ~1));
  }
  if (link.needed_bit_per_s <= link.carried_bit_per_s()) return;
  throw InputError("the radar's frames of " + std::to_string(radar.bytes_per_frame()) + " bytes every " +
                   inFormat("%.6g", radar.frame_period_s) + " s are " + mbit(link.needed_bit_per_s) +
                   ", and at packet_delay_us " + inFormat("%.6g", link.delay_us) + " the DCA1000 sends " +
                   mbit(link.card_bit_per_s) + " (Gigabit Ethernet carries " + mbit(link.ethernet_bit_per_s) +
                   "): this would fit: " + whatWouldFit(radar, link));
}

std::string describe(const LinkBudget& link) {
  return inFormat("%.1f of ", link.needed_bit_per_s * 1e-6) + mbit(link.carried_bit_per_s()) +
         " at a packet delay of " + inFormat("%.6g", link.delay_us) + " us";
}

}  // namespace mmradartwin
