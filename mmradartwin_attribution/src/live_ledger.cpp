#include "mmradartwin_attribution/live_ledger.h"

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/session.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin {
namespace {
constexpr std::size_t kNamedDuplicates = 100;
}  // namespace

bool LiveLedger::counts(const Stretch& stretch) const { return stretch.end_ns - stretch.begin_ns >= 1000000000; }

bool LiveLedger::duplicate(const Stretch& stretch) const {
  return std::any_of(finished_.begin(), finished_.end(),
                     [&](const Stretch& earlier) { return sameView(earlier.T, stretch.T); });
}

void LiveLedger::add(std::int64_t stamp_ns, const Eigen::Isometry3d& T_map_radar, const std::string& name, int frames,
                     const FieldMetrics& central) {
  if (!current_.empty()) {
    const Stretch& c = current_.front();
    const bool stands = (T_map_radar.translation() - c.T.translation()).norm() <= 0.02 &&
                        Eigen::AngleAxisd(c.T.linear().transpose() * T_map_radar.linear()).angle() <= kDegree &&
                        stamp_ns >= c.begin_ns;
    if (!stands) {
      if (counts(c)) {
        if (duplicate(c)) {
          if (duplicates_.size() == kNamedDuplicates) duplicates_.pop_front();
          duplicates_.push_back(c.name);
        } else {
          finished_.push_back(c);
        }
      }
      current_.clear();
    }
  }
  if (current_.empty()) {
    current_.resize(1);
    current_.front().begin_ns = stamp_ns;
    current_.front().T = T_map_radar;
  }
  Stretch& c = current_.front();
  c.end_ns = stamp_ns;
  if (frames >= c.frames) {
    c.frames = frames;
    c.metrics = central;
    c.name = name;
  }
}

LedgerSummary LiveLedger::summary() const {
  Ledger ledger;
  for (const Stretch& s : finished_) ledger.add(s.metrics);
  if (!current_.empty() && counts(current_.front()) && !duplicate(current_.front())) {
    ledger.add(current_.front().metrics);
  }
  return ledger.summary();
}

std::vector<std::string> LiveLedger::duplicates() const {
  std::vector<std::string> names(duplicates_.begin(), duplicates_.end());
  if (!current_.empty() && counts(current_.front()) && duplicate(current_.front()))
    names.push_back(current_.front().name);
  return names;
}

}  // namespace mmradartwin
