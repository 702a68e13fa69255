#pragma once

#include <mmradartwin_msgs/Residuals.h>
#include <mmradartwin_msgs/Scene.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <ros/time.h>
#include <rviz/display.h>

#include <QPointer>

namespace rviz {
class RosTopicProperty;
}

namespace mmradartwin {

class WordsPanel;

/// rviz display of mmradartwin_msgs/Residuals: what the numbers on the maps stand for, and which twin they are of.
class ResidualListDisplay : public rviz::Display {
 public:
  ResidualListDisplay();
  ~ResidualListDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void setTopic(const QString& topic, const QString& datatype) override;

 protected:
  void onInitialize() override;
  void onEnable() override { subscribe(); }
  void onDisable() override;

 private:
  void subscribe();
  void askAbout(int number);
  rviz::RosTopicProperty *topic_, *scene_topic_;
  ros::Subscriber subscriber_, scene_subscriber_;
  ros::Publisher clicked_;
  QString twin_;  ///< its scene and mechanisms
  mmradartwin_msgs::Residuals::ConstPtr residuals_;
  bool due_ = false;
  ros::WallTime shown_;
  QPointer<WordsPanel> panel_;
};

}  // namespace mmradartwin
