#pragma once

#include <QImage>
#include <QPixmap>
#include <QString>
#include <QWidget>
#include <functional>
#include <memory>
#include <vector>

#include "fan_geometry.h"
#include "map_shading.h"

namespace mmradartwin {

/// A box around a place of the map, with a number that a list explains (0: none).
struct MapMark {
  double range_m = 0, azimuth_rad = 0;
  double half_range_m = 0, half_azimuth_rad = 0;
  Rgb color;
  int number = 0;
};

/// A map seen from above, boresight up, left is left: rings and rays with labels of constant size, boxes, and a colour
/// bar.
class MapPanel : public QWidget {
 public:
  MapPanel();
  /// The part of the fan that is shown: up to a range and to an angle at either side.
  void setFan(std::shared_ptr<const FanGeometry> geometry, double up_to_m, double up_to_rad);
  void setMap(const ShadedMap& map, const QString& unit);
  void setWords(const QString& title, const QString& note);
  void setMarks(std::vector<MapMark> marks);
  /// Is told where in the fan a click with the left button was.
  void setOnClick(std::function<void(double range_m, double azimuth_rad)> on_click);
  /// Has what was set painted.
  void refresh();
  /// Seconds of the processor that painting has taken since the last call.
  double takePainting_s();
  QSize sizeHint() const override { return {460, 280}; }
  QSize minimumSizeHint() const override { return {160, 100}; }

 protected:
  void paintEvent(QPaintEvent* event) override;
  void mousePressEvent(QMouseEvent* event) override;

 private:
  void lookUpCells();
  void drawDecoration();
  void drawMarks(QPainter& painter) const;
  QPointF at(double range_m, double azimuth_rad) const;

  std::shared_ptr<const FanGeometry> geometry_;
  double up_to_m_ = 0, up_to_rad_ = 0;
  ShadedMap map_;
  QString unit_, title_, note_;
  std::vector<MapMark> marks_;
  std::function<void(double, double)> on_click_;
  QPointF apex_px_;
  double scale_px_ = 0;                      ///< pixels of a metre
  std::vector<std::int32_t> cell_of_pixel_;  ///< of image_, -1: none
  QImage image_;
  QPoint image_at_;
  QPixmap decoration_, over_;  ///< rings, words and bar; the same with boxes
  bool cells_due_ = true, image_due_ = true, decoration_due_ = true, over_due_ = true, paint_due_ = true;
  double painting_s_ = 0;
};

}  // namespace mmradartwin
