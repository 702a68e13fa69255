#pragma once

#include <string>

namespace mmradartwin {

/// What is wrong with the index of a bag of version 2.0 that rosbag opens: an entry that leads out of its chunk, or a
/// message that does, or records that do not fill the file. Empty where nothing is. rosbag reads at such a place
/// without a look at the chunk's size. Of compressed chunks entries alone are seen.
std::string whyNoIndex(const std::string& file);

}  // namespace mmradartwin
