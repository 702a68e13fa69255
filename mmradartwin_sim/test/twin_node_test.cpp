// TwinNode in this process, its callbacks called by the test: what a slow simulation leaves of a fast stream, what is
// simulated again when the radar stands, and actors that move with tf.

#include "mmradartwin_sim/ros/twin_node.h"

#include <diagnostic_msgs/DiagnosticArray.h>
#include <geometry_msgs/TransformStamped.h>
#include <gtest/gtest.h>
#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/Session.h>
#include <ros/callback_queue.h>
#include <rosgraph_msgs/Log.h>
#include <tf2_ros/transform_broadcaster.h>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session_files.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using V = Eigen::Vector3d;
constexpr double kPatience_s = 60;  // a loaded machine is slow, not wrong

class TwinNodeTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    addWall("wall", "Metal", {5, -3}, {5, 3});
    addWall("rough", "RoughConcrete", {1, -2.8}, {5, -2.8});
    addBox("crate", "Metal", V(2, 1, -0.5), V(2.4, 1.6, 0.5));
    scene_ = writeScene();
    write("radar.yaml", toYaml(paperRadar()));
    ros::NodeHandle node_private("~");
    node_private.setParam("scene", scene_);
    node_private.setParam("radar", path("radar.yaml"));
    node_private.setParam("rate_hz", 0.0);
    node_private.setParam("diagnostic_period", 0.05);
    node_handle_.setCallbackQueue(&queue_);
    node_private.setCallbackQueue(&queue_);
    node_ = std::make_unique<TwinNode>(node_handle_, node_private);
    grid_out_ = nh_.advertise<mmradartwin_msgs::ReceiveGrid>("radar/grid", 100);
    grid_in_ = nh_.subscribe<mmradartwin_msgs::ReceiveGrid>(
        "twin/grid", 100, [this](const mmradartwin_msgs::ReceiveGrid::ConstPtr& g) { grids_.push_back(g); });
    status_in_ = nh_.subscribe<diagnostic_msgs::DiagnosticArray>(
        "/diagnostics", 100, [this](const diagnostic_msgs::DiagnosticArray::ConstPtr& a) {
          for (const auto& s : a->status) {
            if (s.name.find("twin") == std::string::npos) continue;
            for (const auto& v : s.values) status_[v.key] = v.value;
            summary_ = s.message;
          }
        });
    paths_in_ = nh_.subscribe<mmradartwin_msgs::PathRecords>(
        "twin/paths", 100, [this](const mmradartwin_msgs::PathRecords::ConstPtr& p) { paths_ = p; });
    ASSERT_TRUE(waitFor([this] {
      return grid_out_.getNumSubscribers() > 0 && grid_in_.getNumPublishers() > 0 && paths_in_.getNumPublishers() > 0;
    }));
  }
  void TearDown() override {
    node_.reset();
    SceneFiles::TearDown();
  }
  /// Calls the node's callbacks and the test's until `done`.
  bool waitFor(const std::function<bool()>& done) {
    const ros::WallTime begin = ros::WallTime::now();
    while (ros::ok() && (ros::WallTime::now() - begin).toSec() < kPatience_s) {
      queue_.callAvailable();
      ros::spinOnce();
      if (done()) return true;
      ros::WallDuration(0.01).sleep();
    }
    return false;
  }
  int counted(const std::string& key) const {
    const auto found = status_.find(key);
    return found == status_.end() ? -1 : std::stoi(found->second);
  }
  /// A measured grid at a pose; only its stamp and pose matter.
  void send(double stamp_s, const Eigen::Isometry3d& T_map_radar) {
    ReceiveGrid grid;
    grid.stamp_ns = static_cast<std::int64_t>(std::llround(stamp_s * 1e9));
    grid.source = Branch::kMeasured;
    grid.full_scale = 32768;
    grid.frames = 1;
    grid.pose_valid = true;
    grid.T_map_radar = T_map_radar;
    grid.x = ComplexGrid::Zero(8, 64);
    // A pointer is in the node's queue when publish() returns; the test and the node are one process.
    grid_out_.publish(boost::make_shared<mmradartwin_msgs::ReceiveGrid>(toMsg(grid, radarHash(paperRadar()))));
  }
  void sendActor(double stamp_s, double x_m) {
    geometry_msgs::TransformStamped T;
    T.header.stamp = ros::Time(stamp_s);
    T.header.frame_id = "map";
    T.child_frame_id = "crate";
    T.transform.translation.x = x_m;
    T.transform.rotation.w = 1;
    broadcaster_.sendTransform(T);
  }
  ComplexGrid lastGrid() const { return fromMsg(*grids_.back()).x; }

  std::string scene_;
  ros::CallbackQueue queue_;
  ros::NodeHandle nh_, node_handle_;
  std::unique_ptr<TwinNode> node_;
  tf2_ros::TransformBroadcaster broadcaster_;
  ros::Publisher grid_out_;
  ros::Subscriber grid_in_, status_in_, paths_in_;
  mmradartwin_msgs::PathRecords::ConstPtr paths_;
  std::vector<mmradartwin_msgs::ReceiveGrid::ConstPtr> grids_;
  std::map<std::string, std::string> status_;
  std::string summary_;
};

