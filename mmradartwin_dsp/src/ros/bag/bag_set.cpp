#include "ros/bag/bag_set.h"

#include <mmradartwin_msgs/AdcCube.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <regex>

#include "mmradartwin_dsp/bag_kind.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "ros/bag/bag_index.h"
#include "ros/message_lengths.h"

namespace mmradartwin {
namespace {

namespace fs = std::filesystem;

/// A name as `rosbag record --split` gives it: lab_2026-11-29-06-00-00_1.bag.
struct PartName {
  std::string before, after;
  int part;
  std::string of(int other) const { return before + std::to_string(other) + after; }
};

std::optional<PartName> partName(const std::string& file) {
  static const std::regex pattern(R"((.*_)(\d{1,6})(\.[^/]*))");
  std::smatch found;
  if (!std::regex_match(file, found, pattern)) return std::nullopt;
  return PartName{found[1], found[3], std::stoi(found[2])};
}

/// Not so a later part of a split recording; what recorders begin anew is a recording of its own.
bool standsAlone(const std::string& file) {
  try {
    const rosbag::Bag bag(file, rosbag::bagmode::Read);
    rosbag::View view(bag);
    const auto connections = view.getConnections();
    return std::any_of(connections.begin(), connections.end(), [](const rosbag::ConnectionInfo* connection) {
      return connection->datatype == "mmradartwin_msgs/RadarConfig";
    });
  } catch (const rosbag::BagException&) {
    return true;  // what cannot be read is no part of anything
  }
}

}  // namespace

InputError damagedBag(const std::string& file, const ros::Exception& error) {
  return InputError(file + ": bag is damaged (" + error.what() + "); record it again, or try rosbag reindex");
}

std::optional<std::string> namespaceOf(const std::string& topic, const std::string& ending) {
  const std::string name = "/" + withoutSlash(topic), end = "/" + ending;
  if (name.size() < end.size() || name.compare(name.size() - end.size(), end.size(), end) != 0) return std::nullopt;
  const std::string ns = name.substr(0, name.size() - end.size());
  return ns.empty() ? "/" : ns;
}

std::string normalNamespace(const std::string& ns) {
  if (ns.empty()) return "";
  std::string name = "/" + withoutSlash(ns);
  while (name.size() > 1 && name.back() == '/') name.pop_back();
  return name;
}

std::string radarFrame(const BagSet& bags, const std::string& cube_topic, const std::string& wanted) {
  if (!wanted.empty()) return wanted;
  const auto cubes = bags.view({cube_topic});
  if (cubes->begin() == cubes->end()) return kRadarFrame;
  const auto cube = instanceOf<mmradartwin_msgs::AdcCube>(*cubes->begin());
  const std::string named = cube ? withoutSlash(cube->header.frame_id) : "";
  if (named.empty() || named == kRadarFrame) return kRadarFrame;
  const auto transforms = bags.view({"/tf", "tf", "/tf_static", "tf_static"});
  for (const rosbag::MessageInstance& message : *transforms) {
    const auto tf = instanceOf<tf2_msgs::TFMessage>(message);
    if (!tf) continue;
    for (const geometry_msgs::TransformStamped& T : tf->transforms) {
      if (withoutSlash(T.child_frame_id) == named || withoutSlash(T.header.frame_id) == named) return named;
    }
  }
  return kRadarFrame;
}

BagSet::BagSet(const std::vector<std::string>& files) : files_(files), label_(files.front()) {
  for (const std::string& file : files) {
    requireRegularFile(file);
    if (!fs::is_regular_file(file)) throw InputError(file + ": no such bag; give a file that exists");
    const auto same = std::find_if(files.begin(), files.end(), [&](const std::string& other) {
      std::error_code ignored;
      return fs::equivalent(file, other, ignored);
    });
    if (&*same != &file) throw InputError(file + ": given twice, also as " + *same + "; give each bag once");
    const std::string other_kind = whyNoBag(file);
    if (!other_kind.empty()) throw InputError(file + ": " + other_kind);
    bags_.push_back(std::make_unique<rosbag::Bag>());
    try {
      bags_.back()->open(file, rosbag::bagmode::Read);
    } catch (const rosbag::BagUnindexedException&) {
      throw InputError(file + ": bag has no index; run `rosbag reindex " + file + "` first");
    } catch (const rosbag::BagException& error) {
      throw InputError(file + ": cannot be read as a bag (" + error.what() + ")");
    }
    const std::string damage = whyNoIndex(file);
    if (!damage.empty()) {
      throw InputError(file + ": bag is damaged (" + damage + "); record it again, or try rosbag reindex");
    }
  }
  if (files.size() > 1) label_ += " and " + std::to_string(files.size() - 1) + " more";
}

std::unique_ptr<rosbag::View> BagSet::view(const std::vector<std::string>& topics, const ros::Time& first,
                                           const ros::Time& last) const {
  auto view = std::make_unique<rosbag::View>();
  for (const auto& bag : bags_) {
    if (topics.empty()) {
      view->addQuery(*bag, first, last);
    } else {
      view->addQuery(*bag, rosbag::TopicQuery(topics), first, last);
    }
  }
  return view;
}

bool BagSet::holds(const std::string& topic) const {
  const auto all = view();
  const auto connections = all->getConnections();
  return std::any_of(connections.begin(), connections.end(),
                     [&](const auto* connection) { return withoutSlash(connection->topic) == withoutSlash(topic); });
}

std::string BagSet::adviceForLatched() const {
  for (const std::string& file : files_) {
    const auto name = partName(file);
    if (!name) continue;
    const std::string first = name->of(0);
    const auto is_first = [&first](const std::string& given) { return given == first; };
    if (std::any_of(files_.begin(), files_.end(), is_first)) return "";
    if (name->part == 0) return "";
    return "; by its name this is part " + std::to_string(name->part) +
           " of a recording, and what is latched (radar/config, session, /tf_static) stands in the first part only: "
           "give the bags together, " +
           (fs::exists(first) ? first : std::string("the first one")) + " too";
  }
  return "; in a later part of a split recording it stands in the first part: give the bags together";
}

std::string BagSet::noteOnNextPart() const {
  for (const std::string& file : files_) {
    const auto name = partName(file);
    if (!name) continue;
    const std::string next = name->of(name->part + 1);
    if (std::find(files_.begin(), files_.end(), next) != files_.end() || !isBag(next) || standsAlone(next)) continue;
    return next + " stands beside " + file + ", is a later part of the same recording and is not read: give both";
  }
  return "";
}

}  // namespace mmradartwin
