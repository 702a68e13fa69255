#include "mmradartwin_dsp/ros/bag_writer.h"

#include <rosbag/bag.h>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

BagWriter::BagWriter(const std::string& file) : file_(file), bag_(std::make_unique<rosbag::Bag>()) {
  try {
    bag_->open(file, rosbag::bagmode::Write);
  } catch (const rosbag::BagException& error) {
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
    throw std::runtime_error(file_ + ": cannot be written to its end (" + error.what() + "); check the free space");
  }
  bag_.reset();
}

}  // namespace mmradartwin