TEST_F(TwinNodeTest, TakesTheNewestAndCountsTheRest) {
  // While the node is busy poses come; of those that have come it takes the newest.
  int sent = 0;
  for (int batch = 0; batch < 20 && counted("stamps skipped") < 3; ++batch) {
    for (int i = 0; i < 5; ++i, ++sent) send(100 + sent, radarPose(0.001 * sent, 0, 0));
    ASSERT_TRUE(waitFor([&] { return !grids_.empty() && grids_.back()->header.stamp == ros::Time(100 + sent - 1); }))
        << "the newest of a batch comes out, batch " << batch;
    status_.clear();
    ASSERT_TRUE(waitFor([&] { return counted("stamps skipped") >= 0; }));
  }
  EXPECT_GE(counted("stamps skipped"), 3);
  EXPECT_EQ(counted("poses simulated") + counted("stamps skipped"), sent) << "none is kept for later";
  EXPECT_EQ(counted("poses simulated"), static_cast<int>(grids_.size()));
  for (std::size_t i = 1; i < grids_.size(); ++i) EXPECT_LT(grids_[i - 1]->header.stamp, grids_[i]->header.stamp);
}

// What goes out is summed by cells, and still the grid.
TEST_F(TwinNodeTest, PathsAreFewAndAddUpToTheGrid) {
  send(150, radarPose(0.1, 0, 0, -20));
  ASSERT_TRUE(waitFor([&] { return !grids_.empty() && paths_ && paths_->header.stamp == ros::Time(150); }));
  std::vector<PathRecord> records(paths_->records.size());
  for (std::size_t i = 0; i < records.size(); ++i) {
    const mmradartwin_msgs::PathRecord& m = paths_->records[i];
    records[i].length_m.assign(m.length_m.begin(), m.length_m.end());
    for (std::size_t k = 0; k < m.c_re.size(); ++k) records[i].c.emplace_back(m.c_re[k], m.c_im[k]);
  }
  ComplexGrid sum;
  accumulate(paperRadar(), records, sum);
  EXPECT_LT((sum - lastGrid()).norm(), 1e-6 * sum.norm());
  const std::size_t points = makeTwin(scene_).simulate(radarPose(0.1, 0, 0, -20)).records.size();
  EXPECT_GT(points, 200u);
  EXPECT_LT(records.size(), points / 2);
}

TEST_F(TwinNodeTest, UsesRecordsAgainWhileTheRadarStands) {
  for (int i = 0; i < 4; ++i) {
    send(200 + i, radarPose(0.1, 0, 0));
    ASSERT_TRUE(waitFor([&] { return static_cast<int>(grids_.size()) == i + 1; }));
    EXPECT_EQ(grids_.back()->header.stamp, ros::Time(200 + i));
    EXPECT_EQ(grids_.back()->data, grids_.front()->data);
  }
  status_.clear();
  ASSERT_TRUE(waitFor([&] { return counted("grids from records in use") == 3; }));
  EXPECT_EQ(counted("poses simulated"), 1);
  EXPECT_EQ(counted("actors that move with tf"), 0);
}

// The crate of the scene file at the place that tf says, against a twin in which the mechanism actor_moved puts it
// there.
TEST_F(TwinNodeTest, ActorsMoveWithTheirFrames) {
  const auto expected = [&](double x_m) {
    return makeTwin(scene_, "  specular: {}\n  corner: {}\n  diffuse: {}\n  actor_moved: {actor: crate, dx_m: " +
                                std::to_string(x_m) + "}\n")
        .simulate(radarPose(0, 0, 0))
        .grid.x;
  };
  double stamp = 300;
  send(stamp, radarPose(0, 0, 0));
  ASSERT_TRUE(waitFor([&] { return !grids_.empty(); }));
  EXPECT_LT((lastGrid() - expected(0)).norm(), 1e-9 * expected(0).norm());
  for (double x_m : {0.5, 1.25, 0.0}) {
    const ComplexGrid wanted = expected(x_m);
    // The frame's way to the node is not that of the grids: they are sent until it has come.
    ASSERT_TRUE(waitFor([&] {
      stamp += 1;
      sendActor(stamp, x_m);
      send(stamp, radarPose(0, 0, 0));
      return (lastGrid() - wanted).norm() < 1e-9 * wanted.norm();
    })) << x_m;
  }
  status_.clear();
  ASSERT_TRUE(waitFor([&] { return counted("actors that move with tf") == 1; }));
  EXPECT_GE(counted("grids with a moved actor"), 3);
}

