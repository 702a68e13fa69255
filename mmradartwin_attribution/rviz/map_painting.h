#pragma once

#include <QColor>
#include <QPainter>
#include <QString>

#include "color_scale.h"

namespace mmradartwin {

inline QColor toQColor(Rgb c) { return {c.r, c.g, c.b}; }

constexpr int kLetters_px = 13;  ///< of labels
QFont labelFont(bool bold = false);

/// Letters in a rim of the background's colour, which are legible on every map.
void drawRimmedText(QPainter& painter, QPointF left_baseline, const QString& text, Rgb color = kLabel);
/// Size of a text in the label font.
QSizeF textSize(const QString& text);

constexpr int kColorBarWidth_px = 62;  ///< with its ticks
/// A colour bar with ticks in dB relative to `reference_db` and a line of words above it. `area` is kColorBarWidth_px
/// wide.
void drawColorBar(QPainter& painter, const QRectF& area, const ColorScale& scale, double reference_db,
                  const QString& words);

}  // namespace mmradartwin
