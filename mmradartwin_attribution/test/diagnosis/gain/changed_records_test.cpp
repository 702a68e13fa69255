#include "diagnosis/gain/changed_records.h"

#include <gtest/gtest.h>

#include "cabinet_twin.h"
#include "diagnosis/catalogue/default_mechanism.h"

namespace mmradartwin::diagnosis {
namespace {

NamedParameters darker(double delta_db) {
  NamedParameters mechanism = defaultMechanism("material_reflectivity");
  mechanism.values.set("actor", std::string("cabinet"));
  mechanism.values.set("delta_db", delta_db);
  return mechanism;
}

class ChangedRecords : public ::testing::Test {
 protected:
  CabinetTwin cabinet_;
  NamedParameters specular_ = defaultMechanism("specular");
  Twin twin_ = cabinet_.with({specular_});
  ChannelData data_ = channelsAt({facingEastAt(0, 0), facingEastAt(1, 0.1)});
};

TEST_F(ChangedRecords, TheSameMechanismsChangeNothing) {
  EXPECT_TRUE(changedRecords(twin_, data_, {}, {specular_}, {specular_}).empty());
  EXPECT_TRUE(changedRecords(twin_, data_, {}, {specular_}, {specular_, darker(-0.01)}).empty());
}

TEST_F(ChangedRecords, ALevelChangesAndThePlaceStays) {
  const auto records = changedRecords(twin_, data_, {}, {specular_}, {specular_, darker(-10)});
  ASSERT_EQ(records.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const ChangedRecord& record = records[i];
    EXPECT_EQ(record.pose, std::to_string(i));
    EXPECT_EQ(record.event, "specular");
    EXPECT_EQ(record.actors, std::vector<std::string>{"cabinet"});
    ASSERT_TRUE(record.before && record.after);
    EXPECT_NEAR(record.after->amplitude_db - record.before->amplitude_db, -10, 1e-9);
    EXPECT_NEAR(record.before->range_m, i == 0 ? 3 : 2, 0.01);
    EXPECT_NEAR(record.after->range_m, record.before->range_m, 1e-9);
    EXPECT_NEAR(record.after->azimuth_deg, 0, 0.5);
    EXPECT_EQ(record.strongest_db(), record.before->amplitude_db);
  }
}

TEST_F(ChangedRecords, APathThatComesHasNothingBefore) {
  const auto records = changedRecords(twin_, data_, {"1"}, {}, {specular_});
  ASSERT_EQ(records.size(), 1u);
  EXPECT_EQ(records[0].pose, "1");
  EXPECT_FALSE(records[0].before);
  ASSERT_TRUE(records[0].after);
  const auto gone = changedRecords(twin_, data_, {"1"}, {specular_}, {});
  ASSERT_EQ(gone.size(), 1u);
  EXPECT_FALSE(gone[0].after);
  EXPECT_EQ(gone[0].before->amplitude_db, records[0].after->amplitude_db);
}

TEST_F(ChangedRecords, ATurnedRadarMovesAzimuthsTheOtherWay) {
  NamedParameters yaw = defaultMechanism("radar_yaw_offset");
  yaw.values.set("yaw_deg", 5.0);
  const auto records = changedRecords(twin_, data_, {"0"}, {specular_}, {specular_, yaw});
  ASSERT_EQ(records.size(), 1u);
  EXPECT_NEAR(records[0].after->azimuth_deg - records[0].before->azimuth_deg, -5, 0.05);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
