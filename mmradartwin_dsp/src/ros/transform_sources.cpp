#include "mmradartwin_dsp/ros/transform_sources.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>

#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

/// Two publishers that both say where a frame is do so again and again within this; a frame that is handed over from
/// one parent to another has the new one from then on.
constexpr std::int64_t kInTurn_ns = 2'000'000'000;
/// Of two publishers' words, apart by this at most, about one time.
constexpr std::int64_t kSameTime_ns = 100'000'000;
/// So often it is no accident at a change from one publisher to another.
constexpr int kLeastTurns = 2;
/// Of one frame; more of them, as of a radar that moves in tf_static, say no more.
constexpr std::size_t kMostSources = 16;
/// Rounding of transforms that are written as text, as launch files do.
constexpr double kSameMount_m = 1e-4, kSameMount_rad = 1e-4;

bool usable(const geometry_msgs::Transform& T) {
  const auto& p = T.translation;
  const auto& q = T.rotation;
  return std::isfinite(p.x + p.y + p.z) && std::abs(Eigen::Quaterniond(q.w, q.x, q.y, q.z).norm() - 1) < 0.01;
}

bool sameMount(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return standsStill(a, b, kSameMount_m, kSameMount_rad);
}

std::string publishedBy(const std::string& publisher) {
  return publisher.empty() ? "" : " (published by " + publisher + ")";
}

/// As static_transform_publisher takes it.
std::string mountText(const Eigen::Isometry3d& T) {
  const Eigen::Matrix3d& R = T.linear();
  // Rounded here, since printf writes what is a little less than zero as -0.0.
  const auto degrees = [](double rad) { return std::round(rad * 1800 / M_PI) / 10 + 0.0; };
  const double yaw = degrees(std::atan2(R(1, 0), R(0, 0))), pitch = degrees(std::asin(std::clamp(-R(2, 0), -1.0, 1.0))),
               roll = degrees(std::atan2(R(2, 1), R(2, 2)));
  char text[160];
  std::snprintf(text, sizeof text, "x y z %.3f %.3f %.3f m, yaw pitch roll %.1f %.1f %.1f deg", T.translation().x(),
                T.translation().y(), T.translation().z(), yaw, pitch, roll);
  return text;
}

std::string apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  char text[80];
  std::snprintf(text, sizeof text, "%.3f m and %.1f deg apart", (a.translation() - b.translation()).norm(),
                Eigen::Quaterniond(a.linear()).angularDistance(Eigen::Quaterniond(b.linear())) * 180 / M_PI);
  return text;
}

}  // namespace

std::vector<std::string> TransformSources::add(const tf2_msgs::TFMessage& message, bool fixed,
                                               const std::string& publisher) {
  std::vector<std::string> found;
  for (const geometry_msgs::TransformStamped& transform : message.transforms) {
    if (!usable(transform.transform)) continue;
    const std::string child = withoutSlash(transform.child_frame_id);
    Frame& frame = frames_[child];
    const bool look = take(frame, {withoutSlash(transform.header.frame_id), publisher, fixed,
                                   fromMsg(transform.transform), toNanoseconds(transform.header.stamp)});
    if (!look || frame.reported) continue;
    const std::string contradiction = contradictionOf(child, frame, "");
    if (contradiction.empty()) continue;
    frame.reported = true;
    found.push_back(contradiction);
  }
  return found;
}

bool TransformSources::take(Frame& frame, const Source& said) {
  std::vector<Source>& sources = frame.sources;
  const auto known = std::find_if(sources.begin(), sources.end(), [&said](const Source& s) {
    return s.parent == said.parent && s.publisher == said.publisher && s.fixed == said.fixed &&
           (!s.fixed || sameMount(s.T, said.T));
  });
  if (known == sources.end()) {
    if (sources.size() == kMostSources) return false;
    sources.push_back(said);
    frame.last = sources.size() - 1;
    return sources.size() > 1;
  }
  bool look = false;
  const Source& before = sources[frame.last];
  if (!said.fixed && !before.fixed && &before != &*known) {
    const bool soon = std::abs(said.stamp_ns - known->stamp_ns) < kInTurn_ns;
    if (before.parent != said.parent) {
      frame.parents_in_turn += soon;
      look = true;
    } else if (std::abs(said.stamp_ns - before.stamp_ns) < kSameTime_ns &&
               isJump({before.stamp_ns, before.T}, {said.stamp_ns, said.T}, TransformLimits())) {
      frame.places_in_turn += soon;
      look = true;
    }
  } else if (said.fixed != before.fixed) {
    look = true;
  }
  *known = said;
  frame.last = static_cast<std::size_t>(known - sources.begin());
  return look;
}

