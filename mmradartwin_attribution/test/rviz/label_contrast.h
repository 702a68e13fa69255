#pragma once

#include <QAbstractButton>
#include <QAbstractItemView>
#include <QComboBox>
#include <QHeaderView>
#include <QImage>
#include <QLabel>
#include <QPixmap>
#include <QProgressBar>
#include <QTabBar>
#include <QTextBlock>
#include <QTextBrowser>
#include <QTextDocument>
#include <QTextFragment>
#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

namespace mmradartwin {

/// Words of a window and how they stand out from what lies under them.
struct LabelContrast {
  QString words;
  double ratio;  ///< contrast ratio of WCAG 2, 1 to 21
};

inline double luminanceOf(QRgb color) {
  const auto linear = [](int part) {
    const double p = part / 255.0;
    return p <= 0.04045 ? p / 12.92 : std::pow((p + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(qRed(color)) + 0.7152 * linear(qGreen(color)) + 0.0722 * linear(qBlue(color));
}

inline double contrastOf(QRgb a, QRgb b) {
  const double x = luminanceOf(a), y = luminanceOf(b);
  return (std::max(x, y) + 0.05) / (std::min(x, y) + 0.05);
}

/// Of a piece of a picture: its most frequent colour against the one that stands out most.
inline double contrastWithin(const QImage& picture, const QRect& piece) {
  std::map<QRgb, int> count;
  const QRect inside = piece.intersected(picture.rect());
  for (int y = inside.top(); y <= inside.bottom(); ++y) {
    for (int x = inside.left(); x <= inside.right(); ++x) ++count[picture.pixel(x, y)];
  }
  if (count.empty()) return 1;
  const auto ground =
      std::max_element(count.begin(), count.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  double best = 1;
  for (const auto& item : count) best = std::max(best, contrastOf(ground->first, item.first));
  return best;
}

/// Of all words that a widget and what is in it show now. Frames of buttons do not count; of the words of a text
/// browser their colours do.
class LabelContrasts {
 public:
  explicit LabelContrasts(QWidget& widget) {
    add(widget);
    for (QWidget* inside : widget.findChildren<QWidget*>()) {
      if (inside->isVisible()) add(*inside);
    }
  }
  const std::vector<LabelContrast>& all() const { return all_; }

 private:
  void add(QWidget& widget) {
    if (const auto* browser = qobject_cast<const QTextBrowser*>(&widget)) return addText(*browser);
    if (auto* header = qobject_cast<QHeaderView*>(&widget)) return addHeader(*header);
    if (auto* view = qobject_cast<QAbstractItemView*>(&widget)) return addItems(*view);
    if (auto* bar = qobject_cast<QTabBar*>(&widget)) return addTabs(*bar);
    constexpr int kFrame_px = 4;
    QRect piece = widget.rect().adjusted(kFrame_px, kFrame_px, -kFrame_px, -kFrame_px);
    QString words;
    if (const auto* label = qobject_cast<const QLabel*>(&widget)) {
      words = label->text();
      piece = widget.rect();
    } else if (const auto* button = qobject_cast<const QAbstractButton*>(&widget)) {
      words = button->text();
    } else if (const auto* box = qobject_cast<const QComboBox*>(&widget)) {
      words = box->currentText();
      piece.setRight(widget.width() * 3 / 4);  // without the arrow
    } else if (const auto* progress = qobject_cast<const QProgressBar*>(&widget)) {
      words = progress->text();
    }
    if (!words.isEmpty()) all_.push_back({words, contrastWithin(widget.grab().toImage(), piece)});
  }

  void addText(const QTextBrowser& browser) {
    const QRgb ground = browser.palette().color(QPalette::Base).rgb();
    for (QTextBlock block = browser.document()->begin(); block.isValid(); block = block.next()) {
      for (auto it = block.begin(); !it.atEnd(); ++it) {
        const QTextCharFormat format = it.fragment().charFormat();
        const QColor color = format.foreground().style() == Qt::NoBrush ? browser.palette().color(QPalette::Text)
                                                                        : format.foreground().color();
        all_.push_back({it.fragment().text(), contrastOf(color.rgb(), ground)});
      }
    }
  }

  void addHeader(QHeaderView& header) {
    const QImage picture = header.viewport()->grab().toImage();
    for (int i = 0; i < header.count(); ++i) {
      const QString words = header.model()->headerData(i, header.orientation()).toString();
      const QRect piece(header.sectionViewportPosition(i) + 3, 3, header.sectionSize(i) - 6, header.height() - 6);
      if (!words.isEmpty() && !header.isSectionHidden(i)) all_.push_back({words, contrastWithin(picture, piece)});
    }
  }

  void addItems(QAbstractItemView& view) {
    if (view.model()) addItems(view, view.rootIndex(), view.viewport()->grab().toImage());
  }
  void addItems(QAbstractItemView& view, const QModelIndex& parent, const QImage& picture) {
    for (int row = 0; row < view.model()->rowCount(parent); ++row) {
      for (int column = 0; column < view.model()->columnCount(parent); ++column) {
        const QModelIndex index = view.model()->index(row, column, parent);
        const QRect piece = view.visualRect(index);
        const QString words = index.data().toString();
        const bool seen = piece.height() > 0 && picture.rect().contains(piece);
        if (seen && !words.isEmpty()) all_.push_back({words, contrastWithin(picture, piece)});
        if (column == 0) addItems(view, index, picture);
      }
    }
  }

  void addTabs(QTabBar& bar) {
    const QImage picture = bar.grab().toImage();
    for (int i = 0; i < bar.count(); ++i) {
      if (!bar.tabText(i).isEmpty()) {
        all_.push_back({bar.tabText(i), contrastWithin(picture, bar.tabRect(i).adjusted(6, 4, -6, -4))});
      }
    }
  }

  std::vector<LabelContrast> all_;
};

}  // namespace mmradartwin
