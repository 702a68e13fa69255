// Drives the panel "What if" as a person does, by Qt's events, with a what_if_node beside it.

#include "what_if_panel.h"

#include <gtest/gtest.h>

#include <QApplication>
#include <QCheckBox>
#include <QComboBox>
#include <QListWidget>
#include <QPushButton>
#include <QTabWidget>
#include <QTableWidget>
#include <QtTest>
#include <cstdlib>
#include <filesystem>
#include <functional>

#include "label_contrast.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/session.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin {
namespace {

constexpr int kPatience_ms = 60000;

class WhatIfPanelTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string config = resolvePath("package://mmradartwin_config/radar.yaml", "/");
    const RadarConfig radar = loadRadarConfig(config);
    const Twin twin(loadTwin(resolvePath("package://mmradartwin_attribution/test/rviz/office_twin.yaml", "/"),
                             std::nullopt, radar));
    const Eigen::Isometry3d pose = Eigen::Translation3d(2.5, 2.2, 1) * Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ());
    RangeAngleMap map = SignalChain(radar).map(twin.simulate(pose).grid);
    map.stamp_ns = 5'000'000'000;
    map.frames = 1;
    map.pose_valid = true;
    map.T_map_radar = pose;
    map.source = Branch::kMeasured;
    measured_ = nh_.advertise<mmradartwin_msgs::RangeAngleMap>("radar/range_angle", 1, true);
    mmradartwin_msgs::RangeAngleMap msg = toMsg(map, radarHash(radar));
    msg.header.stamp = ros::Time(5);
    msg.header.frame_id = "radar_link";
    measured_.publish(msg);
    state_subscriber_ = nh_.subscribe<mmradartwin_msgs::WhatIf>(
        "what_if/state", 10, [this](const mmradartwin_msgs::WhatIf::ConstPtr& m) { state_ = m; });
    panel_.resize(420, 900);
    panel_.show();
    ASSERT_TRUE(waitFor([&] { return state_ && state_->problem.empty() && table()->rowCount() > 20; }))
        << (state_ ? state_->problem : "no state");
  }
  /// Lets Qt and ROS work until it is so.
  static bool waitFor(const std::function<bool()>& so) {
    return QTest::qWaitFor(
        [&] {
          ros::spinOnce();
          return so();
        },
        kPatience_ms);
  }
  template <typename Widget>
  Widget* find(const QString& name) const {
    auto* widget = panel_.findChild<Widget*>(name);
    if (!widget) ADD_FAILURE() << "no " << name.toStdString();
    return widget;
  }
  QTableWidget* table() const { return find<QTableWidget>("actors"); }
  void press(const QString& button) { QTest::mouseClick(find<QPushButton>(button), Qt::LeftButton); }
  void openTab(int index) { find<QTabWidget>("tabs")->setCurrentIndex(index); }
  const mmradartwin_msgs::WhatIfActor* actor(const std::string& name) const {
    for (const auto& a : state_->actors) {
      if (a.name == name) return &a;
    }
    return nullptr;
  }
  int rowOf(const QString& name) const {
    for (int i = 0; i < table()->rowCount(); ++i) {
      if (table()->item(i, 0)->text() == name) return i;
    }
    return -1;
  }
  void choose(const QString& name) {
    table()->scrollToItem(table()->item(rowOf(name), 0));
    QTest::mouseClick(table()->viewport(), Qt::LeftButton, Qt::NoModifier,
                      table()->visualItemRect(table()->item(rowOf(name), 0)).center());
    ASSERT_EQ(table()->currentRow(), rowOf(name));
  }
  /// Types a number into a knob's box.
  void type(const QString& knob, const char* number) {
    QDoubleSpinBox& box = find<ValueKnob>(knob)->box();
    box.setFocus();
    box.selectAll();
    QTest::keyClicks(&box, number);
    QTest::keyClick(&box, Qt::Key_Return);
    box.clearFocus();
  }
  void expectLabelsToStandOut() {
    const LabelContrasts labels(panel_);
    EXPECT_GT(labels.all().size(), 8u);
    for (const LabelContrast& label : labels.all()) EXPECT_GE(label.ratio, 3) << label.words.toStdString();
  }
  void picture(const std::string& name) {
    const char* folder = std::getenv("MMRADARTWIN_PICTURES");
    if (folder) panel_.grab().save(QString::fromStdString(std::string(folder) + "/" + name + ".png"));
  }

  ros::NodeHandle nh_;
  ros::Publisher measured_;
  ros::Subscriber state_subscriber_;
  mmradartwin_msgs::WhatIf::ConstPtr state_;
  WhatIfPanel panel_;
};

