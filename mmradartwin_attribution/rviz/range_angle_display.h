#pragma once

#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/Residuals.h>
#include <ros/publisher.h>
#include <ros/subscriber.h>
#include <rviz/display.h>

#include <QPointer>
#include <QString>
#include <map>
#include <memory>
#include <string>

#include "fan_geometry.h"
#include "map_shading.h"

namespace rviz {
class BoolProperty;
class EnumProperty;
class FloatProperty;
class RosTopicProperty;
class TfFrameProperty;
}  // namespace rviz

namespace mmradartwin {

class FanVisual;
class MapPanel;

/// rviz display of a mmradartwin_msgs/RangeAngleMap: in a panel of the window, and in the scene as a fan where the
/// radar is. Boxes and their numbers come with the Residuals of the same radar.
class RangeAngleDisplay : public rviz::Display {
 public:
  RangeAngleDisplay();
  ~RangeAngleDisplay() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;
  void setTopic(const QString& topic, const QString& datatype) override;
  void setName(const QString& name) override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;

 private:
  void addProperties();
  void subscribe();
  void onMap(const mmradartwin_msgs::RangeAngleMap::ConstPtr& msg);
  void onResiduals(const mmradartwin_msgs::Residuals::ConstPtr& msg);
  /// Shows the last map, by what the properties say.
  void show();
  void showWords();
  void showMarks();
  void askAbout(double range_m, double azimuth_rad);
  bool isResidual() const;
  MapShading shading() const;
  /// Up to where the fan is drawn: the property, or what all displays together need.
  double range_m();
  double neededRange_m() const;
  void drawInScene();
  void place();
  void tell(rviz::StatusProperty::Level level, const QString& name, const QString& text);
  void tellTime(double spent_s);

  rviz::RosTopicProperty *topic_, *residuals_topic_;
  rviz::EnumProperty *kind_, *colors_, *reference_;
  rviz::FloatProperty *span_, *residual_span_, *reference_dbfs_, *peak_beyond_, *range_;
  rviz::BoolProperty *front_only_, *in_scene_, *flat_, *grid_, *color_bar_, *fade_;
  rviz::FloatProperty *alpha_, *height_;
  rviz::TfFrameProperty* floor_frame_;

  ros::Subscriber map_subscriber_, residuals_subscriber_;
  ros::Publisher clicked_;
  mmradartwin_msgs::RangeAngleMap::ConstPtr map_;
  mmradartwin_msgs::Residuals::ConstPtr residuals_;
  std::shared_ptr<const FanGeometry> geometry_;
  ShadedMap shaded_, faded_;
  QPointer<MapPanel> panel_;
  std::unique_ptr<FanVisual> visual_;
  bool due_ = false;                 ///< properties, map or residuals have changed since show()
  bool visual_due_ = false;          ///< the fan in the scene has not the last map
  std::map<QString, QString> told_;  ///< statuses
  double spent_s_ = 0;               ///< by this display of the window's thread, since it was told last
  int spent_maps_ = 0;
};

}  // namespace mmradartwin
