#include <gtest/gtest.h>

#include <iterator>
#include <sstream>

#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_attribution/ros/conversions.h"

namespace mmradartwin {
namespace {

// Read as ROS prints it, so that fields are found by their names.
TEST(LedgerMessage, HoldsEachMetricUnderItsName) {
  LedgerSummary summary;
  for (std::size_t i = 0; i < std::size(kResidualMetrics); ++i) {
    summary.*kResidualMetrics[i].member = static_cast<double>(i) + 1.25;
  }
  std::ostringstream printed;
  printed << "\n" << toMsg(summary, {});
  for (std::size_t i = 0; i < std::size(kResidualMetrics); ++i) {
    std::ostringstream line;
    line << "\n" << kResidualMetrics[i].name << ": " << static_cast<double>(i) + 1.25 << "\n";
    EXPECT_NE(printed.str().find(line.str()), std::string::npos) << line.str() << "in" << printed.str();
  }
}

}  // namespace
}  // namespace mmradartwin