TEST_F(WhatIfPanelTest, WhatAPersonDoes) {
  picture("as_given");
  expectLabelsToStandOut();
  EXPECT_TRUE(state_->edits.empty());
  EXPECT_FALSE(find<QPushButton>("revert")->isEnabled());
  EXPECT_NEAR(state_->now.q1_energy, state_->given.q1_energy, 0);

  // Another material, from the list.
  auto* material = find<QComboBox>("material bookshelf");
  material->setFocus();
  QTest::keyClicks(material, "Metal");
  QTest::keyClick(material, Qt::Key_Return);
  if (state_->edits.empty()) Q_EMIT material->activated(material->currentIndex());
  ASSERT_TRUE(waitFor([&] { return actor("bookshelf")->material == "Metal"; }));
  EXPECT_FALSE(state_->traced);
  EXPECT_NE(state_->now.explained_power, state_->given.explained_power);

  // An actor is hidden, and moved.
  auto* hide = find<QCheckBox>("hide tv");
  QTest::mouseClick(hide, Qt::LeftButton, Qt::NoModifier, QPoint(8, hide->height() / 2));
  ASSERT_TRUE(waitFor([&] { return actor("tv")->hidden; }));
  choose("sofa");
  type("x_m", "0.5");
  ASSERT_TRUE(waitFor([&] { return actor("sofa")->shift_m[0] == 0.5; }));
  type("yaw_deg", "20");
  ASSERT_TRUE(waitFor([&] { return actor("sofa")->yaw_deg == 20; }));
  EXPECT_EQ(actor("sofa")->shift_m[0], 0.5);
  EXPECT_TRUE(state_->traced);
  type("material scattering_coefficient", "0.9");
  ASSERT_TRUE(waitFor([&] { return actor("sofa")->material == "Carpet_sofa"; }));
  picture("actors");

  // A mechanism is switched on and its slider drawn.
  openTab(1);
  auto* list = find<QListWidget>("mechanisms");
  table()->setCurrentCell(-1, -1);
  QListWidgetItem* item = list->findItems("element_pattern", Qt::MatchExactly).value(0);
  ASSERT_NE(item, nullptr);
  list->setCurrentItem(item);
  item->setCheckState(Qt::Checked);
  const auto pattern = [&]() -> const mmradartwin_msgs::WhatIfMechanism* {
    for (const auto& m : state_->mechanisms) {
      if (m.name == "element_pattern" && m.on) return &m;
    }
    return nullptr;
  };
  ASSERT_TRUE(waitFor([&] { return pattern() != nullptr; })) << find<QLabel>("answer")->text().toStdString();
  list->setCurrentItem(list->findItems("element_pattern", Qt::MatchExactly).value(0));
  QSlider& slider = find<ValueKnob>("mechanism cos_exponent")->slider();
  const double before = pattern()->parameters.front().value;
  for (int i = 0; i < 5; ++i) QTest::keyClick(&slider, Qt::Key_Right);
  ASSERT_TRUE(waitFor([&] { return pattern() && pattern()->parameters.front().value > before; }));
  EXPECT_FALSE(state_->traced);
  picture("mechanisms");
  expectLabelsToStandOut();

  // The radar is turned.
  openTab(2);
  type("radar_yaw_deg", "5");
  ASSERT_TRUE(waitFor([&] { return state_->edits.back().find("turned by 5 deg") != std::string::npos; }));
  picture("radar");
  expectLabelsToStandOut();

  // Back, step by step and at once.
  const std::size_t edits = state_->edits.size();
  press("undo");
  ASSERT_TRUE(waitFor([&] { return state_->edits.size() == edits - 1; }));
  press("revert");
  ASSERT_TRUE(waitFor([&] { return state_->edits.empty(); }));
  EXPECT_EQ(actor("bookshelf")->material, "Wood");
  EXPECT_FALSE(actor("tv")->hidden);
  EXPECT_EQ(state_->now.explained_power, state_->given.explained_power);
  ASSERT_TRUE(waitFor([&] { return !find<QPushButton>("revert")->isEnabled(); }));
  EXPECT_EQ(find<QComboBox>("material bookshelf")->currentText(), "Wood");
}

}  // namespace
}  // namespace mmradartwin

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  ros::init(argc, argv, "what_if_panel_test");
  QApplication application(argc, argv);
  return RUN_ALL_TESTS();
}
