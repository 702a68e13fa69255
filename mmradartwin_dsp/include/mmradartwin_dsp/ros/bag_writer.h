#pragma once

#include <exception>
#include <memory>
#include <string>

namespace rosbag {
class Bag;
}

namespace mmradartwin {

/// A bag that is written. rosbag's own destructor writes the bag's end, and ends the program where the disk is full.
class BagWriter {
 public:
  /// Throws InputError where the file cannot be made.
  explicit BagWriter(const std::string& file);
  ~BagWriter();
  BagWriter(const BagWriter&) = delete;
  BagWriter& operator=(const BagWriter&) = delete;

  rosbag::Bag& bag() { return *bag_; }
  /// Throws std::runtime_error, which names the file, where the bag's end cannot be written.
  void close();
  /// Throws std::runtime_error, which names the file: for what the bag throws while it is written.
  [[noreturn]] void fail(const std::exception& why) const;

 private:
  std::string file_;
  std::unique_ptr<rosbag::Bag> bag_;
};

}  // namespace mmradartwin
