// What card and link carry, against TI's throughput table, and refusals that fit when followed.
#include "mmradartwin_driver/link_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <regex>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

/// 4 lanes, 16 bytes per sample.
RadarConfig radarOf(int samples, int loops, double period_s) {
  RadarConfig radar;
  radar.device = "awr2243";
  radar.carrier_hz = 77e9;
  radar.slope_hz_per_s = 60e12;
  radar.samples_per_chirp = samples;
  radar.sample_rate_hz = 20e6;
  radar.adc_start_s = 6e-6;
  radar.loops_per_frame = loops;
  radar.frame_period_s = period_s;
  radar.tx_position_m.assign(2, Eigen::Vector3d::Zero());
  radar.rx_position_m.assign(4, Eigen::Vector3d::Zero());
  return radar;
}

std::string refusal(const RadarConfig& radar, double delay_us) {
  try {
    checkLinkBudget(radar, delay_us);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

double numberAfter(const std::string& text, const std::string& words) {
  std::smatch match;
  return std::regex_search(text, match, std::regex(words + " ([0-9.e+-]+)")) ? std::stod(match[1]) : NAN;
}

TEST(LinkBudget, CarriesWhatTheTableSays) {
  // SPRUIJ4A, table 19.
  const std::pair<double, double> table[] = {{5, 706}, {10, 545}, {25, 325}, {50, 193}};
  for (const auto& [delay_us, mbit] : table) {
    const double carried = linkBudget(radarOf(64, 1, 0.05), delay_us).carried_bit_per_s() * 1e-6;
    EXPECT_NEAR(mbit, carried, 0.02 * mbit) << delay_us << " us";
  }
  EXPECT_LE(linkBudget(radarOf(64, 1, 0.05), 0).carried_bit_per_s(), 706e6);
}

TEST(LinkBudget, CountsThePaperRadar) {
  const LinkBudget link = linkBudget(radarOf(64, 1, 0.05), 25);
  EXPECT_DOUBLE_EQ(2048 * 8 / 0.05, link.needed_bit_per_s);
  EXPECT_NEAR(1024 * 8 / 2.4e9, link.lvds_per_chirp_s, 1e-15);  // four lanes of 600 Mbit/s
  EXPECT_EQ("", refusal(radarOf(64, 1, 0.05), 25));
}

TEST(LinkBudget, RefusesWithFiguresThatFit) {
  // 256 samples x 16 bytes x 128 x 2 chirps every 20 ms: 419.4 Mbit/s; 25 us of delay carry about 322.
  const RadarConfig radar = radarOf(256, 128, 0.02);
  const std::string why = refusal(radar, 25);
  EXPECT_NE(std::string::npos, why.find("419.4 Mbit/s")) << why;
  EXPECT_NE(std::string::npos, why.find("321.8 Mbit/s")) << why;
  EXPECT_EQ(std::string::npos, why.find('\n'));

  RadarConfig slower = radar;
  slower.frame_period_s = numberAfter(why, "frame_period_s of at least");
  EXPECT_EQ("", refusal(slower, 25)) << why;
  slower.frame_period_s *= 0.999;
  EXPECT_NE("", refusal(slower, 25));

  RadarConfig shorter = radar;
  shorter.samples_per_chirp = static_cast<int>(numberAfter(why, "samples_per_chirp of at most"));
  EXPECT_EQ("", refusal(shorter, 25)) << why;
  ++shorter.samples_per_chirp;
  EXPECT_NE("", refusal(shorter, 25));

  RadarConfig fewer = radar;
  fewer.loops_per_frame = static_cast<int>(numberAfter(why, "loops_per_frame of at most"));
  EXPECT_EQ("", refusal(fewer, 25)) << why;

  const double delay_us = numberAfter(why, "packet_delay_us of at most");
  EXPECT_EQ("", refusal(radar, delay_us)) << why;
  EXPECT_NE("", refusal(radar, delay_us + 0.1));
  // 8 ns each.
  EXPECT_NE(std::string::npos, why.find("(" + std::to_string(std::lround(delay_us * 125)) + " ticks")) << why;
}

TEST(LinkBudget, SaysWhereNoDelayHelps) {
  // 839 Mbit/s: more than the card ever sends.
  const std::string why = refusal(radarOf(256, 128, 0.01), 5);
  EXPECT_NE(std::string::npos, why.find("no packet delay carries it")) << why;
  EXPECT_EQ(std::string::npos, why.find("packet_delay_us of at most")) << why;
}

TEST(LinkBudget, RefusesChirpsFasterThanTheLanes) {
  // 512 samples of 16 bytes take 27.3 us on four lanes, the chirp 26 us.
  RadarConfig radar = radarOf(256, 1, 0.05);
  radar.samples_per_chirp = 512;
  radar.sample_rate_hz = 45e6;
  radar.idle_s = 7e-6;
  radar.ramp_end_s = 19e-6;
  const std::string why = refusal(radar, 25);
  EXPECT_NE(std::string::npos, why.find("27.31 us")) << why;
  radar.idle_s = numberAfter(why, "idle_s of at least");
  EXPECT_EQ("", refusal(radar, 25)) << why;
}

}  // namespace
}  // namespace mmradartwin
