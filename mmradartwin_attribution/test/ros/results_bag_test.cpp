#include "mmradartwin_attribution/ros/results_bag.h"

#include <gtest/gtest.h>
#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/Residuals.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/StoredPoses.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>
#include <tf2_msgs/TFMessage.h>
#include <visualization_msgs/MarkerArray.h>

#include <map>

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "synthetic_map.h"

namespace mmradartwin {
namespace {

/// A pose that measures an echo at 5 m which the simulation lacks.
PoseResult poseAt(std::size_t index, double x_m, const EvaluationField& field) {
  const RadarConfig radar = paperRadar();
  PoseResult result;
  result.index = index;
  result.used = true;
  result.pose.name = "pose" + std::to_string(index);
  result.pose.T_map_radar = Eigen::Isometry3d(Eigen::Translation3d(x_m, 2, 1));
  result.attribution =
      attributePose(field, synthetic::map(radar, {{3, 0, 0}, {5, 30, -5}}), synthetic::map(radar, {{3, 0, 0}}), {}, {});
  static const std::string event = "specular";
  PathRecord record;
  record.event = &event;
  result.records = {record};
  return result;
}

class WrittenBag : public ::testing::Test {
 protected:
  void SetUp() override {
    const EvaluationField field(AttributionConfig(), paperRadar(), SignalChain(paperRadar()).axes());
    ResultsBag writer(file_, field, paperRadar(), scene_, "mechanisms: {}");
    writer.add(poseAt(1, 7, field));  // poses may come in any order
    writer.add(poseAt(0, 4, field));
    Evaluation evaluation;
    evaluation.central.poses = 2;
    evaluation.central.recall = 0.5;
    evaluation.duplicates = {"pose2"};
    evaluation.poses = {poseAt(0, 4, field), poseAt(1, 7, field)};
    writer.finish(evaluation);
    bag_.open(file_, rosbag::bagmode::Read);
  }
  template <typename Message>
  std::vector<std::pair<ros::Time, Message>> messages(const std::string& topic) {
    std::vector<std::pair<ros::Time, Message>> found;
    rosbag::View view(bag_, rosbag::TopicQuery(topic));
    for (const rosbag::MessageInstance& m : view) found.emplace_back(m.getTime(), *m.instantiate<Message>());
    return found;
  }
  const Scene scene_;
  TemporaryFolder folder_;
  std::string file_ = folder_.path() + "/results.bag";
  rosbag::Bag bag_;
};

TEST_F(WrittenBag, ShowsPosesInTheirOrderTwoSecondsEach) {
  const auto residuals = messages<mmradartwin_msgs::Residuals>("attribution/residuals");
  ASSERT_EQ(residuals.size(), 2u);
  EXPECT_EQ(residuals[0].second.pose, "pose0");
  EXPECT_EQ(residuals[1].second.pose, "pose1");
  EXPECT_NEAR((residuals[1].first - residuals[0].first).toSec(), 2, 1e-9);
  ASSERT_EQ(residuals[0].second.residuals.size(), 1u);
  EXPECT_NEAR(residuals[0].second.residuals[0].range_m, 5, 0.05);
  EXPECT_EQ(messages<visualization_msgs::MarkerArray>("attribution/markers").size(), 2u);
}

TEST_F(WrittenBag, PutsTheRadarWhereItWasAsLongAsItsPoseIsShown) {
  const auto transforms = messages<tf2_msgs::TFMessage>("/tf");
  ASSERT_EQ(transforms.size(), 9u);  // the last one ends the bag
  const ros::Time second = messages<mmradartwin_msgs::Residuals>("attribution/residuals")[1].second.header.stamp;
  for (const auto& [time, message] : transforms) {
    ASSERT_EQ(message.transforms.size(), 1u);
    const auto& transform = message.transforms[0];
    EXPECT_EQ(transform.header.frame_id, "map");
    EXPECT_EQ(transform.child_frame_id, "radar_link");
    EXPECT_EQ(transform.header.stamp, time);
    EXPECT_NEAR(transform.transform.translation.x, time < second ? 4 : 7, 1e-12);
    EXPECT_NEAR(transform.transform.rotation.w, 1, 1e-12);
  }
}

TEST_F(WrittenBag, TellsTheLedgerAndSceneToWhoeverComesLater) {
  const auto ledgers = messages<mmradartwin_msgs::Ledger>("attribution/ledger");
  ASSERT_EQ(ledgers.size(), 1u);
  EXPECT_EQ(ledgers[0].second.poses, 2u);
  EXPECT_EQ(ledgers[0].second.recall, 0.5);
  EXPECT_EQ(ledgers[0].second.excluded_duplicates, std::vector<std::string>{"pose2"});
  std::map<std::string, std::string> latched;
  rosbag::View view(bag_);
  for (const rosbag::ConnectionInfo* connection : view.getConnections()) {
    const auto entry = connection->header->find("latching");
    latched[connection->topic] = entry == connection->header->end() ? "" : entry->second;
  }
  EXPECT_EQ(latched["attribution/ledger"], "1");
  EXPECT_EQ(latched["attribution/scene_markers"], "1");
  EXPECT_NE(latched["attribution/residuals"], "1");
}

TEST_F(WrittenBag, HoldsWhatAPlaceIsExplainedWith) {
  const auto poses = messages<mmradartwin_msgs::StoredPoses>("inspect/poses");
  ASSERT_EQ(poses.size(), 1u);
  ASSERT_EQ(poses[0].second.poses.size(), 2u);
  EXPECT_EQ(poses[0].second.attribution_yaml, toYaml(AttributionConfig()));
  const auto residuals = messages<mmradartwin_msgs::Residuals>("attribution/residuals");
  const auto paths = messages<mmradartwin_msgs::PathRecords>("twin/paths");
  ASSERT_EQ(paths.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const mmradartwin_msgs::PoseFigures& figures = poses[0].second.poses[i];
    EXPECT_EQ(figures.name, residuals[i].second.pose);
    EXPECT_EQ(figures.header.stamp, residuals[i].second.header.stamp);
    EXPECT_EQ(figures.figures.class_count[4], 1u);  // the echo that the simulation lacks
    EXPECT_GT(figures.residual_rms_db, 0);
    EXPECT_EQ(paths[i].second.header.stamp, figures.header.stamp);
    ASSERT_EQ(paths[i].second.records.size(), 1u);
    EXPECT_EQ(paths[i].second.records[0].event, "specular");
  }
  const auto radar = messages<mmradartwin_msgs::RadarConfig>("radar/config");
  ASSERT_EQ(radar.size(), 1u);
  EXPECT_EQ(paths[0].second.radar_hash, radarHash(radar[0].second));
  const auto scenes = messages<mmradartwin_msgs::Scene>("twin/scene");
  ASSERT_EQ(scenes.size(), 1u);
  EXPECT_EQ(scenes[0].second.twin_yaml, "mechanisms: {}");
}

TEST(ResultsBag, SaysWhichFileCannotBeWritten) {
  const EvaluationField field(AttributionConfig(), paperRadar(), SignalChain(paperRadar()).axes());
  try {
    const Scene scene;
    ResultsBag writer("/nowhere/results.bag", field, paperRadar(), scene);
    FAIL() << "was opened";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("/nowhere/results.bag"), std::string::npos);
  }
}

}  // namespace
}  // namespace mmradartwin
