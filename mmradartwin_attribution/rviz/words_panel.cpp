#include "words_panel.h"

#include "map_painting.h"

namespace mmradartwin {

WordsPanel::WordsPanel(const QString& title) {
  setWindowTitle(title);
  setFrameShape(QFrame::NoFrame);
  setOpenLinks(false);
  setFont(labelFont());
  QPalette colors = palette();
  colors.setColor(QPalette::Base, toQColor(kBackground));
  colors.setColor(QPalette::Text, toQColor(kLabel));
  setPalette(colors);
}

void WordsPanel::setWords(const QString& html) {
  if (html == words_) return;
  words_ = html;
  setHtml(html);
}

}  // namespace mmradartwin
