#pragma once

#include <mmradartwin_msgs/RangeDopplerMap.h>
#include <ros/subscriber.h>
#include <rviz/display.h>

#include <QPointer>
#include <QString>

namespace rviz {
class EnumProperty;
class FloatProperty;
class RosTopicProperty;
}  // namespace rviz

namespace mmradartwin {

class RangeDopplerPanel;

/// rviz display of a mmradartwin_msgs/RangeDopplerMap in a panel of the window.
class RangeDopplerDisplay : public rviz::Display {
 public:
  RangeDopplerDisplay();
  ~RangeDopplerDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;
  void setTopic(const QString& topic, const QString& datatype) override;
  void setName(const QString& name) override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void subscribe();
  void onMap(const mmradartwin_msgs::RangeDopplerMap::ConstPtr& msg);
  void show();
  double peak_db() const;
  /// Up to where to either side there are levels from here on.
  double followedSpeed_m_per_s(double from_db);

  rviz::RosTopicProperty* topic_;
  rviz::EnumProperty *colors_, *reference_;
  rviz::FloatProperty *span_, *reference_dbfs_, *range_, *speed_;

  ros::Subscriber subscriber_;
  mmradartwin_msgs::RangeDopplerMap::ConstPtr map_;
  QPointer<RangeDopplerPanel> panel_;
  double shown_m_per_s_ = 0;
  bool due_ = false;    ///< properties or map have changed since show()
  double spent_s_ = 0;  ///< of the window's thread, since it was told last
  int spent_maps_ = 0;
};

}  // namespace mmradartwin
