#include "map_panel.h"

#include <QMouseEvent>
#include <QPainter>
#include <QPainterPath>
#include <algorithm>
#include <cmath>
#include <utility>

#include "label_layout.h"
#include "map_painting.h"
#include "scale_ticks.h"
#include "thread_time.h"

namespace mmradartwin {
namespace {

constexpr double kDegree = M_PI / 180;
constexpr double kMargin_px = 22, kSideMargin_px = 36;  // for labels around the fan
constexpr double kTitle_px = 38;                        // two lines above it

}  // namespace

MapPanel::MapPanel() {
  setAttribute(Qt::WA_OpaquePaintEvent);
  setWindowTitle("Map");
}

void MapPanel::setFan(std::shared_ptr<const FanGeometry> geometry, double up_to_m, double up_to_rad) {
  if (geometry == geometry_ && up_to_m == up_to_m_ && up_to_rad == up_to_rad_) return;
  geometry_ = std::move(geometry);
  up_to_m_ = up_to_m;
  up_to_rad_ = std::min(up_to_rad, M_PI / 2);
  cells_due_ = true;
  paint_due_ = true;
}

void MapPanel::setMap(const ShadedMap& map, const QString& unit) {
  const auto below = [](const ShadedMap& m) {  // in thousandths
    return std::make_pair(std::lround(1e3 * (m.scale.low_db - m.reference_db)),
                          std::lround(1e3 * (m.scale.high_db - m.reference_db)));
  };
  decoration_due_ = decoration_due_ || unit != unit_ || map.scale.map != map_.scale.map || below(map) != below(map_);
  map_ = map;
  unit_ = unit;
  image_due_ = true;
  paint_due_ = true;
}

void MapPanel::setWords(const QString& title, const QString& note) {
  title_ = title;
  note_ = note;
  paint_due_ = true;
}

// What moves by less than half a pixel, as the noise of a map makes it, stays as it is drawn.
void MapPanel::setMarks(std::vector<MapMark> marks) {
  const auto alike = [this](const MapMark& a, const MapMark& b) {
    const QPointF away = at(a.range_m, a.azimuth_rad) - at(b.range_m, b.azimuth_rad);
    return a.number == b.number && a.color.g == b.color.g && a.half_range_m == b.half_range_m &&
           std::hypot(away.x(), away.y()) < 0.5;
  };
  if (std::equal(marks.begin(), marks.end(), marks_.begin(), marks_.end(), alike)) return;
  marks_ = std::move(marks);
  over_due_ = paint_due_ = true;
}

void MapPanel::setOnClick(std::function<void(double range_m, double azimuth_rad)> on_click) {
  on_click_ = std::move(on_click);
  setCursor(Qt::PointingHandCursor);
  setToolTip("click: what stands behind this place?");
}

void MapPanel::mousePressEvent(QMouseEvent* event) {
  const QPointF away = apex_px_ - event->localPos();
  const double range_m = scale_px_ > 0 ? std::hypot(away.x(), away.y()) / scale_px_ : 0;
  const double azimuth_rad = std::atan2(away.x(), away.y());
  if (event->button() != Qt::LeftButton || !on_click_ || !geometry_ || range_m > up_to_m_ ||
      std::abs(azimuth_rad) > up_to_rad_) {
    return event->ignore();
  }
  on_click_(range_m, azimuth_rad);
}

double MapPanel::takePainting_s() { return std::exchange(painting_s_, 0); }

QPointF MapPanel::at(double range_m, double azimuth_rad) const {
  return apex_px_ + scale_px_ * range_m * QPointF(-std::sin(azimuth_rad), -std::cos(azimuth_rad));
}

void MapPanel::lookUpCells() {
  const double room_w = width() - kColorBarWidth_px - 2 * kSideMargin_px;
  const double room_h = height() - kTitle_px - 2 * kMargin_px;
  const double half = up_to_m_ * std::sin(up_to_rad_);
  scale_px_ = std::max(1e-3, std::min(room_w / (2 * half), room_h / up_to_m_));
  apex_px_ = {kSideMargin_px + room_w / 2, height() - kMargin_px};
  const int left = static_cast<int>(std::floor(apex_px_.x() - half * scale_px_));
  const int top = static_cast<int>(std::floor(apex_px_.y() - up_to_m_ * scale_px_));
  const int w = std::max(1, static_cast<int>(2 * half * scale_px_) + 2);
  const int h = std::max(1, static_cast<int>(up_to_m_ * scale_px_) + 2);
  image_at_ = {left, top};
  image_ = QImage(w, h, QImage::Format_RGB32);
  cell_of_pixel_.assign(static_cast<std::size_t>(w) * h, -1);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const FanPoint place{(apex_px_.y() - (top + y + 0.5)) / scale_px_, (apex_px_.x() - (left + x + 0.5)) / scale_px_};
      if (std::hypot(place.x_m, place.y_m) > up_to_m_ || std::abs(std::atan2(place.y_m, place.x_m)) > up_to_rad_)
        continue;
      cell_of_pixel_[static_cast<std::size_t>(y) * w + x] = geometry_->cellAt(place);
    }
  }
  cells_due_ = false;
  image_due_ = decoration_due_ = true;
}

