#include "mmradartwin_dsp/ros/bag_writer.h"

#include <rosbag/bag.h>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

BagWriter::BagWriter(const std::string& file) : file_(file), bag_(std::make_unique<rosbag::Bag>()) {
  try {
    bag_->open(file, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
    if (bag_->isOpen()) bag_.release();  // its destructor would write the bag's end
    throw InputError(file + ": bag cannot be written (" + error.what() +
                     "); give a file in a folder that can be written");
  }
}

BagWriter::~BagWriter() {
  try {
    if (bag_) bag_->close();
  } catch (const rosbag::BagException&) {
    bag_.release();  // its destructor would try again
  }
}

void BagWriter::close() {
  try {
    bag_->close();
  } catch (const rosbag::BagException& error) {
    bag_.release();
    fail(error);
  }
  bag_.reset();
}

void BagWriter::fail(const std::exception& why) const {
  throw std::runtime_error(file_ + ": cannot be written to its end (" + why.what() + "); check the free space");
}

}  // namespace mmradartwin
