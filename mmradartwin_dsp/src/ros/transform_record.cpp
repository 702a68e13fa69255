#include "mmradartwin_dsp/ros/transform_record.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/stationary_poses.h"

namespace mmradartwin {
namespace {

bool earlier(const TransformRecord::Stamped& a, const TransformRecord::Stamped& b) { return a.stamp_ns < b.stamp_ns; }

}  // namespace

std::string withoutSlash(const std::string& name) {
  return name.substr(std::min(name.find_first_not_of('/'), name.size()));
}

void TransformRecord::add(const tf2_msgs::TFMessage& message, bool fixed) {
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    const std::string child = withoutSlash(transform.child_frame_id);
    parents_[child] = withoutSlash(transform.header.frame_id);
    if (fixed) continue;
    const auto& p = transform.transform.translation;
    const auto& q = transform.transform.rotation;
    const bool usable =
        std::abs(Eigen::Quaterniond(q.w, q.x, q.y, q.z).norm() - 1) < 0.01 && std::isfinite(p.x + p.y + p.z);
    if (!usable) {
      ++unusable_;
      continue;
    }
    const Stamped stamped{toNanoseconds(transform.header.stamp), fromMsg(transform.transform)};
    std::vector<Stamped>& edge = edges_[child];
    edge.insert(std::upper_bound(edge.begin(), edge.end(), stamped, earlier), stamped);
  }
}

void TransformRecord::keep(double seconds) {
  for (auto& [child, edge] : edges_) {
    const Stamped oldest{edge.back().stamp_ns - static_cast<std::int64_t>(seconds * 1e9), Eigen::Isometry3d()};
    // In pieces: to erase from a vector's front costs its length.
    const auto end = std::lower_bound(edge.begin(), edge.end(), oldest, earlier);
    if (2 * (end - edge.begin()) > static_cast<std::ptrdiff_t>(edge.size())) edge.erase(edge.begin(), end);
  }
}

void TransformRecord::clearMoving() { edges_.clear(); }

std::optional<std::vector<std::string>> TransformRecord::chain(const std::string& map, const std::string& radar) const {
  const std::vector<std::string> up = toRoot(withoutSlash(radar)), down = toRoot(withoutSlash(map));
  for (std::size_t i = 0; i < up.size(); ++i) {
    const auto meet = std::find(down.begin(), down.end(), up[i]);
    if (meet == down.end()) continue;
    std::vector<std::string> edges(up.begin(), up.begin() + static_cast<std::ptrdiff_t>(i));
    edges.insert(edges.end(), down.begin(), meet);
    return edges;
  }
  return std::nullopt;
}

std::map<std::string, std::vector<TransformRecord::Stamped>> TransformRecord::moving(
    const std::vector<std::string>& chain) const {
  std::map<std::string, std::vector<Stamped>> found;
  for (const std::string& child : chain) {
    const auto edge = edges_.find(child);
    if (edge != edges_.end()) found[child] = edge->second;
  }
  return found;
}

std::string TransformRecord::nameOf(const std::string& child) const { return parents_.at(child) + " -> " + child; }

std::string TransformRecord::whyNotBetween(std::int64_t stamp_ns, const std::string& map, const std::string& radar,
                                           const TransformLimits& limits) const {
  const auto edges = chain(map, radar);
  if (!edges) return "";
  for (const std::string& child : *edges) {
    const auto edge = edges_.find(child);
    if (edge == edges_.end()) continue;
    const auto after =
        std::lower_bound(edge->second.begin(), edge->second.end(), Stamped{stamp_ns, Eigen::Isometry3d()}, earlier);
    if (after == edge->second.begin() || after == edge->second.end() || after->stamp_ns == stamp_ns) continue;
    const Stamped& before = *(after - 1);
    char text[160];
    if (isJump(before, *after, limits)) {
      std::snprintf(text, sizeof text, "%s jumps there by %.2f m and %.0f deg", nameOf(child).c_str(),
                    (before.T.inverse() * after->T).translation().norm(),
                    Eigen::AngleAxisd(before.T.linear().transpose() * after->T.linear()).angle() * 180 / M_PI);
      return text;
    }
    const double apart_s = static_cast<double>(after->stamp_ns - before.stamp_ns) * 1e-9;
    if (apart_s > limits.gap_s && !standsStill(before.T, after->T)) {
      std::snprintf(text, sizeof text, "%s was silent for %.2f s, and another one afterwards", nameOf(child).c_str(),
                    apart_s);
      return text;
    }
  }
  return "";
}

std::vector<std::string> TransformRecord::toRoot(std::string frame) const {
  std::vector<std::string> frames = {frame};
  while (frames.size() < 100) {
    const auto parent = parents_.find(frame);
    if (parent == parents_.end()) break;
    frames.push_back(frame = parent->second);
  }
  return frames;
}

bool isJump(const TransformRecord::Stamped& from, const TransformRecord::Stamped& to, const TransformLimits& limits) {
  const double elapsed_s = std::max(static_cast<double>(to.stamp_ns - from.stamp_ns) * 1e-9, 1e-3);
  const Eigen::Isometry3d step = from.T.inverse() * to.T;
  const double distance_m = step.translation().norm(), angle_rad = Eigen::AngleAxisd(step.linear()).angle();
  return (distance_m > limits.jump_m && distance_m / elapsed_s > limits.jump_m_per_s) ||
         (angle_rad > limits.jump_rad && angle_rad / elapsed_s > limits.jump_rad_per_s);
}

}  // namespace mmradartwin
