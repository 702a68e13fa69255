#pragma once

#include <QWidget>
#include <array>
#include <memory>
#include <string>

#include "fan_geometry.h"
#include "map_shading.h"
#include "twin_link.h"

class QLabel;

namespace mmradartwin {

class MapPanel;

/// A window with the simulated maps and the residuals of two twins side by side: as given at the left, with what a
/// diagnosis has found at the right. All four are drawn to one scale of range and of colours.
class BeforeAfter : public QWidget {
 public:
  explicit BeforeAfter(QWidget* parent);
  void showTwins(const TwinFigures& given, const TwinFigures& corrected);

 private:
  struct Map {
    MapPanel* panel = nullptr;
    std::shared_ptr<const FanGeometry> geometry;
    mmradartwin_msgs::RangeAngleMap::ConstPtr shown;
    ShadedMap shaded;
  };
  void take(Map& map, const mmradartwin_msgs::RangeAngleMap::ConstPtr& msg, bool residual);
  void draw(Map& map, double up_to_m, const QString& title, const QString& note);

  QLabel* words_ = nullptr;
  std::array<std::array<Map, 2>, 2> maps_;  ///< simulated, residual; as given, corrected
};

}  // namespace mmradartwin
