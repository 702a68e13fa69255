#include "map_painting.h"

#include <QFontMetricsF>
#include <QPainterPath>

#include "scale_ticks.h"

namespace mmradartwin {

QFont labelFont(bool bold) {
  QFont font("DejaVu Sans");
  font.setPixelSize(kLetters_px);
  font.setBold(bold);
  return font;
}

void drawRimmedText(QPainter& painter, QPointF left_baseline, const QString& text, Rgb color) {
  constexpr double kRim_px = 4;
  QPainterPath letters;
  letters.addText(left_baseline, labelFont(true), text);
  painter.save();
  painter.setRenderHint(QPainter::Antialiasing);
  painter.strokePath(letters, QPen(toQColor(kBackground), kRim_px, Qt::SolidLine, Qt::RoundCap, Qt::RoundJoin));
  painter.fillPath(letters, toQColor(color));
  painter.restore();
}

QSizeF textSize(const QString& text) {
  const QFontMetricsF metrics(labelFont(true));
  return {metrics.horizontalAdvance(text), metrics.ascent() + metrics.descent()};
}

void drawColorBar(QPainter& painter, const QRectF& area, const ColorScale& scale, double reference_db,
                  const QString& words) {
  constexpr double kBar_px = 14, kTick_px = 4;
  const double line = textSize("0").height();
  const double ascent = QFontMetricsF(labelFont()).ascent();
  const QRectF bar(area.left(), area.top() + 1.6 * line, kBar_px, area.height() - 2.2 * line);
  for (int y = 0; y < static_cast<int>(bar.height()); ++y) {
    const double share = 1 - (y + 0.5) / bar.height();
    const Rgb color = scale.color(scale.low_db + share * (scale.high_db - scale.low_db));
    painter.fillRect(QRectF(bar.left(), bar.top() + y, bar.width(), 1), toQColor(color));
  }
  painter.setPen(toQColor(kGrid));
  painter.drawRect(bar);
  painter.setFont(labelFont());
  for (double tick : ticks(scale.low_db - reference_db, scale.high_db - reference_db, 7)) {
    const double share = (tick + reference_db - scale.low_db) / (scale.high_db - scale.low_db);
    const double y = bar.bottom() - share * bar.height();
    painter.setPen(toQColor(kLabel));
    painter.drawLine(QPointF(bar.right(), y), QPointF(bar.right() + kTick_px, y));
    painter.drawText(QPointF(bar.right() + kTick_px + 3, y + ascent / 2 - 1),
                     QString::number(tick).replace('-', QChar(0x2212)));
  }
  const QFontMetricsF metrics(labelFont());
  painter.drawText(QPointF(area.right() - metrics.horizontalAdvance(words), area.top() + ascent), words);
}

}  // namespace mmradartwin