void MapPanel::drawDecoration() {
  decoration_ = QPixmap(size());
  decoration_.fill(Qt::transparent);
  QPainter painter(&decoration_);
  painter.setRenderHint(QPainter::Antialiasing);
  QColor grid = toQColor(kGrid);
  grid.setAlpha(150);
  painter.setPen(QPen(grid, 1));
  const std::vector<double> rings = ticks(0, up_to_m_, 7);
  for (double range : rings) {
    if (range == 0) continue;
    QPainterPath arc(at(range, up_to_rad_));
    for (int i = 1; i <= 60; ++i) arc.lineTo(at(range, up_to_rad_ * (1 - i / 30.0)));
    painter.drawPath(arc);
  }
  const int last_deg = static_cast<int>(up_to_rad_ / kDegree + 0.5);
  for (int deg = -90; deg <= 90; deg += 15) {
    if (std::abs(deg) <= last_deg)
      painter.drawLine(at(rings.size() > 1 ? rings[1] / 2 : 0, deg * kDegree), at(up_to_m_, deg * kDegree));
  }
  std::vector<LabelBox> taken;
  const auto label = [&](QPointF middle, const QString& text) {
    const QSizeF size = textSize(text);
    const LabelBox box{middle.x() - size.width() / 2, middle.y() - size.height() / 2, size.width(), size.height()};
    for (const LabelBox& other : taken) {
      if (box.overlaps(other)) return;
    }
    taken.push_back(box);
    drawRimmedText(painter, {box.x, box.y + 0.8 * size.height()}, text);
  };
  for (int deg = -60; deg <= 60; deg += 30) {
    if (std::abs(deg) <= last_deg) {
      const double further_m = 13 / scale_px_;
      label(at(up_to_m_ + further_m, deg * kDegree), QString::fromUtf8("%1°").arg(deg).replace('-', QChar(0x2212)));
    }
  }
  for (double range : rings) {
    if (range == 0) continue;
    const QString text = QString("%1 m").arg(range);
    // Outside of the fan's right edge.
    const double away = 4 + (up_to_rad_ < 1.5 ? textSize(text).width() / 2 : textSize(text).height() / 2);
    const QPointF outwards(std::cos(up_to_rad_), std::sin(up_to_rad_));
    label(at(range, -up_to_rad_) + away * outwards, text);
  }
  drawColorBar(painter, QRectF(width() - kColorBarWidth_px, 0, kColorBarWidth_px - 4, height() - 4), map_.scale,
               map_.reference_db, unit_);
  decoration_due_ = false;
  over_due_ = true;
}

