#include "range_doppler_display.h"

#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/ros_topic_property.h>

#include <algorithm>
#include <cmath>
#include <pluginlib/class_list_macros.hpp>

#include "mmradartwin_dsp/input_error.h"
#include "range_doppler_panel.h"
#include "thread_time.h"

namespace mmradartwin {
namespace {

using StatusProperty = rviz::StatusProperty;

constexpr const char* kNoMap = "No map yet; it takes frames of eight loops or more.";
/// The axis of speeds follows what lies in the upper part of the colours, and is never narrower than this.
constexpr double kFollowedShare = 0.9, kLeastSpeed_m_per_s = 1;

/// Throws InputError where a map cannot be drawn.
void check(const mmradartwin_msgs::RangeDopplerMap& map) {
  const auto ascending = [](const std::vector<double>& centers) {
    return centers.size() > 1 && std::is_sorted(centers.begin(), centers.end()) && centers.front() < centers.back() &&
           std::all_of(centers.begin(), centers.end(), [](double c) { return std::isfinite(c); });
  };
  if (!ascending(map.range_m)) throw InputError("map: range_m is not ascending");
  if (!ascending(map.radial_speed_m_s)) throw InputError("map: radial_speed_m_s is not ascending");
  if (map.power_db.size() != map.range_m.size() * map.radial_speed_m_s.size()) {
    throw InputError("map: power_db is no value per cell");
  }
}

}  // namespace

RangeDopplerDisplay::RangeDopplerDisplay() {
  using namespace rviz;  // names of properties' classes alone
  const QString type = QString::fromStdString(ros::message_traits::datatype<mmradartwin_msgs::RangeDopplerMap>());
  topic_ = new RosTopicProperty("Topic", "", type, "Maps to show.", this);
  colors_ = new EnumProperty("Colours", "Viridis", "Of levels. All three suit colour-blind people.", this);
  colors_->addOption("Viridis", static_cast<int>(ColorMap::kViridis));
  colors_->addOption("Cividis", static_cast<int>(ColorMap::kCividis));
  colors_->addOption("Magma", static_cast<int>(ColorMap::kMagma));
  span_ = new FloatProperty("Dynamic range [dB]", 50, "Colours reach so far below the reference.", this);
  reference_ = new EnumProperty("Reference", "Peak of the map", "What is at the upper end of the colours.", this);
  reference_->addOption("Peak of the map", 0);
  reference_->addOption("Fixed level", 1);
  reference_dbfs_ = new FloatProperty("Level [dBFS]", 0, "The fixed level.", reference_, nullptr);
  range_ = new FloatProperty("Range [m]", 0, "The map is drawn up to here; 0: all of it.", this);
  speed_ = new FloatProperty("Speed [m/s]", 0,
                             "The map is drawn up to here to either side; 0: up to where there is something.", this);
  span_->setMin(1);
  range_->setMin(0);
  speed_->setMin(0);
  connect(topic_, &Property::changed, this, [this] {
    map_.reset();
    subscribe();
  });
  for (Property* property :
       std::initializer_list<Property*>{colors_, span_, reference_, reference_dbfs_, range_, speed_}) {
    connect(property, &Property::changed, this, [this] { due_ = true; });
  }
}

RangeDopplerDisplay::~RangeDopplerDisplay() { delete panel_; }

void RangeDopplerDisplay::onInitialize() {
  panel_ = new RangeDopplerPanel;
  setAssociatedWidget(panel_);
}

void RangeDopplerDisplay::onEnable() { subscribe(); }

void RangeDopplerDisplay::onDisable() { subscriber_.shutdown(); }

void RangeDopplerDisplay::reset() {
  Display::reset();
  map_.reset();
}

void RangeDopplerDisplay::setTopic(const QString& topic, const QString&) { topic_->setString(topic); }

void RangeDopplerDisplay::setName(const QString& name) {
  Display::setName(name);
  due_ = true;
}

void RangeDopplerDisplay::subscribe() {
  subscriber_.shutdown();
  if (!isEnabled() || !initialized() || topic_->getTopicStd().empty()) return;
  try {
    // Of maps that come faster than they are drawn the last one counts.
    subscriber_ = update_nh_.subscribe(topic_->getTopicStd(), 1, &RangeDopplerDisplay::onMap, this);
    setStatus(StatusProperty::Warn, "Map", kNoMap);
    panel_->setWords(getName(), kNoMap);
  } catch (const ros::Exception& error) {
    setStatus(StatusProperty::Error, "Map", error.what());
  }
}

void RangeDopplerDisplay::onMap(const mmradartwin_msgs::RangeDopplerMap::ConstPtr& msg) {
  try {
    check(*msg);
    if (!map_) setStatus(StatusProperty::Ok, "Map", "maps come");
    map_ = msg;
    due_ = true;
    ++spent_maps_;
  } catch (const std::exception& error) {
    map_.reset();
    setStatus(StatusProperty::Error, "Map", error.what());
  }
}

double RangeDopplerDisplay::peak_db() const {
  float peak = -HUGE_VALF;
  for (float level : map_->power_db) {
    if (level > peak && std::isfinite(level)) peak = level;
  }
  return std::isfinite(peak) ? peak : 0;
}

double RangeDopplerDisplay::followedSpeed_m_per_s(double from_db) {
  const std::size_t speeds = map_->radial_speed_m_s.size();
  double needed = kLeastSpeed_m_per_s;
  for (std::size_t i = 0; i < map_->power_db.size(); ++i) {
    if (map_->power_db[i] >= from_db) needed = std::max(needed, std::abs(map_->radial_speed_m_s[i % speeds]));
  }
  // It grows at once and shrinks where little of it is needed, so that maps do not flutter.
  if (needed > shown_m_per_s_ || needed < 0.5 * shown_m_per_s_) shown_m_per_s_ = std::ceil(1.2 * needed);
  return shown_m_per_s_;
}

void RangeDopplerDisplay::show() {
  RangeDopplerView view;
  const bool fixed = reference_->getOptionInt() == 1;
  const double top_db = fixed ? reference_dbfs_->getFloat() : peak_db();
  view.scale = {static_cast<ColorMap>(colors_->getOptionInt()), top_db - span_->getFloat(), top_db};
  view.reference_db = fixed ? 0 : top_db;
  view.unit = fixed ? "dBFS" : "dB of peak";
  const double fastest = std::max(std::abs(map_->radial_speed_m_s.front()), std::abs(map_->radial_speed_m_s.back()));
  view.up_to_m =
      range_->getFloat() > 0 ? std::min<double>(range_->getFloat(), map_->range_m.back()) : map_->range_m.back();
  const double wanted =
      speed_->getFloat() > 0 ? speed_->getFloat() : followedSpeed_m_per_s(top_db - kFollowedShare * span_->getFloat());
  view.up_to_m_per_s = std::min(wanted, fastest);
  panel_->setMap(map_->range_m, map_->radial_speed_m_s, map_->power_db, view);
  panel_->setWords(getName(), QString::fromUtf8("%1 at %2 s · one frame")
                                  .arg(QString::fromStdString(map_->header.frame_id))
                                  .arg(map_->header.stamp.toSec(), 0, 'f', 2));
  panel_->setObjectName("map_of_" + getName());
}

void RangeDopplerDisplay::update(float, float) {
  if (!map_ || !panel_ || !due_) return;
  due_ = false;
  const double begin_s = threadTime_s();
  show();
  constexpr int kMaps = 50;
  spent_s_ += threadTime_s() - begin_s;
  if (spent_maps_ < kMaps) return;
  setStatus(StatusProperty::Ok, "Time",
            QString("%1 ms of the window's thread for each map")
                .arg(1e3 * (spent_s_ + panel_->takePainting_s()) / spent_maps_, 0, 'f', 2));
  spent_s_ = 0;
  spent_maps_ = 0;
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::RangeDopplerDisplay, rviz::Display)
