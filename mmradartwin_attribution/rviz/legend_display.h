#pragma once

#include <ros/subscriber.h>
#include <rviz/display.h>
#include <visualization_msgs/MarkerArray.h>

#include <QPointer>
#include <map>
#include <string>

namespace rviz {
class RosTopicProperty;
}

namespace mmradartwin {

class WordsPanel;

/// rviz display that tells what colours of markers mean: a line for each namespace of up to two MarkerArrays.
class LegendDisplay : public rviz::Display {
 public:
  LegendDisplay();
  ~LegendDisplay() override;

 protected:
  void onInitialize() override;
  void onEnable() override { subscribe(); }
  void onDisable() override;

 private:
  void subscribe();
  void onMarkers(const visualization_msgs::MarkerArray& msg, int topic);
  void show();

  rviz::RosTopicProperty* topics_[2];
  ros::Subscriber subscribers_[2];
  std::map<std::string, QString> colors_[2];  ///< "#rrggbb" by namespace
  QPointer<WordsPanel> panel_;
};

}  // namespace mmradartwin
