#include "ros/bag/stamp_record.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "mmradartwin_dsp/session.h"

namespace mmradartwin {
namespace {

constexpr double kOutside = 0.05;

std::int64_t quantile(std::vector<std::int64_t> values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(std::llround(share * static_cast<double>(values.size() - 1)));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

bool overlap(const std::vector<std::int64_t>& a, const std::vector<std::int64_t>& b) {
  return quantile(a, kOutside) <= quantile(b, 1 - kOutside) && quantile(b, kOutside) <= quantile(a, 1 - kOutside);
}

}  // namespace

void StampRecord::add(std::int64_t stamp_ns, std::int64_t recorded_ns) {
  stamps_ns_.push_back(stamp_ns);
  recorded_ns_.push_back(recorded_ns);
}

std::string StampRecord::whyNoTime(const std::string& whose, const std::string& driver) const {
  const auto differ = std::adjacent_find(stamps_ns_.begin(), stamps_ns_.end(), std::not_equal_to<>());
  if (stamps_ns_.size() < 2 || differ != stamps_ns_.end()) return "";
  const bool zero = first_ns() == 0;
  return "stamps of " + whose + " are all " +
         (zero ? std::string("zero") : "the same (" + formatStamp(first_ns()) + " s)") + ": " + driver +
         " did not stamp " + (zero ? "them" : "each of them") +
         "; let it fill header.stamp, and record anew or write the bag again with the time of recording as stamp";
}

std::int64_t StampRecord::first_ns() const { return quantile(stamps_ns_, kOutside); }
std::int64_t StampRecord::last_ns() const { return quantile(stamps_ns_, 1 - kOutside); }

std::optional<StampRecord::Offset> StampRecord::between(const StampRecord& a, const StampRecord& b) {
  if (a.empty() || b.empty()) return std::nullopt;
  const auto ahead_ns = [](const StampRecord& record) {
    std::vector<std::int64_t> difference_ns(record.stamps_ns_.size());
    for (std::size_t i = 0; i < difference_ns.size(); ++i) {
      difference_ns[i] = record.stamps_ns_[i] - record.recorded_ns_[i];
    }
    return quantile(std::move(difference_ns), 0.5);
  };
  if (overlap(a.recorded_ns_, b.recorded_ns_)) {
    return Offset{1e-9 * static_cast<double>(ahead_ns(a) - ahead_ns(b)), true};
  }
  if (overlap(a.stamps_ns_, b.stamps_ns_)) return std::nullopt;  // transforms that were made afterwards
  return Offset{1e-9 * static_cast<double>(a.first_ns() - b.first_ns() + a.last_ns() - b.last_ns()) / 2, false};
}

}  // namespace mmradartwin
