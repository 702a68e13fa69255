#pragma once

#include <filesystem>
#include <string>

namespace mmradartwin {

/// Folder below which nodes leave results behind that nobody named a place for: mmradartwin in ROS's home.
std::filesystem::path leftBehindFolder();
/// `what` with the time of day in UTC, to the second: diagnosis_20261130_125300.
std::string nameWithTime(const std::string& what);

}  // namespace mmradartwin