std::string TransformSources::contradictionOfParents(const std::string& child, const Frame& frame,
                                                     const std::string& map) const {
  std::vector<std::string> parents, names;
  bool fixed = false, all_connected = true;
  for (const Source& source : frame.sources) {
    if (std::find(parents.begin(), parents.end(), source.parent) != parents.end()) continue;
    parents.push_back(source.parent);
    names.push_back(source.parent + publishedBy(source.publisher));
    fixed = fixed || source.fixed;
    all_connected = all_connected && (map.empty() || connected(source.parent, map));
  }
  if (parents.size() < 2) return "";
  if (!fixed && frame.parents_in_turn < kLeastTurns && all_connected) return "";  // handed over
  return "frame " + child + " has " + std::to_string(parents.size()) + " parents, " + join(names, " and ") +
         ": tf is a tree and keeps the one that spoke last; let one of them alone say where " + child + " is";
}

std::string TransformSources::contradictionOf(const std::string& child, const Frame& frame,
                                              const std::string& map) const {
  const std::string of_parents = contradictionOfParents(child, frame, map);
  if (!of_parents.empty()) return of_parents;
  const std::string edge = frame.sources.front().parent + " -> " + child;
  for (const Source& b : frame.sources) {
    for (const Source& a : frame.sources) {
      if (&a == &b) break;
      if (a.fixed && b.fixed && !sameMount(a.T, b.T)) {
        return "two static transforms of " + edge + ", " + apart(a.T, b.T) + ": " + mountText(a.T) +
               publishedBy(a.publisher) + " and " + mountText(b.T) + publishedBy(b.publisher) +
               "; tf keeps the last one, leave the wrong one out";
      }
      if (a.fixed != b.fixed && !sameMount(a.T, b.T)) {
        const Source& mount = a.fixed ? a : b;
        const Source& moving = a.fixed ? b : a;
        return edge + " is in tf_static" + publishedBy(mount.publisher) + " and in tf" + publishedBy(moving.publisher) +
               ", " + apart(a.T, b.T) + "; let one of them alone say where " + child + " is";
      }
    }
  }
  if (frame.places_in_turn < kLeastTurns) return "";
  std::vector<std::string> publishers;
  for (const Source& source : frame.sources) publishers.push_back(source.publisher);
  return edge + " is published by " + join(publishers, " and by ") +
         ", who put it at different places at the same time; let one of them alone say where " + child + " is";
}

std::vector<std::string> TransformSources::contradictions(const std::string& map, const std::string& radar) const {
  const std::string root = withoutSlash(map);
  std::vector<std::string> frames = above(withoutSlash(radar), root), found;
  // Above the map only where the way to the radar leads through there.
  if (std::find(frames.begin(), frames.end(), root) == frames.end()) {
    const std::vector<std::string> more = above(root, "");
    frames.insert(frames.end(), more.begin(), more.end());
  } else {
    frames.erase(std::remove(frames.begin(), frames.end(), root), frames.end());
  }
  std::set<std::string> seen;
  for (const std::string& child : frames) {
    const auto frame = frames_.find(child);
    if (frame == frames_.end() || !seen.insert(child).second) continue;
    const std::string contradiction = contradictionOf(child, frame->second, root);
    if (!contradiction.empty()) found.push_back(contradiction);
  }
  return found;
}

std::string TransformSources::nameOf(const std::string& child) const {
  const auto frame = frames_.find(withoutSlash(child));
  if (frame == frames_.end()) return child;
  std::set<std::string> publishers;
  for (const Source& source : frame->second.sources) {
    if (!source.publisher.empty()) publishers.insert(source.publisher);
  }
  return frame->second.sources.front().parent + " -> " + frame->first +
         publishedBy(join({publishers.begin(), publishers.end()}, ", "));
}

std::vector<std::string> TransformSources::roots() const {
  std::set<std::string> found;
  for (const auto& [child, frame] : frames_) {
    for (const Source& source : frame.sources) {
      if (!frames_.count(source.parent)) found.insert(source.parent);
    }
  }
  return {found.begin(), found.end()};
}

bool TransformSources::connected(const std::string& frame, const std::string& map) const {
  const std::vector<std::string> a = above(frame, ""), b = above(map, "");
  return std::any_of(a.begin(), a.end(),
                     [&b](const std::string& name) { return std::find(b.begin(), b.end(), name) != b.end(); });
}

std::vector<std::string> TransformSources::above(const std::string& frame, const std::string& stop) const {
  std::vector<std::string> found = {frame};
  for (std::size_t i = 0; i < found.size(); ++i) {
    const auto known = frames_.find(found[i]);
    if (known == frames_.end() || found[i] == stop) continue;
    for (const Source& source : known->second.sources) {
      if (std::find(found.begin(), found.end(), source.parent) == found.end()) found.push_back(source.parent);
    }
  }
  return found;
}

}  // namespace mmradartwin
