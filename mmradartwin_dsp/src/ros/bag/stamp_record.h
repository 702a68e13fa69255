#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// The stamps of one topic or one edge of tf, and the times at which the recorder received them.
class StampRecord {
 public:
  void add(std::int64_t stamp_ns, std::int64_t recorded_ns);
  bool empty() const { return stamps_ns_.empty(); }
  /// Why these stamps tell no time: all zero, or all one and the same. `whose` is their subject, "frames on radar/adc";
  /// `driver` who should have stamped. "" where they do.
  std::string whyNoTime(const std::string& whose, const std::string& driver) const;
  std::int64_t first_ns() const;  ///< one in twenty is earlier: single stamps may be anything
  std::int64_t last_ns() const;   ///< one in twenty is later

  struct Offset {
    double later_s;
    bool measured;  ///< against the recorder's clock; else only that they have no time in common
  };
  /// By how much the stamps of `a` are later than those of `b`: against the recorder's clock where both were recorded
  /// together, else, where they have no time in common, from the middle of the one to the middle of the other. Nothing
  /// where neither says so.
  static std::optional<Offset> between(const StampRecord& a, const StampRecord& b);

 private:
  std::vector<std::int64_t> stamps_ns_, recorded_ns_;
};

}  // namespace mmradartwin
