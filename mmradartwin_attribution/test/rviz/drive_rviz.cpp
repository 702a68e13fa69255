// rviz's window with a layout, driven as a person does: each line of standard input is an order, and each answer a line
// of standard output, "ok" or "error" with what was found.
//
//   click NAME [X Y]   mouse click on a widget, at shares of its width and height (default: its middle)
//   shift NAME X Y     the same with Shift
//   tab NAME TITLE     click on a tab
//   row NAME TEXT      click on the line of a tree, list or table that says so
//   key NAME KEYS      Home, Down, Space, Return, or letters to type
//   text NAME          what stands in the widget; "grey: REASON" where it is disabled
//   tool NAME          click on a tool of the tool bar
//   link NAME N        click on the N-th link of a text
//   grab NAME FILE     write what the widget shows into a PNG
//   contrast NAME      "N labels, the faintest R: WORDS" of the widget and all in it
//   close NAME         close a window
//   quit
//
// NAME is a widget's objectName; "render" is the 3-D view.

#include <ros/ros.h>
#include <rviz/render_panel.h>
#include <rviz/visualization_frame.h>

#include <QAbstractButton>
#include <QAbstractItemView>
#include <QAbstractSpinBox>
#include <QApplication>
#include <QComboBox>
#include <QLabel>
#include <QLineEdit>
#include <QProgressBar>
#include <QTabBar>
#include <QTextBrowser>
#include <QToolBar>
#include <QToolButton>
#include <QtTest/QTest>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>

#include "label_contrast.h"

namespace {

QWidget* find(const QString& name) {
  QWidget* hidden = nullptr;
  for (QWidget* widget : QApplication::allWidgets()) {
    if (name == "render" ? qobject_cast<rviz::RenderPanel*>(widget) == nullptr : widget->objectName() != name) continue;
    if (widget->isVisible()) return widget;
    hidden = widget;
  }
  if (!hidden) throw std::runtime_error("no widget " + name.toStdString());
  return hidden;
}

QWidget* visible(const QString& name) {
  QWidget* widget = find(name);
  if (!widget->isVisible()) throw std::runtime_error(name.toStdString() + " is hidden");
  return widget;
}

QString textOf(const QString& name) {
  const QWidget* widget = find(name);
  if (!widget->isEnabled()) return "grey: " + widget->toolTip();
  if (const auto* label = qobject_cast<const QLabel*>(widget)) return label->text();
  if (const auto* button = qobject_cast<const QAbstractButton*>(widget)) return button->text();
  if (const auto* browser = qobject_cast<const QTextBrowser*>(widget)) return browser->toPlainText();
  if (const auto* box = qobject_cast<const QComboBox*>(widget)) return box->currentText();
  if (const auto* edit = qobject_cast<const QLineEdit*>(widget)) return edit->text();
  if (const auto* bar = qobject_cast<const QProgressBar*>(widget)) return bar->isVisible() ? bar->text() : "";
  throw std::runtime_error(name.toStdString() + " has no text");
}

void clickAt(QWidget* widget, double x, double y, Qt::KeyboardModifiers modifiers = Qt::NoModifier) {
  const QPoint place(static_cast<int>(x * widget->width()), static_cast<int>(y * widget->height()));
  QTest::mouseMove(widget, place);
  QTest::mouseClick(widget, Qt::LeftButton, modifiers, place);
}

void clickTab(const QString& name, const QString& title) {
  for (QTabBar* bar : visible(name)->findChildren<QTabBar*>()) {
    for (int i = 0; i < bar->count(); ++i) {
      if (bar->tabText(i).remove('&') == title) {
        QTest::mouseClick(bar, Qt::LeftButton, Qt::NoModifier, bar->tabRect(i).center());
        return;
      }
    }
  }
  throw std::runtime_error("no tab " + title.toStdString());
}

void clickRow(const QString& name, const QString& text) {
  auto* view = qobject_cast<QAbstractItemView*>(visible(name));
  if (!view) throw std::runtime_error(name.toStdString() + " has no lines");
  const QModelIndexList found =
      view->model()->match(view->model()->index(0, 0), Qt::DisplayRole, text, 1, Qt::MatchExactly | Qt::MatchRecursive);
  if (found.isEmpty()) throw std::runtime_error("no line " + text.toStdString());
  view->scrollTo(found.front());
  QTest::mouseClick(view->viewport(), Qt::LeftButton, Qt::NoModifier, view->visualRect(found.front()).center());
}

void press(const QString& name, const QString& keys) {
  QWidget* widget = visible(name);
  widget->setFocus();
  if (keys == "Home") {
    QTest::keyClick(widget, Qt::Key_Home);
  } else if (keys == "Down") {
    QTest::keyClick(widget, Qt::Key_Down);
  } else if (keys == "Space") {
    QTest::keyClick(widget, Qt::Key_Space);
  } else if (keys == "Return") {
    QTest::keyClick(widget, Qt::Key_Return);
  } else {
    if (auto* line = qobject_cast<QLineEdit*>(widget)) line->selectAll();
    if (auto* number = qobject_cast<QAbstractSpinBox*>(widget)) number->selectAll();
    QTest::keyClicks(widget, keys);
  }
}

void clickTool(const QString& name) {
  for (QToolButton* button : QApplication::activeWindow() ? QApplication::activeWindow()->findChildren<QToolButton*>()
                                                          : QList<QToolButton*>()) {
    if (button->text() == name && button->isVisible()) return QTest::mouseClick(button, Qt::LeftButton);
  }
  for (QWidget* widget : QApplication::allWidgets()) {
    auto* button = qobject_cast<QToolButton*>(widget);
    if (button && button->text() == name) return QTest::mouseClick(button, Qt::LeftButton);
  }
  throw std::runtime_error("no tool " + name.toStdString());
}

void clickLink(const QString& name, int number) {
  auto* browser = qobject_cast<QTextBrowser*>(visible(name));
  int seen = 0;
  QString last;
  for (int y = 2; y < browser->viewport()->height(); y += 3) {
    for (int x = 2; x < browser->viewport()->width(); x += 3) {
      const QString anchor = browser->anchorAt({x, y});
      if (anchor.isEmpty() || anchor == last) continue;
      last = anchor;
      if (++seen < number) continue;
      QTest::mouseClick(browser->viewport(), Qt::LeftButton, Qt::NoModifier, {x, y});
      return;
    }
  }
  throw std::runtime_error("no link " + std::to_string(number));
}

QString faintestLabel(const QString& name) {
  const mmradartwin::LabelContrasts labels(*visible(name));
  const auto& all = labels.all();
  if (all.empty()) throw std::runtime_error(name.toStdString() + " has no words");
  const auto faintest =
      std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.ratio < b.ratio; });
  return QString("%1 labels, the faintest %2: %3").arg(all.size()).arg(faintest->ratio, 0, 'f', 2).arg(faintest->words);
}

