#include "diagnosis/pose_convention.h"

#include <algorithm>
#include <cmath>

#include "diagnosis/catalogue/bounds.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/gain/held_out_gain.h"
#include "diagnosis/numbers/number_text.h"
#include "diagnosis/scene_match.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin::diagnosis {
namespace {

constexpr double kLevel = 0.8;         ///< cosine between a radar's z axis and the vertical
constexpr double kShareOfPoses = 0.8;  ///< that a reading has to leave level, near and outside of things
constexpr std::size_t kFewest = 3;     ///< poses
constexpr std::size_t kMost = 30;      ///< poses that readings are tried on
constexpr double kClearly = 3;         ///< times what a twin has to explain beyond chance: several readings are tried
constexpr double kAlike = 0.02;        ///< readings that explain shares so near each other are both named
constexpr double kSameRotation = 1e-6;

using Change = std::function<Eigen::Isometry3d(const Eigen::Isometry3d&)>;
struct Option {
  std::string words;  ///< "" for the right convention
  Change change;
};

Eigen::Isometry3d unchanged(const Eigen::Isometry3d& T) { return T; }

Eigen::Isometry3d rotated(const Eigen::Isometry3d& T, const Eigen::Matrix3d& R) {
  Eigen::Isometry3d changed = T;
  changed.linear() = R;
  return changed;
}

Eigen::Isometry3d wFirst(const Eigen::Isometry3d& T) {
  const Eigen::Quaterniond q(T.linear());
  return rotated(T, Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()).normalized().toRotationMatrix());
}

/// The radar's forward, left and up axes as a body's frame has them.
Option body(const std::string& words, const Eigen::Vector3d& forward, const Eigen::Vector3d& left,
            const Eigen::Vector3d& up) {
  Eigen::Matrix3d axes;
  axes << forward, left, up;
  return {words, [axes](const Eigen::Isometry3d& T) { return rotated(T, T.linear() * axes); }};
}

Eigen::Isometry3d worldYUp(const Eigen::Isometry3d& T) {
  return Eigen::Isometry3d(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitX())) * T;
}

std::vector<PoseReading> combined() {
  using V = Eigen::Vector3d;
  const std::vector<Option> quaternions = {{"", unchanged}, {"their quaternions are w, x, y, z", wFirst}};
  const std::vector<Option> directions = {
      {"", unchanged},
      {"their rotations are inverted", [](const auto& T) { return rotated(T, T.linear().transpose()); }},
      {"they are inverted (T_radar_map, world to camera)", [](const auto& T) { return T.inverse(); }}};
  const std::vector<Option> worlds = {{"", unchanged}, {"their map's y axis points up", worldYUp}};
  const std::vector<Option> bodies = {
      {"", unchanged},
      body("their frame is an optical one (z forward, x right, y down)", V(0, 0, 1), V(-1, 0, 0), V(0, -1, 0)),
      body("their frame is a camera's of OpenGL (z backward, x right, y up)", V(0, 0, -1), V(-1, 0, 0), V(0, 1, 0)),
      body("their frame's y axis points up (x forward, z right)", V(1, 0, 0), V(0, 0, -1), V(0, 1, 0))};
  std::vector<std::pair<int, PoseReading>> all;
  for (const Option& q : quaternions) {
    for (const Option& d : directions) {
      for (const Option& w : worlds) {
        for (const Option& b : bodies) {
          std::string words;
          int changes = 0;
          for (const Option* o : {&q, &d, &w, &b}) {
            if (o->words.empty()) continue;
            words += (changes++ ? " and " : "") + o->words;
          }
          if (changes == 0) continue;
          all.push_back({changes, {words, [q, d, w, b](const Eigen::Isometry3d& T) {
                                     return b.change(w.change(d.change(q.change(T))));
                                   }}});
        }
      }
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<PoseReading> readings;
  for (auto& [changes, reading] : all) readings.push_back(std::move(reading));
  return readings;
}

/// Some poses of a session, spread over it.
ChannelData someOf(const ChannelData& data) {
  ChannelData some = data;
  if (data.poses.size() <= kMost) return some;
  some.poses.clear();
  for (std::size_t i = 0; i < kMost; ++i) some.poses.push_back(data.poses[i * data.poses.size() / kMost]);
  return some;
}

std::vector<Eigen::Isometry3d> placesOf(const ChannelData& data) {
  std::vector<Eigen::Isometry3d> places;
  for (const PoseChannels& pose : data.poses) places.push_back(pose.pose.T_map_radar);
  return places;
}

bool isSame(const std::vector<Eigen::Isometry3d>& a, const std::vector<Eigen::Isometry3d>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const auto& p, const auto& q) {
    return (p.matrix() - q.matrix()).cwiseAbs().maxCoeff() < kSameRotation;
  });
}

