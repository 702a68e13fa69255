#include "range_doppler_panel.h"

#include <QPainter>
#include <algorithm>
#include <cmath>
#include <utility>

#include "level_colors.h"
#include "map_painting.h"
#include "scale_ticks.h"
#include "thread_time.h"

namespace mmradartwin {
namespace {

constexpr double kTitle_px = 38;                      // two lines above the map
constexpr double kLeft_px = 44, kBottom_px = 42;      // for ticks and words
constexpr double kRight_px = 12, kAboveTicks_px = 4;  // between map, bar and words

double binWidth(const std::vector<double>& centers) {
  return centers.size() > 1 ? (centers.back() - centers.front()) / static_cast<double>(centers.size() - 1) : 1;
}

QString signedText(double value) { return QString::number(value).replace('-', QChar(0x2212)); }

}  // namespace

RangeDopplerPanel::RangeDopplerPanel() {
  setAttribute(Qt::WA_OpaquePaintEvent);
  setWindowTitle("Range and speed");
}

void RangeDopplerPanel::setMap(const std::vector<double>& range_m, const std::vector<double>& radial_speed_m_per_s,
                               const std::vector<float>& power_db, const RangeDopplerView& view) {
  view_ = view;
  const auto ranges = static_cast<int>(range_m.size()), speeds = static_cast<int>(radial_speed_m_per_s.size());
  cells_ = QImage(speeds, ranges, QImage::Format_RGB32);
  const LevelColors colors(view.scale);
  for (int r = 0; r < ranges; ++r) {
    auto* out = reinterpret_cast<std::uint32_t*>(cells_.scanLine(ranges - 1 - r));
    const float* levels = power_db.data() + static_cast<std::size_t>(r) * static_cast<std::size_t>(speeds);
    std::transform(levels, levels + speeds, out, [&](float level_db) { return colors.argb(level_db); });
  }
  const double speed_bin = binWidth(radial_speed_m_per_s), range_bin = binWidth(range_m);
  cells_extent_ = {radial_speed_m_per_s.front() - speed_bin / 2, range_m.front() - range_bin / 2, speeds * speed_bin,
                   ranges * range_bin};
  update();
}

void RangeDopplerPanel::setWords(const QString& title, const QString& note) {
  title_ = title;
  note_ = note;
  update();
}

double RangeDopplerPanel::takePainting_s() { return std::exchange(painting_s_, 0); }

void RangeDopplerPanel::drawAxes(QPainter& painter, const QRectF& area) const {
  QColor grid = toQColor(kGrid);
  grid.setAlpha(110);
  const double line = textSize("0").height();
  const double widest_px = textSize(signedText(-0.25)).width() + 10;
  for (double speed :
       ticks(-view_.up_to_m_per_s, view_.up_to_m_per_s, std::max(3, static_cast<int>(area.width() / widest_px)))) {
    const double x = area.center().x() + speed / view_.up_to_m_per_s * area.width() / 2;
    painter.setPen(QPen(speed == 0 ? toQColor(kGrid) : grid, 1));
    painter.drawLine(QPointF(x, area.top()), QPointF(x, area.bottom() + kAboveTicks_px));
    const QString text = signedText(speed);
    drawRimmedText(painter, {x - textSize(text).width() / 2, area.bottom() + line}, text);
  }
  for (double range : ticks(0, view_.up_to_m, std::max(2, static_cast<int>(area.height() / (1.3 * line))))) {
    const double y = area.bottom() - range / view_.up_to_m * area.height();
    painter.setPen(QPen(grid, 1));
    painter.drawLine(QPointF(area.left() - kAboveTicks_px, y), QPointF(area.right(), y));
    const QString text = QString("%1 m").arg(range);
    drawRimmedText(painter, {area.left() - kAboveTicks_px - 2 - textSize(text).width(), y + 0.3 * line}, text);
  }
  const QString words = QString::fromUtf8("← towards    speed, m/s    away →");
  drawRimmedText(painter, {area.center().x() - textSize(words).width() / 2, area.bottom() + 2.1 * line}, words);
}

void RangeDopplerPanel::paintEvent(QPaintEvent*) {
  const double begin_s = threadTime_s();
  QPainter painter(this);
  painter.fillRect(rect(), toQColor(kBackground));
  painter.setPen(toQColor(kLabel));
  painter.setFont(labelFont(true));
  const double words_px = width() - kColorBarWidth_px - 8;
  painter.drawText(QRectF(6, 2, words_px, 18), Qt::AlignLeft | Qt::AlignVCenter, title_);
  painter.setFont(labelFont());
  painter.drawText(QRectF(6, 20, words_px, 18), Qt::AlignLeft | Qt::AlignVCenter, note_);
  const QRectF area(kLeft_px, kTitle_px + kAboveTicks_px, width() - kLeft_px - kRight_px - kColorBarWidth_px,
                    height() - kTitle_px - kAboveTicks_px - kBottom_px);
  if (!cells_.isNull() && area.width() > 10 && area.height() > 10) {
    // Of the picture's pixels, what the view shows; a view beyond the map is clipped by the painter.
    const double left = (-view_.up_to_m_per_s - cells_extent_.x()) / cells_extent_.width() * cells_.width();
    const double wide = 2 * view_.up_to_m_per_s / cells_extent_.width() * cells_.width();
    const double top = (1 - (view_.up_to_m - cells_extent_.y()) / cells_extent_.height()) * cells_.height();
    const double high = view_.up_to_m / cells_extent_.height() * cells_.height();
    painter.drawImage(area, cells_, QRectF(left, top, wide, high));
    drawAxes(painter, area);
    drawColorBar(painter, QRectF(width() - kColorBarWidth_px, 0, kColorBarWidth_px - 4, height() - 4), view_.scale,
                 view_.reference_db, view_.unit);
  }
  painting_s_ += threadTime_s() - begin_s;
}

}  // namespace mmradartwin
