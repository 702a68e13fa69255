#pragma once

#include <ros/exception.h>
#include <rosbag/bag.h>
#include <rosbag/view.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

/// What to say of a bag whose bytes rosbag or a message's reader could make nothing of.
InputError damagedBag(const std::string& file, const ros::Exception& error);

/// Bags that are read as one, by the time at which messages were recorded: the parts of a split recording, or what two
/// computers recorded.
class BagSet {
 public:
  /// Throws InputError for a file that is none, that is no bag or has no index, or that is given twice.
  explicit BagSet(const std::vector<std::string>& files);

  /// For errors: the first file, and how many more.
  const std::string& label() const { return label_; }
  /// Messages of some topics, or of all.
  std::unique_ptr<rosbag::View> view(const std::vector<std::string>& topics = {},
                                     const ros::Time& first = ros::TIME_MIN,
                                     const ros::Time& last = ros::TIME_MAX) const;
  bool holds(const std::string& topic) const;
  /// What to add to an error about messages that are missing and that are latched: a split recording holds them in its
  /// first part only. "" where the first part is there.
  std::string adviceForLatched() const;
  /// What stands beside the bags and belongs to them: the part that follows. "" where nothing does.
  std::string noteOnNextPart() const;

 private:
  std::vector<std::string> files_;
  std::vector<std::unique_ptr<rosbag::Bag>> bags_;
  std::string label_;
};

/// The namespace of a topic whose name ends in `ending`, as --radar takes it: "/" or "/robot1". Nothing where it ends
/// otherwise.
std::optional<std::string> namespaceOf(const std::string& topic, const std::string& ending);
/// A namespace as a user writes it, "robot1/", as namespaceOf() returns it; "" stays.
std::string normalNamespace(const std::string& ns);
/// tf frame of the radar: the one that is `wanted`; without that the one that the frames on a topic name, where tf
/// knows it, else radar_link.
std::string radarFrame(const BagSet& bags, const std::string& cube_topic, const std::string& wanted);

}  // namespace mmradartwin
