#pragma once

#include <QTextBrowser>

namespace mmradartwin {

/// Words and lists in a panel of rviz's window, light on dark.
class WordsPanel : public QTextBrowser {
 public:
  explicit WordsPanel(const QString& title);
  /// HTML; what stands there already is not set again, so that a reader's place in it stays.
  void setWords(const QString& html);
  QSize sizeHint() const override { return {300, 120}; }
  QSize minimumSizeHint() const override { return {120, 60}; }

 private:
  QString words_;
};

}  // namespace mmradartwin
