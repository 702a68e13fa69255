#pragma once

#include <QList>
#include <QString>
#include <QTreeWidget>
#include <map>

namespace rviz {
class DisplayGroup;
class Property;
}  // namespace rviz

namespace mmradartwin {

/// What is drawn in the room, with a box to tick for each part: it switches the namespaces of the window's marker
/// displays, and the maps on the floor.
class LayerList : public QTreeWidget {
 public:
  LayerList();
  /// Takes up what has come, gone or been switched elsewhere.
  void follow(rviz::DisplayGroup& displays);

 private:
  using Found = std::map<QString, std::map<QString, QList<rviz::Property*>>>;  // group, layer
  void build(const Found& found);
  void onTicked(QTreeWidgetItem* item);

  std::map<QTreeWidgetItem*, QList<rviz::Property*>> switches_;
  QString built_of_;
};

}  // namespace mmradartwin