// tf2 would keep the crate at the place of the future, and take nothing older.
TEST_F(TwinNodeTest, LeavesTransformsOfTheFutureOut) {
  const double future = ros::Time::now().toSec() + 3600;
  ASSERT_TRUE(waitFor([&] {
    sendActor(future, 1.25);
    return counted("transforms of the future left out") > 0;
  }));
  const ComplexGrid wanted =
      makeTwin(scene_, "  specular: {}\n  corner: {}\n  diffuse: {}\n  actor_moved: {actor: crate, dx_m: 0.5}\n")
          .simulate(radarPose(0, 0, 0))
          .grid.x;
  double stamp = 500;
  EXPECT_TRUE(waitFor([&] {
    stamp += 1;
    sendActor(stamp, 0.5);
    send(stamp, radarPose(0, 0, 0));
    return !grids_.empty() && (lastGrid() - wanted).norm() < 1e-9 * wanted.norm();
  }));
}

TEST_F(TwinNodeTest, SaysThatTheTwinHasNoEcho) {
  send(400, radarPose(1000, 200, 100));  // in millimetres
  ASSERT_TRUE(waitFor([&] { return summary_.find("the twin has no echo") != std::string::npos; }));
  EXPECT_NE(summary_.find("the poses are in mm"), std::string::npos) << summary_;
  send(401, radarPose(1, 0.2, 0.1));
  EXPECT_TRUE(waitFor([&] { return summary_ == "simulating"; })) << summary_;
}

/// A node that is given a twin, and scene and radar by none yet; with what it logs.
class TwinNodeWithoutSceneTest : public TwinNodeTest {
 protected:
  void TearDown() override {
    ros::NodeHandle("~").deleteParam("twin");
    TwinNodeTest::TearDown();
  }
  void start(const std::string& twin_yaml) {
    node_.reset();
    write("twin.yaml", twin_yaml);
    ros::NodeHandle node_private("~");
    node_private.setCallbackQueue(&queue_);
    node_private.deleteParam("scene");
    node_private.deleteParam("radar");
    node_private.setParam("twin", path("twin.yaml"));
    log_in_ = nh_.subscribe<rosgraph_msgs::Log>(
        "/rosout", 100, [this](const rosgraph_msgs::Log::ConstPtr& log) { said_.push_back(*log); });
    ASSERT_TRUE(waitFor([this] { return log_in_.getNumPublishers() > 0; }));
    node_ = std::make_unique<TwinNode>(node_handle_, node_private);
    config_out_ = nh_.advertise<mmradartwin_msgs::RadarConfig>("radar/config", 1, true);
    config_out_.publish(toMsg(paperRadar()));
  }
  bool hasSaid(int level, const std::string& text) const {
    return std::any_of(said_.begin(), said_.end(),
                       [&](const auto& log) { return log.level == level && log.msg.find(text) != std::string::npos; });
  }

  std::vector<rosgraph_msgs::Log> said_;
  ros::Subscriber log_in_;
  ros::Publisher config_out_;
};

// What no session can mend ends the node before one comes.
TEST_F(TwinNodeWithoutSceneTest, EndsWithWhatIsWrongWithItsTwin) {
  start("mechanisms:\n  speculer: {}\n");
  try {
    waitFor([] { return false; });
    FAIL() << "the node goes on";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("speculer"), std::string::npos) << error.what();
  }
}

// As a bag has it that is replayed with another twin: radar/config comes before the session that names the scene.
TEST_F(TwinNodeWithoutSceneTest, WaitsForTheSessionThatNamesIt) {
  write("session.yaml", "format: mmradartwin_session/1\nradar: radar.yaml\nscene: scene.yaml\nposes: poses.csv\n");
  write("poses.csv", "pose,location,stamp,x,y,z,qx,qy,qz,qw\n000,0,1,0,0,0,0,0,0,1\n");
  mmradartwin_msgs::Scene::ConstPtr scene;
  const ros::Subscriber scene_in = nh_.subscribe<mmradartwin_msgs::Scene>(
      "twin/scene", 1, [&](const mmradartwin_msgs::Scene::ConstPtr& s) { scene = s; });
  start("mechanisms:\n  specular: {}\n");
  scene.reset();  // of the other node, latched
  ASSERT_TRUE(waitFor([this] { return hasSaid(rosgraph_msgs::Log::INFO, "no twin yet"); }));
  EXPECT_FALSE(scene);
  mmradartwin_msgs::Session session;
  for (const StoredFile& f : gatherSessionFiles(path("session.yaml"))) session.files.push_back(toMsg(f));
  session.capture_sha256 = {""};
  ros::Publisher session_out = nh_.advertise<mmradartwin_msgs::Session>("session", 1, true);
  session_out.publish(session);
  ASSERT_TRUE(waitFor([&] { return scene != nullptr; }));
  EXPECT_NE(scene->twin_yaml.find("specular"), std::string::npos);
  for (const rosgraph_msgs::Log& log : said_) EXPECT_LT(log.level, rosgraph_msgs::Log::ERROR) << log.msg;
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  ros::init(argc, argv, "test_twin_node");
  const ros::NodeHandle until_all_have_run;  // ROS and its log end with the last handle
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
