#include <vector>

#include "mmradartwin_dsp/range_angle.h"
#include "test_radar.h"

namespace mmradartwin {
namespace {

/// Range and azimuth of the strongest cell of a map.
struct Strongest {
  double range_m, azimuth_deg, level_db;
};

Strongest strongestOf(const RadarConfig& radar, const ComplexGrid& x) {
  ReceiveGrid grid;
  grid.x = x;
  grid.full_scale = 1;
  const RangeAngleMap map = SignalChain(radar).map(grid);
  Eigen::Index r = 0, a = 0;
  const double level_db = map.power_db.maxCoeff(&r, &a);
  return {map.axes.range_m[static_cast<std::size_t>(r)], map.axes.azimuth_rad[static_cast<std::size_t>(a)] * 180 / M_PI,
          level_db};
}

/// A point at 3 m and 20 degrees, received by elements at these places along y, in half wavelengths at 77 GHz.
ComplexGrid pointAt20deg(const std::vector<double>& places) {
  ComplexGrid x(static_cast<Eigen::Index>(places.size()), 64);
  for (std::size_t k = 0; k < places.size(); ++k) {
    for (int n = 0; n < 64; ++n) {
      const double turn = 2 * M_PI * 75e12 * (2 * 3.0 / 299792458.0) * n / 5e6;
      x(static_cast<Eigen::Index>(k), n) = std::polar(1.0, turn - 1.012 * M_PI * places[k] * std::sin(20 * M_PI / 180));
    }
  }
  return x;
}

RadarConfig radarWith(const std::string& tx, const std::string& more = "") {
  std::string yaml = paperRadarYaml();
  const std::size_t at = yaml.find("tx_position_m"), end = yaml.find('\n', at);
  return parseRadarConfig(yaml.replace(at, end - at, "tx_position_m: " + tx) + more, "radar.yaml");
}

constexpr char kThirdThenFirst[] = "[[0, 0.0077867, 0], [0, 0, 0]]";
constexpr char kOneRaised[] = "[[0, 0, 0], [0, 0.0038934, 0.0019467], [0, 0.0077867, 0]]";

TEST(VirtualLine, TransmittersMaySendInAnyOrder) {
  const Strongest in_order = strongestOf(paperRadar(), pointAt20deg({0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_NEAR(in_order.azimuth_deg, 20, 1);
  EXPECT_NEAR(in_order.range_m, 3, 0.08);
  const RadarConfig radar = radarWith(kThirdThenFirst);
  EXPECT_EQ(radar.virtualLine().channels, (std::vector<int>{4, 5, 6, 7, 0, 1, 2, 3}));
  const Strongest other = strongestOf(radar, pointAt20deg({4, 5, 6, 7, 0, 1, 2, 3}));
  EXPECT_EQ(other.azimuth_deg, in_order.azimuth_deg);
  EXPECT_EQ(other.range_m, in_order.range_m);
  EXPECT_NEAR(other.level_db, in_order.level_db, 1e-9);
}

TEST(VirtualLine, ReceiversMayStandInAnyOrder) {
  RadarConfig radar = paperRadar();
  std::swap(radar.rx_position_m[0], radar.rx_position_m[3]);
  const Strongest seen = strongestOf(radar, pointAt20deg({3, 1, 2, 0, 7, 5, 6, 4}));
  EXPECT_NEAR(seen.azimuth_deg, 20, 1);
  EXPECT_NEAR(seen.range_m, 3, 0.08);
}

TEST(VirtualLine, ASlotOffTheLineIsNamed) {
  const std::string message = inputError([] { SignalChain chain(radarWith(kOneRaised)); });
  EXPECT_TRUE(
      saysInOneLine(message, "tx_position_m: slot 1", "0.0019467 m above", "slots [0, 2]", "angle_slots: [0, 2]"));
  EXPECT_TRUE(saysInOneLine(
      inputError([] { SignalChain chain(radarWith("[[0, 0, 0], [0, 0.0077867, 0], [0.003, 0.0155734, 0]]")); }),
      "slot 2", "0.003 m before", "angle_slots: [0, 1]"));
  EXPECT_TRUE(
      saysInOneLine(inputError([] { SignalChain chain(radarWith("[[0, 0, 0], [0, 0.0077867, 0], [0, 0.01, 0]]")); }),
                    "slot 2", "does not continue", "angle_slots: [0, 1]"));
}

TEST(VirtualLine, AngleSlotsLeaveASlotOut) {
  const RadarConfig radar = radarWith(kOneRaised, "angle_slots: [0, 2]\n");
  // The raised elements see the point from elsewhere: any phase.
  ComplexGrid x = pointAt20deg({0, 1, 2, 3, 2, 3, 4, 5, 4, 5, 6, 7});
  x.middleRows(4, 4) *= std::polar(1.0, 2.5);
  const Strongest seen = strongestOf(radar, x);
  EXPECT_NEAR(seen.azimuth_deg, 20, 1);
  EXPECT_NEAR(seen.range_m, 3, 0.08);
  EXPECT_NEAR(seen.level_db, strongestOf(paperRadar(), pointAt20deg({0, 1, 2, 3, 4, 5, 6, 7})).level_db, 1e-9)
      << "the level is that of the slots that are taken";
  EXPECT_EQ(toYaml(parseRadarConfig(toYaml(radar), "b")), toYaml(radar));
  EXPECT_TRUE(contains(toYaml(radar), "angle_slots: [0, 2]\n"));
  // One slot of four receivers is a line, too: coarser.
  EXPECT_NEAR(strongestOf(radarWith(kOneRaised, "angle_slots: [2]\n"), x).azimuth_deg, 20, 2);
}

TEST(VirtualLine, AngleSlotsAreReadStrictly) {
  const auto refusal = [](const std::string& line) { return inputError([&] { radarWith(kOneRaised, line + "\n"); }); };
  EXPECT_TRUE(saysInOneLine(refusal("angle_slots: [0, 3]"), "angle_slots", "'3'", "0 to 2"));
  EXPECT_TRUE(saysInOneLine(refusal("angle_slots: [0, 0]"), "angle_slots", "twice"));
  EXPECT_TRUE(saysInOneLine(refusal("angle_slots: []"), "angle_slots", "empty"));
  EXPECT_TRUE(saysInOneLine(inputError([] { SignalChain chain(radarWith(kOneRaised, "angle_slots: [0, 1]\n")); }),
                            "angle_slots", "no uniform line"));
}

}  // namespace
}  // namespace mmradartwin
