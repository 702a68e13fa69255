#pragma once

#include <QPalette>
#include <QWidget>

namespace mmradartwin {

/// Letters of what is switched off in a panel lie between those of what is not and the ground, near enough to the
/// former that they can be read: Qt's own have a contrast of 1.6.
inline void keepDisabledLettersReadable(QWidget& panel) {
  constexpr double kInk = 0.6;
  QPalette palette = panel.palette();
  const QColor ground = palette.color(QPalette::Active, QPalette::Window);
  for (QPalette::ColorRole role : {QPalette::WindowText, QPalette::Text, QPalette::ButtonText}) {
    const QColor ink = palette.color(QPalette::Active, role);
    const auto mixed = [&](int of_ink, int of_ground) {
      return static_cast<int>(kInk * of_ink + (1 - kInk) * of_ground + 0.5);
    };
    palette.setColor(
        QPalette::Disabled, role,
        QColor(mixed(ink.red(), ground.red()), mixed(ink.green(), ground.green()), mixed(ink.blue(), ground.blue())));
  }
  panel.setPalette(palette);
}

}  // namespace mmradartwin
