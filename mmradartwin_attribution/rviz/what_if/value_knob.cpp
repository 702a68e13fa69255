#include "value_knob.h"

#include <QHBoxLayout>
#include <QSignalBlocker>
#include <algorithm>
#include <cmath>
#include <utility>

namespace mmradartwin {
namespace {

constexpr int kSteps = 1000;
constexpr double kWide = 100;  // of two ends, from here on a slider's steps are ratios

}  // namespace

ValueKnob::ValueKnob(const QString& name, double min, double max, std::function<void(double, bool)> on_change)
    : min_(min), max_(max), slider_(new QSlider(Qt::Horizontal)), box_(new QDoubleSpinBox) {
  setObjectName(name);
  box_->setObjectName(name + "_value");
  auto* row = new QHBoxLayout(this);
  row->setContentsMargins(0, 0, 0, 0);
  row->addWidget(slider_, 1);
  row->addWidget(box_);
  slider_->setRange(0, kSteps);
  slider_->setMinimumWidth(60);
  box_->setDecimals(4);
  box_->setRange(min, max);
  box_->setKeyboardTracking(false);
  box_->setMinimumWidth(90);
  connect(slider_, &QSlider::sliderPressed, [this] { drawn_ = false; });
  connect(slider_, &QSlider::valueChanged, [this, on_change](int step) {
    const double value = valueAt(step);
    const QSignalBlocker quiet(box_);
    box_->setValue(value);
    on_change(value, slider_->isSliderDown() && std::exchange(drawn_, true));
  });
  connect(box_, QOverload<double>::of(&QDoubleSpinBox::valueChanged), [this, on_change](double value) {
    const QSignalBlocker quiet(slider_);
    slider_->setValue(stepOf(value));
    on_change(value, false);
  });
}

double ValueKnob::valueAt(int step) const {
  const double share = static_cast<double>(step) / kSteps;
  if (min_ > 0 && max_ / min_ >= kWide) return min_ * std::pow(max_ / min_, share);
  if (min_ == 0 && max_ >= 1e3) return max_ * share * share * share;
  return min_ + (max_ - min_) * share;
}

int ValueKnob::stepOf(double value) const {
  double share = (value - min_) / (max_ - min_);
  if (min_ > 0 && max_ / min_ >= kWide) share = std::log(value / min_) / std::log(max_ / min_);
  if (min_ == 0 && max_ >= 1e3) share = std::cbrt(value / max_);
  return static_cast<int>(std::lround(kSteps * std::clamp(share, 0.0, 1.0)));
}

void ValueKnob::show(double value) {
  if (slider_->isSliderDown() || box_->hasFocus()) return;
  const QSignalBlocker quiet_box(box_), quiet_slider(slider_);
  if (std::isnan(value)) value = std::clamp(0.0, min_, max_);
  box_->setValue(value);
  slider_->setValue(stepOf(value));
}

}  // namespace mmradartwin
