#include "legend_display.h"

#include <rviz/properties/ros_topic_property.h>

#include <QColor>
#include <functional>
#include <pluginlib/class_list_macros.hpp>

#include "words_panel.h"

namespace mmradartwin {
namespace {

using visualization_msgs::Marker;

bool isDrawn(const Marker& m) {
  return m.action == Marker::ADD && m.type != Marker::TEXT_VIEW_FACING && m.type != Marker::ARROW;
}

QString colorOf(const Marker& m) {
  const std_msgs::ColorRGBA& c = m.colors.empty() ? m.color : m.colors.front();
  return QColor::fromRgbF(c.r, c.g, c.b).name();
}

}  // namespace

LegendDisplay::LegendDisplay() {
  const QString type = QString::fromStdString(ros::message_traits::datatype<visualization_msgs::MarkerArray>());
  const char* names[2] = {"Topic", "Second topic"};
  for (int i = 0; i < 2; ++i) {
    topics_[i] = new rviz::RosTopicProperty(names[i], "", type, "Markers whose namespaces are told.", this);
    connect(topics_[i], &rviz::Property::changed, this, [this] { subscribe(); });
  }
}

LegendDisplay::~LegendDisplay() { delete panel_; }

void LegendDisplay::onInitialize() {
  panel_ = new WordsPanel(getName());
  setAssociatedWidget(panel_);
}

void LegendDisplay::onDisable() {
  for (ros::Subscriber& subscriber : subscribers_) subscriber.shutdown();
}

void LegendDisplay::subscribe() {
  onDisable();
  if (!isEnabled() || !initialized()) return;
  for (int i = 0; i < 2; ++i) {
    colors_[i].clear();
    const std::string topic = topics_[i]->getTopicStd();
    if (topic.empty()) continue;
    try {
      subscribers_[i] = update_nh_.subscribe<visualization_msgs::MarkerArray>(
          topic, 1, [this, i](const visualization_msgs::MarkerArray::ConstPtr& msg) { onMarkers(*msg, i); });
    } catch (const ros::Exception& error) {
      setStatus(rviz::StatusProperty::Error, topics_[i]->getName(), error.what());
    }
  }
  show();
}

// A rim has a lower number than what it surrounds, so the last marker of a namespace has the colour that is seen.
void LegendDisplay::onMarkers(const visualization_msgs::MarkerArray& msg, int topic) {
  for (const Marker& m : msg.markers) {
    if (m.action == Marker::DELETEALL) colors_[topic].clear();
    if (m.action == Marker::DELETE) colors_[topic].erase(m.ns);
    if (isDrawn(m)) colors_[topic][m.ns] = colorOf(m);
  }
  show();
}

void LegendDisplay::show() {
  if (!panel_) return;
  QString html;
  for (const auto& colors : colors_) {
    if (colors.empty()) continue;
    html += "<p style='margin:2px'>";
    for (const auto& [name, color] : colors) {
      const std::string base =
          name.size() > 6 && name.substr(name.size() - 6) == " level" ? name.substr(0, name.size() - 6) : "";
      if (!base.empty() && colors.count(base)) continue;  // the same, lighter
      html += QString("<span style='color:%1;font-size:17px'>&#9632;</span>&nbsp;%2&nbsp;&nbsp; ")
                  .arg(color, QString::fromStdString(name).toHtmlEscaped().replace(' ', "&nbsp;"));
    }
    html += "</p>";
  }
  panel_->setWords(html.isEmpty() ? "Colours of materials, boxes and paths. None has come yet." : html);
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::LegendDisplay, rviz::Display)
