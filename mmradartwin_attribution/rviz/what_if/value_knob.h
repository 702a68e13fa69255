#pragma once

#include <QDoubleSpinBox>
#include <QSlider>
#include <QWidget>
#include <functional>

namespace mmradartwin {

/// A number within its range: a slider and a box beside it.
class ValueKnob : public QWidget {
 public:
  /// on_change: what somebody set; `continues` while a slider is being drawn.
  ValueKnob(const QString& name, double min, double max, std::function<void(double value, bool continues)> on_change);
  /// Shows a value, unless somebody is just setting another; NaN: none.
  void show(double value);
  QSlider& slider() { return *slider_; }
  QDoubleSpinBox& box() { return *box_; }

 private:
  double valueAt(int step) const;
  int stepOf(double value) const;

  double min_, max_;
  QSlider* slider_;
  QDoubleSpinBox* box_;
  bool drawn_ = false;  ///< the slider has told a value since it was pressed
};

}  // namespace mmradartwin
