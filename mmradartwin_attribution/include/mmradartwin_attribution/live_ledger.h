#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "mmradartwin_attribution/ledger.h"

namespace mmradartwin {

/// A ledger over a live stream. A pose is a stretch of at least 1 s in which the radar stands: within 2 cm and 1 deg of
/// where the stretch began. Of each stretch one average counts, the last of those over most frames. A later stretch
/// within 10 cm horizontally, 2 cm in height and 1 deg in heading of an earlier one is a duplicate: left out and
/// listed.
class LiveLedger {
 public:
  void add(std::int64_t stamp_ns, const Eigen::Isometry3d& T_map_radar, const std::string& name, int frames,
           const FieldMetrics& central);
  /// Over the finished stretches and the one that goes on.
  LedgerSummary summary() const;
  /// Names of excluded duplicates, the last 100 finished ones and the one that goes on.
  std::vector<std::string> duplicates() const;

 private:
  struct Stretch {
    std::int64_t begin_ns = 0, end_ns = 0;
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    std::string name;
    int frames = 0;
    FieldMetrics metrics;
  };
  bool counts(const Stretch& stretch) const;
  bool duplicate(const Stretch& stretch) const;

  std::vector<Stretch> finished_;
  std::deque<std::string> duplicates_;
  std::vector<Stretch> current_;  // none or one
};

}  // namespace mmradartwin