QString obey(const QString& line) {
  const QString order = line.section(' ', 0, 0), name = line.section(' ', 1, 1), rest = line.section(' ', 2);
  if (order == "click" || order == "shift") {
    QWidget* widget = visible(name);
    if (!widget->isEnabled())
      throw std::runtime_error(name.toStdString() + " is grey: " + widget->toolTip().toStdString());
    const bool middle = rest.isEmpty();
    clickAt(widget, middle ? 0.5 : rest.section(' ', 0, 0).toDouble(),
            middle ? 0.5 : rest.section(' ', 1, 1).toDouble(), order == "shift" ? Qt::ShiftModifier : Qt::NoModifier);
  } else if (order == "tab") {
    clickTab(name, rest);
  } else if (order == "row") {
    clickRow(name, rest);
  } else if (order == "key") {
    press(name, rest);
  } else if (order == "text") {
    return textOf(name).replace('\n', ' ').replace(QChar(0xa0), ' ');
  } else if (order == "tool") {
    clickTool(line.section(' ', 1));
  } else if (order == "link") {
    clickLink(name, rest.toInt());
  } else if (order == "grab") {
    if (!visible(name)->grab().save(rest)) throw std::runtime_error(rest.toStdString() + " cannot be written");
  } else if (order == "contrast") {
    return faintestLabel(name).replace('\n', ' ');
  } else if (order == "close") {
    visible(name)->close();
  } else if (order == "quit") {
    QApplication::quit();
  } else {
    throw std::runtime_error("no order " + order.toStdString());
  }
  return "";
}

void answer(const QString& line) {
  try {
    std::cout << "ok " << obey(line).toStdString() << std::endl;
  } catch (const std::exception& error) {
    std::cout << "error " << error.what() << std::endl;
  }
}

}  // namespace

int main(int argc, char** argv) {
  QApplication application(argc, argv);
  ros::init(argc, argv, "rviz", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  if (argc < 2) {
    std::cerr << "usage: drive_rviz LAYOUT\n";
    return 2;
  }
  rviz::VisualizationFrame window;
  window.setApp(&application);
  window.setSplashPath("");
  window.initialize(argv[1]);
  window.show();
  std::cout << "ok window" << std::endl;
  std::thread([&application] {
    for (std::string line; std::getline(std::cin, line);) {
      const QString order = QString::fromStdString(line);
      QMetaObject::invokeMethod(
          &application, [order] { answer(order); }, Qt::QueuedConnection);
    }
    QMetaObject::invokeMethod(
        &application, [] { QApplication::quit(); }, Qt::QueuedConnection);
  }).detach();
  return QApplication::exec();
}
