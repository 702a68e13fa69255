#include "range_angle_display.h"

#include <OGRE/OgreQuaternion.h>
#include <OGRE/OgreSceneNode.h>
#include <OGRE/OgreVector3.h>
#include <geometry_msgs/PointStamped.h>
#include <mmradartwin_msgs/ReceiveGrid.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/properties/tf_frame_property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <pluginlib/class_list_macros.hpp>

#include "fan_visual.h"
#include "map_panel.h"
#include "thread_time.h"

namespace mmradartwin {
namespace {

using StatusProperty = rviz::StatusProperty;

constexpr double kDegree = M_PI / 180;
constexpr double kFront_rad = 60 * kDegree;
constexpr double kAll_rad = M_PI / 2 + 1e-6;
constexpr double kFollowed_db = 30;  ///< the range follows what is so much below the reference
constexpr std::uint8_t kResidualSource = 2;

/// All displays of this window are drawn to one scale of range.
struct CommonRange {
  std::map<const RangeAngleDisplay*, double> needed_m;
  double shown_m = 0;
};
CommonRange& commonRange() {
  static CommonRange range;
  return range;
}

}  // namespace

RangeAngleDisplay::RangeAngleDisplay() { addProperties(); }

RangeAngleDisplay::~RangeAngleDisplay() {
  commonRange().needed_m.erase(this);
  delete panel_;
}

void RangeAngleDisplay::addProperties() {
  using namespace rviz;  // names of properties' classes alone
  const QString map_type = QString::fromStdString(ros::message_traits::datatype<mmradartwin_msgs::RangeAngleMap>());
  const QString residuals_type = QString::fromStdString(ros::message_traits::datatype<mmradartwin_msgs::Residuals>());
  topic_ = new RosTopicProperty("Topic", "", map_type, "Maps to show.", this);
  residuals_topic_ = new RosTopicProperty("Residuals topic", "", residuals_type,
                                          "Boxes and numbers on the map, and the name of the pose; empty: none.", this);
  kind_ = new EnumProperty("Kind", "By message", "Levels, or differences around 0 dB.", this);
  kind_->addOption("By message", 0);
  kind_->addOption("Levels", 1);
  kind_->addOption("Residual", 2);
  colors_ = new EnumProperty("Colours", "Viridis", "Of levels. All three suit colour-blind people.", this);
  colors_->addOption("Viridis", static_cast<int>(ColorMap::kViridis));
  colors_->addOption("Cividis", static_cast<int>(ColorMap::kCividis));
  colors_->addOption("Magma", static_cast<int>(ColorMap::kMagma));
  span_ = new FloatProperty("Dynamic range [dB]", 40, "Colours of levels reach so far below the reference.", this);
  residual_span_ =
      new FloatProperty("Residual range [dB]", 30, "Colours of a residual reach so far to either side of 0 dB.", this);
  reference_ = new EnumProperty("Reference", "Peak of the map", "What is at the upper end of the colours.", this);
  reference_->addOption("Peak of the map", 0);
  reference_->addOption("Fixed level", 1);
  reference_dbfs_ = new FloatProperty("Level [dBFS]", 0, "The fixed level.", reference_, nullptr);
  peak_beyond_ = new FloatProperty("Peak beyond [m]", 0.16F, "Nearer cells do not count for the peak.", reference_);
  range_ = new FloatProperty(
      "Range [m]", 0, "The map is drawn up to here; 0: up to where there is something, for all maps alike.", this);
  front_only_ = new BoolProperty("Within 60 degrees", true, "Nothing is drawn beyond 60 degrees.", this);
  in_scene_ = new BoolProperty("In the scene", false, "Draw the map in the scene, where the radar is.", this);
  alpha_ = new FloatProperty("Alpha", 0.9F, "0: transparent, 1: opaque.", in_scene_);
  flat_ = new BoolProperty("On the floor", true, "Lay the map flat below the radar; else it is in the radar's plane.",
                           in_scene_);
  floor_frame_ = new TfFrameProperty("Floor frame", TfFrameProperty::FIXED_FRAME_STRING, "Frame of the floor, z up.",
                                     in_scene_, nullptr, true);
  height_ =
      new FloatProperty("Height [m]", 0.02F, "Of the map above the floor, or above the radar's plane.", in_scene_);
  grid_ = new BoolProperty("Rings and rays", true, "With their words.", in_scene_);
  color_bar_ = new BoolProperty("Colour bar", false, "Beside the map in the scene; the panel has one, too.", in_scene_);
  fade_ = new BoolProperty("Fade", true, "The weaker a level or difference, the more transparent.", in_scene_);
  for (FloatProperty* positive : {span_, residual_span_}) positive->setMin(1);
  for (FloatProperty* length : {range_, peak_beyond_}) length->setMin(0);
  alpha_->setMin(0);
  alpha_->setMax(1);
  for (RosTopicProperty* topic : {topic_, residuals_topic_}) {
    connect(topic, &Property::changed, this, [this] {
      map_.reset();
      residuals_.reset();
      subscribe();
    });
  }
  for (Property* property : std::initializer_list<Property*>{kind_, colors_, span_, residual_span_, reference_,
                                                             reference_dbfs_, peak_beyond_, range_, front_only_,
                                                             in_scene_, alpha_, grid_, color_bar_, fade_}) {
    connect(property, &Property::changed, this, [this] { due_ = true; });
  }
}

void RangeAngleDisplay::onInitialize() {
  floor_frame_->setFrameManager(context_->getFrameManager());
  panel_ = new MapPanel;
  clicked_ = update_nh_.advertise<geometry_msgs::PointStamped>("clicked_point", 2);
  panel_->setOnClick([this](double range_m, double azimuth_rad) { askAbout(range_m, azimuth_rad); });
  setAssociatedWidget(panel_);
  visual_ = std::make_unique<FanVisual>(*scene_manager_, *scene_node_);
  visual_->setVisible(false);
}

void RangeAngleDisplay::onEnable() { subscribe(); }

void RangeAngleDisplay::onDisable() {
  map_subscriber_.shutdown();
  residuals_subscriber_.shutdown();
  commonRange().needed_m.erase(this);
}

void RangeAngleDisplay::reset() {
  Display::reset();
  told_.clear();
  map_.reset();
  residuals_.reset();
  visual_->setVisible(false);
}

void RangeAngleDisplay::setTopic(const QString& topic, const QString&) { topic_->setString(topic); }

void RangeAngleDisplay::setName(const QString& name) {
  Display::setName(name);
  due_ = true;
}

void RangeAngleDisplay::subscribe() {
  map_subscriber_.shutdown();
  residuals_subscriber_.shutdown();
  if (!isEnabled() || !initialized()) return;
  const auto connected = [this](const rviz::RosTopicProperty* topic, auto subscribed) {
    if (topic->getTopicStd().empty()) return;
    try {
      subscribed(topic->getTopicStd());
      tell(StatusProperty::Ok, topic->getName(), "subscribed");
    } catch (const ros::Exception& error) {
      tell(StatusProperty::Error, topic->getName(), error.what());
    }
  };
  // Of maps that come faster than they are drawn the last one counts.
  connected(topic_, [this](const std::string& name) {
    map_subscriber_ = update_nh_.subscribe(name, 1, &RangeAngleDisplay::onMap, this);
  });
  connected(residuals_topic_, [this](const std::string& name) {
    residuals_subscriber_ = update_nh_.subscribe(name, 1, &RangeAngleDisplay::onResiduals, this);
  });
}

void RangeAngleDisplay::onMap(const mmradartwin_msgs::RangeAngleMap::ConstPtr& msg) {
  const double begin_s = threadTime_s();
  try {
    if (!map_ || !geometry_ || map_->range_m != msg->range_m || map_->azimuth_rad.size() != msg->azimuth_rad.size() ||
        !std::equal(map_->azimuth_rad.begin(), map_->azimuth_rad.end(), msg->azimuth_rad.begin(),
                    [](double a, double b) { return a == b || (std::isnan(a) && std::isnan(b)); })) {
      geometry_ = std::make_shared<FanGeometry>(msg->range_m, msg->azimuth_rad);
    }
    map_ = msg;
    due_ = true;
  } catch (const std::exception& error) {
    map_.reset();
    tell(StatusProperty::Error, "Map", error.what());
  }
  ++spent_maps_;
  tellTime(threadTime_s() - begin_s);
}

void RangeAngleDisplay::onResiduals(const mmradartwin_msgs::Residuals::ConstPtr& msg) {
  residuals_ = msg;
  due_ = true;
}

bool RangeAngleDisplay::isResidual() const {
  const int kind = kind_->getOptionInt();
  return kind == 2 || (kind == 0 && map_ && map_->source == kResidualSource);
}

MapShading RangeAngleDisplay::shading() const {
  MapShading shading;
  shading.residual = isResidual();
  shading.level_map = static_cast<ColorMap>(colors_->getOptionInt());
  shading.level_span_db = span_->getFloat();
  shading.residual_span_db = residual_span_->getFloat();
  if (reference_->getOptionInt() == 1) shading.reference_db = reference_dbfs_->getFloat();
  shading.peak_beyond_m = peak_beyond_->getFloat();
  shading.peak_azimuth_rad = kFront_rad;
  shading.mask_azimuth_rad = front_only_->getBool() ? kFront_rad : kAll_rad;
  return shading;
}

double RangeAngleDisplay::neededRange_m() const {
  return isResidual() ? 0 : farthestOver_m(*geometry_, map_->power_db, shaded_, kFollowed_db);
}

double RangeAngleDisplay::range_m() {
  if (range_->getFloat() > 0) return std::min<double>(range_->getFloat(), geometry_->farthest_m());
  CommonRange& common = commonRange();
  common.needed_m[this] = neededRange_m();
  double needed = 1;
  for (const auto& [display, range] : common.needed_m) needed = std::max(needed, range);
  // It grows at once and shrinks where little of it is needed, so that maps do not flutter.
  if (needed > common.shown_m || needed < 0.6 * common.shown_m) common.shown_m = std::ceil(1.05 * needed);
  return std::min(common.shown_m, geometry_->farthest_m());
}

void RangeAngleDisplay::show() {
  shade(*geometry_, map_->power_db, shading(), shaded_);
  const double azimuth = front_only_->getBool() ? kFront_rad : M_PI / 2;
  panel_->setFan(geometry_, range_m(), azimuth);
  const QString unit = isResidual()                      ? QString::fromUtf8("twin − meas., dB")
                       : reference_->getOptionInt() == 1 ? QString("dBFS")
                                                         : QString("dB of peak");
  panel_->setMap(shaded_, unit);
  showWords();
  showMarks();
  visual_->setSurroundings(grid_->getBool(), color_bar_->getBool(), unit);
  visual_due_ = true;
  if (!in_scene_->getBool()) visual_->setVisible(false);
  context_->queueRender();
}

void RangeAngleDisplay::showWords() {
  if (!panel_) return;
  QString title = getName();
  const bool same = residuals_ && map_ && residuals_->header.frame_id == map_->header.frame_id;
  if (same && !residuals_->pose.empty())
    title += QString::fromUtf8(" · pose ") + QString::fromStdString(residuals_->pose);
  QString note;
  if (map_) {
    note = QString::fromUtf8("%1 at %2 s")
               .arg(QString::fromStdString(map_->header.frame_id))
               .arg(map_->header.stamp.toSec(), 0, 'f', 2);
    if (map_->frames > 1) note += QString::fromUtf8(" · %1 frames").arg(map_->frames);
    if (isResidual()) note = QString::fromUtf8("red: the twin is stronger, blue: the measurement");
  }
  panel_->setWords(title, note);
  panel_->setObjectName("map_of_" + getName());
  if (visual_) visual_->setTitle(getName());
}

// Whoever compares the maps answers what stands there.
void RangeAngleDisplay::askAbout(double range_m, double azimuth_rad) {
  if (!map_) return;
  geometry_msgs::PointStamped point;
  point.header = map_->header;
  point.point.x = range_m * std::cos(azimuth_rad);
  point.point.y = range_m * std::sin(azimuth_rad);
  clicked_.publish(point);
}

void RangeAngleDisplay::showMarks() {
  std::vector<MapMark> marks;
  if (residuals_ && map_) {
    const bool residual = isResidual(), measured = map_->source == mmradartwin_msgs::ReceiveGrid::MEASURED;
    for (const auto& r : residuals_->regions) {
      if (residual || !r.measured_strong || !r.simulated_strong || std::abs(r.azimuth_rad) > kFront_rad) continue;
      marks.push_back({r.range_m, r.azimuth_rad, r.half_range_m, r.half_azimuth_rad, kMatchedBox, 0});
    }
    int number = 0;
    for (const auto& r : residuals_->residuals) {
      ++number;
      if (!residual && r.measured_stronger != measured) continue;
      marks.push_back({r.range_m, r.azimuth_rad, r.half_range_m, r.half_azimuth_rad, kMismatchBox, number});
    }
  }
  if (panel_) panel_->setMarks(std::move(marks));
}

// The fan in the scene follows tf: where the radar was at the map's stamp, or where it is now if tf does not reach
// there.
void RangeAngleDisplay::place() {
  Ogre::Vector3 position;
  Ogre::Quaternion orientation;
  rviz::FrameManager& frames = *context_->getFrameManager();
  const auto& header = map_->header;
  if (!frames.getTransform(header.frame_id, header.stamp, position, orientation) &&
      !frames.getTransform(header.frame_id, ros::Time(), position, orientation)) {
    tell(StatusProperty::Error, "Frame",
         "no transform from " + QString::fromStdString(header.frame_id) + " to " + fixed_frame_);
    visual_->setVisible(false);
    return;
  }
  Ogre::Vector3 up = orientation * Ogre::Vector3::UNIT_Z;
  if (flat_->getBool()) {
    Ogre::Vector3 floor;
    Ogre::Quaternion level;
    if (!frames.getTransform(floor_frame_->getFrameStd(), ros::Time(), floor, level)) {
      tell(StatusProperty::Error, "Frame", "no transform from " + floor_frame_->getFrame() + " to " + fixed_frame_);
      visual_->setVisible(false);
      return;
    }
    up = level * Ogre::Vector3::UNIT_Z;
    Ogre::Vector3 ahead = orientation * Ogre::Vector3::UNIT_X;
    ahead -= up * ahead.dotProduct(up);
    if (ahead.normalise() < 1e-6F) ahead = level * Ogre::Vector3::UNIT_X;  // it looks straight up or down
    orientation.FromAxes(ahead, up.crossProduct(ahead), up);
    position -= up * (position - floor).dotProduct(up);
  }
  tell(StatusProperty::Ok, "Frame", "transforms are there");
  visual_->setPlace(position + up * height_->getFloat(), orientation);
  visual_->setVisible(true);
}

void RangeAngleDisplay::update(float, float) {
  if (!map_ || !panel_) return;
  const double begin_s = threadTime_s();
  if (due_) {
    due_ = false;
    try {
      show();
      tell(StatusProperty::Ok, "Map", "maps come");
    } catch (const std::exception& error) {
      map_.reset();
      tell(StatusProperty::Error, "Map", error.what());
      return;
    }
  }
  panel_->refresh();
  if (in_scene_->getBool()) drawInScene();
  tellTime(threadTime_s() - begin_s);
}

void RangeAngleDisplay::drawInScene() {
  if (visual_due_) {
    const double azimuth = front_only_->getBool() ? kFront_rad : M_PI / 2, range = range_m();
    visual_->setFan(geometry_, range, azimuth);
    if (fade_->getBool()) {
      fade(map_->power_db, shaded_, faded_);
      visual_->setMap(faded_);
    } else {
      visual_->setMap(shaded_);
    }
    visual_->setAlpha(alpha_->getFloat());
    visual_due_ = false;
  }
  place();
  visual_->fitLabelsTo(*context_->getViewManager()->getCurrent()->getCamera());
}

// A status costs a message through Qt's queue: it is set where it has changed.
void RangeAngleDisplay::tell(StatusProperty::Level level, const QString& name, const QString& text) {
  QString& told = told_[name];
  if (told == text) return;
  told = text;
  setStatus(level, name, text);
}

void RangeAngleDisplay::tellTime(double spent_s) {
  constexpr int kMaps = 50;
  spent_s_ += spent_s;
  if (spent_maps_ < kMaps) return;
  if (!panel_) return;
  const double per_map_ms = 1e3 * (spent_s_ + panel_->takePainting_s()) / spent_maps_;
  setStatus(StatusProperty::Ok, "Time",
            QString("%1 ms of the window's thread for each map").arg(per_map_ms, 0, 'f', 2));
  spent_s_ = 0;
  spent_maps_ = 0;
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::RangeAngleDisplay, rviz::Display)
