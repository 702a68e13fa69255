#include "layer_list.h"

#include <rviz/display_group.h>

#include <QSignalBlocker>

#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {
namespace {

constexpr const char* kDiffers = "1Places that differ";
constexpr const char* kAgrees = "2Places that agree";
constexpr const char* kPaths = "3Paths by event";
constexpr const char* kAsked = "4The place that was asked for";
constexpr const char* kFindings = "5Findings";
constexpr const char* kMaps = "6Maps on the floor";
constexpr const char* kMaterials = "7Materials";

/// Group, with a digit for its place, and layer of a namespace of markers.
std::pair<QString, QString> layerOf(const QString& display, const QString& ns) {
  if (ns == "matched") return {kAgrees, "both maps are strong"};
  if (ns.size() == 2 && ns[0] == 'C' && ns[1] >= '1' && ns[1] <= '5') {
    return {kDiffers, ns + " " + QString::fromStdString(classLabel(static_cast<ResidualClass>(ns[1].digitValue())))};
  }
  if (ns.startsWith("paths ")) return {kPaths, ns.mid(6)};
  if (display.startsWith("Scene")) return {kMaterials, ns.endsWith(" level") ? ns.left(ns.size() - 6) : ns};
  if (display.startsWith("Finding")) return {kFindings, ns};
  if (display.startsWith("Asked")) return {kAsked, ns};
  return {"8Others", ns};
}

}  // namespace

LayerList::LayerList() {
  setObjectName("layers");
  setHeaderHidden(true);
  setRootIsDecorated(true);
  connect(this, &QTreeWidget::itemChanged, this, [this](QTreeWidgetItem* item, int) { onTicked(item); });
}

void LayerList::follow(rviz::DisplayGroup& displays) {
  Found found;
  QString names;
  for (int i = 0; i < displays.numDisplays(); ++i) {
    rviz::Display* display = displays.getDisplayAt(i);
    if (display->getClassId() == "mmradartwin_attribution/RangeAngle") {
      found[kMaps][display->getName()].push_back(display->subProp("In the scene"));
    } else if (display->getClassId() == "rviz/MarkerArray") {
      rviz::Property* namespaces = display->subProp("Namespaces");
      for (int n = 0; n < namespaces->numChildren(); ++n) {
        rviz::Property* own = namespaces->childAt(n);
        const auto [group, layer] = layerOf(display->getName(), own->getName());
        found[group][layer].push_back(own);
      }
    }
  }
  for (const auto& [group, layers] : found) {
    for (const auto& [layer, switches] : layers) {
      names += group + layer;
      for (const rviz::Property* own : switches) names += QString::number(reinterpret_cast<quintptr>(own), 36);
    }
  }
  if (names != built_of_) build(found);
  built_of_ = names;
  const QSignalBlocker quiet(this);
  for (const auto& [item, switches] : switches_) {
    bool on = false;
    for (const rviz::Property* own : switches) on = on || own->getValue().toBool();
    item->setCheckState(0, on ? Qt::Checked : Qt::Unchecked);
  }
}

void LayerList::build(const Found& found) {
  const QSignalBlocker quiet(this);
  std::map<QString, bool> open;
  for (int i = 0; i < topLevelItemCount(); ++i) open[topLevelItem(i)->text(0)] = topLevelItem(i)->isExpanded();
  clear();
  switches_.clear();
  for (const auto& [group, layers] : found) {
    auto* parent = new QTreeWidgetItem(this, {group.mid(1)});
    parent->setFlags(parent->flags() | Qt::ItemIsAutoTristate | Qt::ItemIsUserCheckable);
    for (const auto& [layer, switches] : layers) {
      auto* item = new QTreeWidgetItem(parent, {layer});
      item->setFlags(item->flags() | Qt::ItemIsUserCheckable);
      item->setCheckState(0, Qt::Checked);
      switches_[item] = switches;
    }
    const auto was = open.find(parent->text(0));
    parent->setExpanded(was == open.end() ? group != kMaterials : was->second);
  }
}

// A group's box reaches its layers as their own changes.
void LayerList::onTicked(QTreeWidgetItem* item) {
  const auto layer = switches_.find(item);
  if (layer == switches_.end()) return;
  for (rviz::Property* own : layer->second) own->setValue(item->checkState(0) == Qt::Checked);
}

}  // namespace mmradartwin