void MapPanel::drawMarks(QPainter& painter) const {
  painter.setRenderHint(QPainter::Antialiasing);
  std::vector<LabelWish> wishes;
  std::vector<const MapMark*> numbered;
  for (const MapMark& mark : marks_) {
    if (mark.range_m - mark.half_range_m > up_to_m_) continue;
    const double near_m = std::max(0.0, mark.range_m - mark.half_range_m), far_m = mark.range_m + mark.half_range_m;
    QPainterPath box;
    constexpr int kSteps = 3;
    for (int i = 0; i <= 2 * kSteps + 1; ++i) {
      const bool far = i <= kSteps;
      const double share = (far ? i : 2 * kSteps + 1 - i) / static_cast<double>(kSteps);
      const QPointF p = at(far ? far_m : near_m, mark.azimuth_rad + (2 * share - 1) * mark.half_azimuth_rad);
      i == 0 ? box.moveTo(p) : box.lineTo(p);
    }
    box.closeSubpath();
    painter.setBrush(Qt::NoBrush);
    painter.strokePath(box, QPen(toQColor(kBoxRim), 4.5, Qt::SolidLine, Qt::FlatCap, Qt::BevelJoin));
    painter.strokePath(box, QPen(toQColor(mark.color), 1.8, Qt::SolidLine, Qt::FlatCap, Qt::BevelJoin));
    if (mark.number == 0) continue;
    const QPointF top = at(far_m, mark.azimuth_rad);
    const QSizeF size = textSize(QString::number(mark.number));
    wishes.push_back({top.x(), top.y(), size.width() + 6, size.height()});
    numbered.push_back(&mark);
  }
  const LabelBox bounds{0, kTitle_px, static_cast<double>(width() - kColorBarWidth_px), height() - kTitle_px};
  const std::vector<LabelBox> boxes = placeLabels(wishes, bounds, 2);
  painter.setFont(labelFont(true));
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    if (boxes[i].width == 0) continue;
    const QRectF chip(boxes[i].x, boxes[i].y, boxes[i].width, boxes[i].height);
    painter.setPen(QPen(toQColor(numbered[i]->color), 1));
    painter.drawLine(chip.center(), at(numbered[i]->range_m + numbered[i]->half_range_m, numbered[i]->azimuth_rad));
    painter.setBrush(toQColor(kBoxRim));
    painter.drawRoundedRect(chip, 3, 3);
    painter.drawText(chip, Qt::AlignCenter, QString::number(numbered[i]->number));
  }
}

void MapPanel::refresh() {
  if (std::exchange(paint_due_, false)) update();
}

void MapPanel::paintEvent(QPaintEvent*) {
  const double begin_s = threadTime_s();
  QPainter painter(this);
  painter.fillRect(rect(), toQColor(kBackground));
  painter.setPen(toQColor(kLabel));
  painter.setFont(labelFont(true));
  const double words_px = width() - kColorBarWidth_px - 8;
  painter.drawText(QRectF(6, 2, words_px, 18), Qt::AlignLeft | Qt::AlignVCenter, title_);
  painter.setFont(labelFont());
  painter.drawText(QRectF(6, 20, words_px, 18), Qt::AlignLeft | Qt::AlignVCenter, note_);
  if (geometry_ && !map_.argb.empty()) {
    const bool resized = decoration_.size() != size();
    if (cells_due_ || resized) lookUpCells();
    if (image_due_) {
      const std::uint32_t background = toQColor(kBackground).rgb();
      const auto w = static_cast<std::size_t>(image_.width());
      for (int y = 0; y < image_.height(); ++y) {
        auto* out = reinterpret_cast<std::uint32_t*>(image_.scanLine(y));
        const std::int32_t* cells = cell_of_pixel_.data() + static_cast<std::size_t>(y) * w;
        for (std::size_t x = 0; x < w; ++x) {
          const std::uint32_t color = cells[x] < 0 ? 0 : map_.argb[static_cast<std::size_t>(cells[x])];
          out[x] = color ? color : background;
        }
      }
      image_due_ = false;
    }
    if (decoration_due_) drawDecoration();
    if (over_due_) {
      over_ = decoration_.copy();
      QPainter over(&over_);
      drawMarks(over);
      over_due_ = false;
    }
    painter.drawImage(image_at_, image_);
    painter.drawPixmap(0, 0, over_);
  }
  painting_s_ += threadTime_s() - begin_s;
}

}  // namespace mmradartwin
