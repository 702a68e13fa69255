#include "mmradartwin_driver/pose_watch.h"

#include <cstdio>

namespace mmradartwin {
namespace {

template <class... Values>
std::string text(const char* format, Values... values) {
  char line[160];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

}  // namespace

void PoseWatch::observe(std::int64_t stamp_ns, const Eigen::Isometry3d& T_map_radar) {
  if (stamp_ns_ && stamp_ns <= *stamp_ns_) {
    if (stamp_ns == *stamp_ns_ || *stamp_ns_ - stamp_ns < 1'000'000'000) return;
    stamp_ns_.reset();  // the clock went back: stamps begin again
  }
  if (stamp_ns_) {
    const double apart_s = static_cast<double>(stamp_ns - *stamp_ns_) * 1e-9;
    const double moved_m = (T_map_radar.translation() - T_map_radar_.translation()).norm();
    const double turned_rad =
        Eigen::Quaterniond(T_map_radar.linear()).angularDistance(Eigen::Quaterniond(T_map_radar_.linear()));
    if (apart_s > options_.age_limit_s) {
      ++gaps_;
      gap_ = {text("poses were missing for %.1f s: frames of that time have no pose that can be trusted", apart_s),
              stamp_ns};
    } else if ((moved_m > options_.jump_m && moved_m > options_.speed_limit_m_per_s * apart_s) ||
               (turned_rad > options_.jump_rad && turned_rad > options_.turn_limit_rad_per_s * apart_s)) {
      ++jumps_;
      jump_ = {text("the pose jumped by %.2f m and %.0f deg within %.2f s: was the radar put elsewhere, or did its "
                    "localisation correct itself?",
                    moved_m, turned_rad * 57.29578, apart_s),
               stamp_ns};
    }
  }
  stamp_ns_ = stamp_ns;
  T_map_radar_ = T_map_radar;
}

PoseWatch::Report PoseWatch::report(std::int64_t now_ns) const {
  Report report;
  report.gaps = gaps_;
  report.jumps = jumps_;
  if (!stamp_ns_) {
    report.text =
        "no pose of the radar yet: start the node that publishes the camera's pose, and the mount's transform";
    return report;
  }
  if (*stamp_ns_ == 0) {
    report.level = Level::kFine;
    report.text = "the radar stands where a static transform says";
    return report;
  }
  report.age_s = static_cast<double>(now_ns - *stamp_ns_) * 1e-9;
  if (*report.age_s > options_.age_limit_s) {
    report.text =
        text("the latest pose is %.1f s old: see to the node that publishes the camera's pose", *report.age_s);
    return report;
  }
  // A jump at the end of a gap must not hide the gap, and vice versa.
  for (const Event* event : {&gap_, &jump_}) {
    if (event->text.empty() || static_cast<double>(now_ns - event->stamp_ns) * 1e-9 >= options_.remember_s) continue;
    report.level = Level::kWarning;
    report.text += (report.text.empty() ? "" : "; ") + event->text;
  }
  if (report.text.empty()) {
    report.level = Level::kFine;
    report.text = "poses come";
  }
  return report;
}

}  // namespace mmradartwin
