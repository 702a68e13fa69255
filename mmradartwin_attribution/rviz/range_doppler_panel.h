#pragma once

#include <QImage>
#include <QPixmap>
#include <QString>
#include <QWidget>
#include <vector>

#include "color_scale.h"

namespace mmradartwin {

/// What is drawn of a range-Doppler map.
struct RangeDopplerView {
  double up_to_m = 0;        ///< ranges
  double up_to_m_per_s = 0;  ///< speeds to either side
  ColorScale scale;          ///< in the map's own levels
  double reference_db = 0;   ///< what the colour bar calls 0 dB
  QString unit;
};

/// A range-Doppler map: speeds from left (towards the radar) to right (away), ranges upwards, with ticks and a colour
/// bar.
class RangeDopplerPanel : public QWidget {
 public:
  RangeDopplerPanel();
  /// Centres of the bins, ascending and uniform, and levels [range][speed].
  void setMap(const std::vector<double>& range_m, const std::vector<double>& radial_speed_m_per_s,
              const std::vector<float>& power_db, const RangeDopplerView& view);
  void setWords(const QString& title, const QString& note);
  /// Seconds of the processor that painting has taken since the last call.
  double takePainting_s();
  QSize sizeHint() const override { return {460, 280}; }
  QSize minimumSizeHint() const override { return {200, 120}; }

 protected:
  void paintEvent(QPaintEvent* event) override;

 private:
  void drawAxes(QPainter& painter, const QRectF& area) const;

  RangeDopplerView view_;
  QImage cells_;         ///< a pixel per cell, ranges downwards from the farthest
  QRectF cells_extent_;  ///< m/s and m of its edges: left and bottom at x and y
  QString title_, note_;
  double painting_s_ = 0;
};

}  // namespace mmradartwin