/// The session with its poses read so; nothing where too few of them could be radars' poses in this scene.
std::optional<ChannelData> readSo(const Twin& twin, const ChannelData& data,
                                  const std::vector<Eigen::Isometry3d>& places) {
  Eigen::AlignedBox3d room;
  for (const Actor& actor : twin.scene().actors) room.extend(actor.bounds);
  ChannelData read = data;
  read.poses.clear();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const bool possible = places[i].linear()(2, 2) >= kLevel &&
                          room.exteriorDistance(places[i].translation()) <= twin.radar().max_range_m() &&
                          !twin.rays().insideActor(places[i].translation());
    if (!possible) continue;
    read.poses.push_back(data.poses[i]);
    read.poses.back().pose.T_map_radar = places[i];
  }
  const double share = static_cast<double>(read.poses.size()) / static_cast<double>(places.size());
  if (read.poses.size() < kFewest || share < kShareOfPoses) return std::nullopt;
  return read;
}

/// Share of the measured power that the twin explains, and that less what chance explains.
struct Match {
  double explained = 0, beyond_chance = -1;
};

Match matchOf(const Twin& twin, const ChannelData& data) {
  try {
    ExpectedEchoes source(twin, data, PoseAccuracy());
    const std::vector<PoseEchoes> echoes = source.echoes(twin.description().mechanisms);
    const double explained = explainedPower(cellPowers(data, echoes));
    const std::optional<double> by_chance = explainedByChance(data, echoes);
    if (by_chance && std::isfinite(explained)) return {explained, explained - *by_chance};
  } catch (const InputError&) {
    // The twin cannot be traced there.
  }
  return {};
}

}  // namespace

const std::vector<PoseReading>& poseReadings() {
  static const std::vector<PoseReading> readings = combined();
  return readings;
}

std::optional<std::string> matchingPoseReading(const Twin& twin, const ChannelData& data) {
  const ChannelData some = someOf(data);
  const std::vector<Eigen::Isometry3d> as_given = placesOf(some);
  std::vector<std::vector<Eigen::Isometry3d>> tried = {as_given};
  std::vector<std::pair<Match, std::string>> matching;
  for (const PoseReading& reading : poseReadings()) {
    std::vector<Eigen::Isometry3d> places;
    for (const Eigen::Isometry3d& T : as_given) places.push_back(reading.T_map_radar(T));
    const bool again = std::any_of(tried.begin(), tried.end(), [&](const auto& t) { return isSame(t, places); });
    if (again) continue;
    tried.push_back(places);
    const std::optional<ChannelData> read = readSo(twin, some, places);
    if (!read) continue;
    const Match match = matchOf(twin, *read);
    if (match.beyond_chance >= kClearly * bounds::kLeastExplainedBeyondChance)
      matching.emplace_back(match, reading.words);
  }
  if (matching.empty()) return std::nullopt;
  std::stable_sort(matching.begin(), matching.end(),
                   [](const auto& a, const auto& b) { return a.first.beyond_chance > b.first.beyond_chance; });
  std::string words = matching[0].second;
  if (matching.size() > 1 && matching[1].first.beyond_chance > matching[0].first.beyond_chance - kAlike) {
    words += ", or if " + matching[1].second;
  }
  return "the poses match the recording, and the twin explains " + number(matching[0].first.explained) +
         " of the measured power, if " + words +
         "; write them as T_map_radar with x forward, y left, z up and the quaternion as qx, qy, qz, qw";
}

}  // namespace mmradartwin::diagnosis
