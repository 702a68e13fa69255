#include "diagnosis/hypotheses/law_words.h"

#include <gtest/gtest.h>

#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

TEST(LawWords, NameObservableVariablePointsAndChannels) {
  Hypothesis h;
  h.mechanism = defaultMechanism("empirical_law");
  NamedParameters law = h.mechanism;
  law.values.set("variable", std::string("range_m"));
  law.values.set("at", std::vector<double>{1, 5});
  law.values.set("gain_db", std::vector<double>{0.5, -2});
  EXPECT_EQ(describeLaw(h, law), "gain_db of the echoes over range_m: 0.5 at 1, -2 at 5");
  law.values.set("channels", std::vector<double>{4, 5});
  EXPECT_EQ(channelsInWords(law), " of channels 4 5");
  EXPECT_NE(describeLaw(h, law).find("of channels 4 5"), std::string::npos);
}

TEST(LawWords, OfALongCurveOnlyTheExtremesAreTold) {
  Hypothesis h;
  h.mechanism = defaultMechanism("empirical_law");
  NamedParameters law = h.mechanism;
  std::vector<double> at, gain_db;
  for (int i = 0; i < 20; ++i) {
    at.push_back(i);
    gain_db.push_back(i == 7 ? -3 : i == 12 ? 4 : 0);
  }
  law.values.set("variable", std::string("azimuth_deg"));
  law.values.set("at", at);
  law.values.set("gain_db", gain_db);
  EXPECT_EQ(describeLaw(h, law), "gain_db of the echoes over azimuth_deg: from -3 at 7 to 4 at 12");
}

TEST(LawWords, TheExperimentIsThatOfTheFirstKindAmongTheCandidates) {
  const std::string reflector = experimentFor({{"radar_yaw_offset", 0.5}, {"gain_drift", 0.5}});
  EXPECT_NE(reflector.find("corner reflector at a surveyed place"), std::string::npos);
  EXPECT_EQ(experimentFor({{"gain_drift", 0.5}, {"radar_yaw_offset", 0.5}}), reflector) << "whatever their order";
  EXPECT_NE(experimentFor({{"elevation_pattern", 0.6}, {"actor_absent", 0.4}}).find("raise the radar"),
            std::string::npos);
  EXPECT_NE(experimentFor({{"actor_absent", 1.0}}).find("absorber"), std::string::npos);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
