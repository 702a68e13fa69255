#include "diagnosis/search/law_screen.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../made_room.h"

namespace mmradartwin::diagnosis {
namespace {

/// The first law of the list that is over a variable.
const Screened* lawOver(const ScreenedLaws& found, const std::string& parameter, const std::string& variable) {
  for (const Screened& s : found.laws) {
    const NamedParameters& m = s.hypothesis.mechanism;
    if (m.mechanism == "empirical_law" && s.hypothesis.coordinates[0].parameter == parameter &&
        m.values.text("variable") == variable && m.values.text("actor").empty() &&
        m.values.numbers("channels").empty()) {
      return &s;
    }
  }
  return nullptr;
}

/// A law's value at x, by its own table.
double valueAt(const Screened& law, const std::string& parameter, double x) {
  const Parameters values = law.hypothesis.at(law.starts[0]).values;
  const std::vector<double>&at = values.numbers("at"), &table = values.numbers(parameter);
  if (x <= at.front()) return table.front();
  for (std::size_t i = 1; i < at.size(); ++i) {
    if (x > at[i]) continue;
    return table[i - 1] + (x - at[i - 1]) / (at[i] - at[i - 1]) * (table[i] - table[i - 1]);
  }
  return table.back();
}

ScreenedLaws lawsOf(MadeRoom& room) {
  FittedRoom fitted(room, firstOrder());
  // The errors of actors and poses as if nothing had stood in for the law.
  return screenLaws(*room.twin, fitted.model, fitted.null, fitted.everyPose());
}

TEST(LawScreen, GainsThatDifferFromPoseToPoseFollowNoTime) {
  MadeRoom room(24);
  room.measure(firstOrder());
  for (std::size_t i = 0; i < room.data.poses.size(); ++i) {
    room.data.poses[i].range_spectra *= std::pow(10.0, 4 * std::cos(2.4 * static_cast<double>(i * i)) / 20);
  }
  const ScreenedLaws found = lawsOf(room);
  EXPECT_FALSE(found.gains_follow_time);
  for (const Screened& s : found.laws) EXPECT_NE(s.hypothesis.mechanism.mechanism, "gain_drift");
}

TEST(LawScreen, FindsDelaysOverAzimuth) {
  MadeRoom room(24);
  room.measure({firstOrder()[0], mechanismWith("radar_position_offset", {{"left_m", 0.06}})});
  const Screened* law = nullptr;
  const ScreenedLaws found = lawsOf(room);
  law = lawOver(found, "delay_m", "azimuth_deg");
  ASSERT_NE(law, nullptr);
  // Half a metre to the left of an echo at 40 degrees is nearer to it: -0.06 sin(40 deg).
  EXPECT_NEAR(valueAt(*law, "delay_m", 40) - valueAt(*law, "delay_m", -40), -0.06 * 2 * std::sin(40 * M_PI / 180),
              0.03);
}

TEST(LawScreen, LooksForNoLawBesideOneThatIsKnown) {
  MadeRoom room(4);
  std::vector<NamedParameters> mechanisms = firstOrder();
  NamedParameters law = defaultMechanism("empirical_law");
  law.values.set("variable", std::string("time_s"));
  law.values.set("at", std::vector<double>{0, 100});
  law.values.set("gain_db", std::vector<double>{0, 1});
  mechanisms.push_back(law);
  room.measure(mechanisms);
  FittedRoom fitted(room, mechanisms);
  EXPECT_TRUE(screenLaws(*room.twin, fitted.model, fitted.null, fitted.everyPose()).laws.empty());
  EXPECT_TRUE(screenLaws(*room.twin, fitted.model, fitted.null, {}).laws.empty());
}

}  // namespace
}  // namespace mmradartwin::diagnosis
