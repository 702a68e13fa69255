#pragma once

#ifndef Q_MOC_RUN
#include <mmradartwin_msgs/EditTwin.h>
#include <mmradartwin_msgs/WhatIf.h>
#include <ros/ros.h>
#include <rviz/panel.h>
#endif

#include <QFormLayout>
#include <QLabel>
#include <QListWidget>
#include <QPushButton>
#include <QTableWidget>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "../service_thread.h"
#include "value_knob.h"

namespace mmradartwin {

/// What would be if: actors with their materials and places, mechanisms with their numbers, where the radar stands;
/// numbers before and after. All is done by what_if_node; this shows its state and calls its services.
class WhatIfPanel : public rviz::Panel {
 public:
  explicit WhatIfPanel(QWidget* parent = nullptr);
  ~WhatIfPanel() override;

 private:
  using Edit = mmradartwin_msgs::EditTwin::Request;

  QWidget* makeActors();
  QWidget* makeMechanisms();
  QWidget* makeRadar();
  void onState(const mmradartwin_msgs::WhatIf::ConstPtr& state);
  void showNumbers();
  void showActors();
  void showActor();
  void showMechanisms();
  void showMechanism();
  /// knob: what is drawn; of its changes that continue one another and wait still the newest counts.
  void sendEdit(const std::string& knob, const Edit& edit);
  template <typename Service>
  void send(const std::string& service, const typename Service::Request& request, const std::string& knob = "");
  void say(bool success, const QString& message);
  void sendRadar(bool continues);
  void sendPlace(bool continues);
  /// Knobs of a list of numbers, in place of those in the form.
  void fill(QFormLayout& form, std::map<std::string, ValueKnob*>& knobs,
            const std::vector<mmradartwin_msgs::WhatIfParameter>& numbers, const QString& prefix,
            const std::function<void(const std::string& key, double value, bool continues)>& on_change);
  const mmradartwin_msgs::WhatIfActor* chosenActor() const;
  const mmradartwin_msgs::WhatIfMechanism* chosenMechanism() const;

  mmradartwin_msgs::WhatIf::ConstPtr state_;
  ros::NodeHandle nh_;
  ros::Subscriber subscriber_;
  ServiceThread services_;

  QLabel *numbers_, *words_, *answer_;
  QPushButton *undo_, *revert_, *save_;
  QTableWidget* actors_;
  ValueKnob *x_m_, *y_m_, *yaw_deg_;
  QListWidget* mechanisms_;
  ValueKnob *forward_m_, *left_m_, *radar_yaw_deg_, *radar_pitch_deg_;
  QFormLayout *material_form_, *mechanism_form_;
  std::map<std::string, ValueKnob*> material_knobs_, mechanism_knobs_;
  QString material_of_, mechanism_of_;  ///< whose knobs the forms hold
};

}  // namespace mmradartwin
