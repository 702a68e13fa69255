#include "residual_list_display.h"

#include <geometry_msgs/PointStamped.h>
#include <rviz/properties/ros_topic_property.h>

#include <QRegularExpression>
#include <QStringList>
#include <QUrl>
#include <cmath>
#include <pluginlib/class_list_macros.hpp>

#include "mmradartwin_attribution/residual.h"
#include "words_panel.h"

namespace mmradartwin {
namespace {

constexpr double kMostOften_hz = 4;

QString signedNumber(double value, int digits) {
  return QString::number(value, 'f', digits).replace('-', QChar(0x2212));
}

QString cell(const QString& words, bool right = false) {
  return QString("<td%1>%2&nbsp;&nbsp;</td>").arg(right ? " align='right'" : "", words);
}

QString rowOf(int number, const mmradartwin_msgs::Residual& r) {
  const auto c = static_cast<ResidualClass>(r.residual_class);
  const QString class_name = QString::fromStdString(className(c) + " " + classLabel(c));
  QString actor = QString::fromStdString(r.actor).replace(';', " + ").toHtmlEscaped();
  if (!r.material.empty()) actor += " (" + QString::fromStdString(r.material).replace(';', " + ").toHtmlEscaped() + ")";
  return "<tr>" + cell(QString("<a href='%1' style='color: #ff8cff'><b>%1</b></a>").arg(number), true) +
         cell(class_name) + cell(actor) + cell(signedNumber(r.range_m, 2) + " m", true) +
         cell(signedNumber(r.azimuth_rad * 180 / M_PI, 0) + QChar(0xb0), true) +
         cell(signedNumber(r.measured_db, 1), true) + cell(signedNumber(r.simulated_db, 1), true) + "</tr>";
}

/// The scene's file, and the names below `mechanisms:`.
QString wordsOf(const mmradartwin_msgs::Scene& twin) {
  QStringList mechanisms;
  bool within = false;
  for (const QString& line : QString::fromStdString(twin.twin_yaml).split('\n')) {
    if (!line.startsWith(' ')) within = line.startsWith("mechanisms:");
    static const QRegularExpression kName("^ {1,4}([a-z]\\w*):");
    const QRegularExpressionMatch name = kName.match(line);
    if (within && name.hasMatch()) mechanisms << name.captured(1);
  }
  QString file = QString::fromStdString(twin.scene_file).section('/', -2);
  if (file.startsWith("mmradartwin_tmp_")) file = "the session's scene";  // written out for the simulation
  return QString("<b>twin</b>: %1; %2").arg(file.toHtmlEscaped(), mechanisms.join(", ").toHtmlEscaped());
}

QString listOf(const mmradartwin_msgs::Residuals& msg) {
  int matched = 0;
  for (const auto& region : msg.regions) matched += region.measured_strong && region.simulated_strong;
  QString html = msg.pose.empty()
                     ? ""
                     : QString::fromUtf8("<b>pose %1</b> · ").arg(QString::fromStdString(msg.pose).toHtmlEscaped());
  html += QString::fromUtf8("places that agree (white boxes): %1 · that differ (magenta): %2")
              .arg(matched)
              .arg(msg.residuals.size());
  if (msg.residuals.empty()) return html;
  html +=
      "<table cellspacing='1'><tr><th></th><th align='left'>class</th><th align='left'>where it is expected from</th>"
      "<th>range</th><th>angle</th><th>measured, dB&nbsp;</th><th>twin, dB</th></tr>";
  int number = 0;
  for (const auto& residual : msg.residuals) html += rowOf(++number, residual);
  return html + "</table>";
}

}  // namespace

ResidualListDisplay::ResidualListDisplay() {
  topic_ = new rviz::RosTopicProperty(
      "Topic", "", QString::fromStdString(ros::message_traits::datatype<mmradartwin_msgs::Residuals>()),
      "Residuals to list.", this);
  scene_topic_ = new rviz::RosTopicProperty(
      "Twin topic", "", QString::fromStdString(ros::message_traits::datatype<mmradartwin_msgs::Scene>()),
      "The twin that is told above the list; empty: none.", this);
  for (rviz::RosTopicProperty* topic : {topic_, scene_topic_}) {
    connect(topic, &rviz::Property::changed, this, [this] { subscribe(); });
  }
}

ResidualListDisplay::~ResidualListDisplay() { delete panel_; }

void ResidualListDisplay::onInitialize() {
  panel_ = new WordsPanel(getName());
  panel_->setObjectName("residual_list");
  panel_->setWords("What the numbers on the maps stand for. No comparison has come yet.");
  setAssociatedWidget(panel_);
  clicked_ = update_nh_.advertise<geometry_msgs::PointStamped>("clicked_point", 2);
  connect(panel_, &QTextBrowser::anchorClicked, this, [this](const QUrl& url) { askAbout(url.toString().toInt()); });
}

// Whoever compares the maps answers what stands behind the line.
void ResidualListDisplay::askAbout(int number) {
  if (!residuals_ || number < 1 || number > static_cast<int>(residuals_->residuals.size())) return;
  const mmradartwin_msgs::Residual& residual = residuals_->residuals[static_cast<std::size_t>(number) - 1];
  geometry_msgs::PointStamped point;
  point.header = residuals_->header;
  point.point.x = residual.range_m * std::cos(residual.azimuth_rad);
  point.point.y = residual.range_m * std::sin(residual.azimuth_rad);
  clicked_.publish(point);
}

void ResidualListDisplay::onDisable() {
  subscriber_.shutdown();
  scene_subscriber_.shutdown();
}

void ResidualListDisplay::setTopic(const QString& topic, const QString&) { topic_->setString(topic); }

void ResidualListDisplay::subscribe() {
  onDisable();
  if (!isEnabled() || !initialized()) return;
  try {
    if (!scene_topic_->getTopicStd().empty()) {
      scene_subscriber_ = update_nh_.subscribe<mmradartwin_msgs::Scene>(
          scene_topic_->getTopicStd(), 1, [this](const mmradartwin_msgs::Scene::ConstPtr& msg) {
            twin_ = wordsOf(*msg);
            due_ = residuals_ != nullptr;
            if (!due_ && panel_) panel_->setWords(twin_ + "<br>The comparison has not come yet.");
          });
    }
    if (topic_->getTopicStd().empty()) return;
    subscriber_ = update_nh_.subscribe<mmradartwin_msgs::Residuals>(
        topic_->getTopicStd(), 1, [this](const mmradartwin_msgs::Residuals::ConstPtr& msg) {
          residuals_ = msg;
          due_ = true;
        });
    setStatus(rviz::StatusProperty::Ok, "Topic", "subscribed");
  } catch (const ros::Exception& error) {
    setStatus(rviz::StatusProperty::Error, "Topic", error.what());
  }
}

void ResidualListDisplay::update(float, float) {
  const ros::WallTime now = ros::WallTime::now();
  if (!due_ || !panel_ || (now - shown_).toSec() < 1 / kMostOften_hz) return;
  due_ = false;
  shown_ = now;
  panel_->setWords((twin_.isEmpty() ? "" : twin_ + "<br>") + listOf(*residuals_));
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::ResidualListDisplay, rviz::Display)
