#include "mmradartwin_dsp/ros/bag_validation.h"

#include <mmradartwin_msgs/AdcCube.h>
#include <mmradartwin_msgs/RadarConfig.h>
#include <mmradartwin_msgs/Session.h>
#include <tf2_msgs/TFMessage.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/output.h"
#include "mmradartwin_dsp/ros/conversions.h"
#include "mmradartwin_dsp/ros/transform_record.h"
#include "mmradartwin_dsp/stationary_poses.h"
#include "mmradartwin_dsp/text.h"
#include "ros/bag/bag_set.h"
#include "ros/message_lengths.h"

namespace mmradartwin {
namespace {

std::string seconds(std::int64_t stamp_ns) { return formatStamp(stamp_ns) + " s"; }

/// Findings in the order in which they were first met, those of one kind counted.
class Findings {
 public:
  void add(const std::string& what, const std::string& first, std::uint64_t count = 1) {
    const auto known = std::find_if(all.begin(), all.end(), [&](const BagFinding& f) { return f.what == what; });
    if (known == all.end()) {
      all.push_back({what, count, first});
    } else {
      known->count += count;
    }
  }
  std::vector<BagFinding> all;
};

/// One radar of the bag.
class RadarRecord {
 public:
  RadarRecord(const BagLimits& limits) : limits_(limits) {}

  void addConfig(const mmradartwin_msgs::RadarConfig& config, std::int64_t recorded_ns) {
    const std::uint64_t hash = radarHash(config);
    if (hashes_.insert(hash).second && hashes_.size() > 1) {
      findings.add("further radar configuration(s)", "recorded at " + seconds(recorded_ns));
    }
    hash_ = hash;
    try {
      radar_ = fromMsg(config);
    } catch (const InputError& error) {
      findings.add("unusable radar configuration(s)", error.what());
    }
  }

  void add(const mmradartwin_msgs::AdcCube& message) {
    AdcCube cube;
    const std::string at =
        "frame " + std::to_string(message.sequence) + " at " + seconds(toNanoseconds(message.header.stamp));
    try {
      cube = fromMsg(message);
    } catch (const InputError& error) {
      findings.add("malformed frame(s)", at + ": " + error.what());
      return;
    }
    stamps_ns.push_back(cube.stamp_ns);
    if (!hashes_.empty() && message.radar_hash != hash_) {
      findings.add("frame(s) taken with another radar configuration than radar/config says", at);
    }
    if (radar_ && (cube.chirps != radar_->chirps_per_frame() || cube.samples != radar_->samples_per_chirp ||
                   cube.receivers != radar_->receivers())) {
      findings.add("frame(s) of another shape than radar/config says", at);
    }
    checkOrder(cube, at);
    if (cube.lost_bytes > 0) findings.add("frame(s) with lost bytes", at);
    lost_bytes_ += cube.lost_bytes;
    const auto invalid = static_cast<std::uint64_t>(std::count(cube.chirp_valid.begin(), cube.chirp_valid.end(), 0));
    if (invalid > 0) findings.add("invalid chirp(s)", at, invalid);
    checkSamples(cube, at);
    previous_ = std::pair(cube.sequence, cube.stamp_ns);
  }

  void finish() {
    if (hashes_.empty()) findings.add("no radar configuration on radar/config: record it too (it is latched)", "");
    if (stamps_ns.empty()) findings.add("no frame on radar/adc", "");
    for (const auto& [receiver, frames] : silent_) {
      findings.add("frame(s) in which receiver " + std::to_string(receiver) + " is all zero", frames.second,
                   frames.first);
    }
    if (lost_bytes_ > 0) findings.add("byte(s) lost in all", "", lost_bytes_);
  }

  Findings findings;
  std::vector<std::int64_t> stamps_ns;

 private:
  void checkOrder(const AdcCube& cube, const std::string& at) {
    if (!previous_) return;
    const auto& [sequence, stamp_ns] = *previous_;
    if (cube.stamp_ns <= stamp_ns) findings.add("frame(s) not later than the one before", at);
    if (cube.sequence <= sequence) {
      // The count begins anew whenever the card is armed, and with every pose of a session.
      if (cube.sequence != 0) findings.add("frame(s) whose sequence goes back", at);
      return;
    }
    const std::uint32_t steps = cube.sequence - sequence;
    if (steps > 1) findings.add("frame(s) missing in the sequence", "before " + at, steps - 1);
    if (!radar_) return;
    const double expected_s = steps * radar_->frame_period_s;
    if (std::abs((cube.stamp_ns - stamp_ns) * 1e-9 - expected_s) > limits_.stamp_tolerance_s) {
      findings.add("frame(s) whose stamp is off the frame period", at);
    }
  }

  void checkSamples(const AdcCube& cube, const std::string& at) {
    const auto receivers = static_cast<std::size_t>(cube.receivers);
    const std::size_t chirp_words = static_cast<std::size_t>(cube.samples) * receivers * 2;
    std::uint64_t saturated = 0;
    std::vector<bool> any(receivers, false);
    bool valid = false;
    for (std::size_t chirp = 0; chirp < cube.chirp_valid.size(); ++chirp) {
      if (!cube.chirp_valid[chirp]) continue;
      valid = true;
      const std::int16_t* words = cube.data.data() + chirp * chirp_words;
      for (std::size_t i = 0; i < chirp_words; ++i) {
        saturated += words[i] == 32767 || words[i] == -32768 ? 1 : 0;
        if (words[i] != 0) any[i / 2 % receivers] = true;
      }
    }
    if (saturated > 0) findings.add("saturated sample(s)", at, saturated);
    for (std::size_t receiver = 0; valid && receiver < receivers; ++receiver) {
      if (any[receiver]) continue;
      auto& entry = silent_[static_cast<int>(receiver)];
      if (entry.first++ == 0) entry.second = at;
    }
  }

  const BagLimits& limits_;
  std::optional<RadarConfig> radar_;
  std::set<std::uint64_t> hashes_;
  std::uint64_t hash_ = 0, lost_bytes_ = 0;
  std::optional<std::pair<std::uint32_t, std::int64_t>> previous_;
  std::map<int, std::pair<std::uint64_t, std::string>> silent_;
};

void checkTransforms(const TransformRecord& tf, const BagOptions& options, const BagLimits& limits, bool session,
                     const std::vector<std::int64_t>& stamps_ns, Findings& findings) {
  const std::string wanted = options.map_frame + " -> " + options.radar_frame;
  if (tf.empty()) {
    findings.add("no tf: record /tf and /tf_static too, with " + wanted, "");
    return;
  }
  if (tf.unusable() > 0) findings.add("transform(s) that are no rotation and place", "", tf.unusable());
  const auto chain = tf.chain(options.map_frame, options.radar_frame);
  if (!chain) {
    findings.add("tf does not connect " + wanted, "");
    return;
  }
  const auto silence_ns = static_cast<std::int64_t>(limits.tf_silence_s * 1e9);
  const auto moving = tf.moving(*chain);
  for (const std::int64_t stamp_ns : stamps_ns) {
    const std::string why_no_pose = tf.whyNotBetween(stamp_ns, options.map_frame, options.radar_frame, limits.tf);
    if (!why_no_pose.empty()) {
      findings.add("frame(s) that have no pose, for what tf does there", seconds(stamp_ns) + ", " + why_no_pose);
      continue;
    }
    for (const auto& [child, edges] : moving) {
      const auto after =
          std::lower_bound(edges.begin(), edges.end(), stamp_ns,
                           [](const TransformRecord::Stamped& e, std::int64_t stamp) { return e.stamp_ns < stamp; });
      if (after != edges.end() && after->stamp_ns == stamp_ns) continue;
      const bool before_all = after == edges.begin(), after_all = after == edges.end();
      if (before_all || after_all) {
        // The first and last frames of a recording may lie a moment outside of its transforms.
        const std::int64_t nearest_ns = before_all ? edges.front().stamp_ns : edges.back().stamp_ns;
        if (std::abs(stamp_ns - nearest_ns) <= silence_ns) continue;
        findings.add("frame(s) without a transform", seconds(stamp_ns) + ", " + tf.nameOf(child));
        break;
      }
      if (after->stamp_ns - (after - 1)->stamp_ns > silence_ns) {
        findings.add("frame(s) within a gap in tf that the radar stood through",
                     seconds(stamp_ns) + ", " + tf.nameOf(child));
        break;
      }
    }
  }
  if (session) return;  // its poses follow each other as they were listed, not as a radar moves
  const auto gap_ns = static_cast<std::int64_t>(limits.tf.gap_s * 1e9);
  for (const auto& [child, edges] : moving) {
    for (std::size_t i = 1; i < edges.size(); ++i) {
      const std::string at = seconds(edges[i].stamp_ns) + ", " + tf.nameOf(child);
      if (isJump(edges[i - 1], edges[i], limits.tf)) {
        findings.add("jump(s) in tf", at);
      } else if (edges[i].stamp_ns - edges[i - 1].stamp_ns > gap_ns && !standsStill(edges[i - 1].T, edges[i].T)) {
        findings.add("gap(s) in tf at whose ends the radar stands elsewhere", at);
      }
    }
  }
}

void checkPoses(const std::string& file, const std::string& label, BagOptions options, Findings& findings) {
  options.on_note = [&](const std::string& note) { findings.add(note.substr(file.size() + 2), ""); };
  try {
    const Recording recording = openBag(file, options);
    for (const PoseProblem& problem : recording.problems) findings.add("unusable pose(s)", problem.message);
    for (const Pose& pose : recording.poses) {
      try {
        recording.forEachFrame(pose, [](const AdcCube&) { throw true; });
      } catch (const InputError& error) {
        findings.add("pose(s) without a usable frame", error.what());
      } catch (bool) {  // one frame is enough
      }
    }
  } catch (const InputError& error) {
    // What it says may have been found above already: then nothing is added but that there is no pose.
    const std::string text = Output::namedIn(error.what());
    const bool named = text.compare(0, label.size() + 2, label + ": ") == 0;
    findings.add("no pose can be found", named ? text.substr(label.size() + 2) : text);
  }
}

}  // namespace

std::vector<BagFinding> validateBag(const std::string& file, const BagOptions& options, const BagLimits& limits,
                                    const PoseProgress& progress) try {
  std::vector<std::string> files = {file};
  files.insert(files.end(), options.further.begin(), options.further.end());
  const BagSet bags(files);
  const std::string cubes_end = "radar/adc", config_end = "radar/config";
  std::map<std::string, RadarRecord> radars;  // by namespace
  const auto view = bags.view();
  bool session = false;
  Findings findings;
  for (const rosbag::ConnectionInfo* connection : view->getConnections()) {
    session = session || connection->datatype == "mmradartwin_msgs/Session";
    if (connection->datatype != "mmradartwin_msgs/AdcCube") continue;
    const auto ns = namespaceOf(connection->topic, cubes_end);
    if (!ns) {
      findings.add("topic(s) with frames that are not called radar/adc", connection->topic);
    } else if (options.ns.empty() || *ns == normalNamespace(options.ns)) {
      radars.emplace(*ns, limits);
    }
  }
  if (radars.empty()) {
    findings.add("no frames: record radar/adc, radar/config and tf", "");
    return findings.all;
  }
  TransformRecord tf;
  std::uint32_t done = 0;
  for (const rosbag::MessageInstance& message : *view) {
    if (progress && ++done % 64 == 0) progress(static_cast<int>(done), static_cast<int>(view->size()));
    const std::string topic = withoutSlash(message.getTopic());
    const auto record = [&](const std::string& end) -> RadarRecord* {
      const auto ns = namespaceOf(topic, end);
      const auto found = ns ? radars.find(*ns) : radars.end();
      return found == radars.end() ? nullptr : &found->second;
    };
    if (message.getDataType() == "tf2_msgs/TFMessage") {
      if (const auto transforms = instanceOf<tf2_msgs::TFMessage>(message)) tf.add(*transforms, topic == "tf_static");
    } else if (message.getDataType() == "mmradartwin_msgs/RadarConfig") {
      RadarRecord* radar = record(config_end);
      const auto config = radar ? instanceOf<mmradartwin_msgs::RadarConfig>(message) : nullptr;
      if (config) radar->addConfig(*config, toNanoseconds(message.getTime()));
      if (radar && !config) findings.add("message(s) of another version: run rosbag fix", message.getTopic());
    } else if (message.getDataType() == "mmradartwin_msgs/AdcCube") {
      RadarRecord* radar = record(cubes_end);
      const auto cube = radar ? instanceOf<mmradartwin_msgs::AdcCube>(message) : nullptr;
      if (cube) radar->add(*cube);
      if (radar && !cube) findings.add("message(s) of another version: run rosbag fix", message.getTopic());
    }
  }
  if (radars.size() > 1) {
    std::vector<std::string> names;
    for (const auto& [ns, radar] : radars) names.push_back((ns == "/" ? "" : ns) + "/" + cubes_end);
    findings.add("several radars: programs need --radar to tell them apart", join(names, ", "), radars.size());
  }
  for (auto& [ns, radar] : radars) {
    radar.finish();
    BagOptions own = options;
    own.ns = ns;
    own.radar_frame = radarFrame(bags, (ns == "/" ? "" : ns) + "/" + cubes_end, options.radar_frame);
    checkTransforms(tf, own, limits, session, radar.stamps_ns, radar.findings);
    checkPoses(file, bags.label(), own, radar.findings);
    for (const BagFinding& finding : radar.findings.all) {
      findings.all.push_back(finding);
      if (radars.size() > 1) findings.all.back().what = ns + ": " + finding.what;
    }
  }
  return findings.all;
} catch (const ros::Exception& error) {
  throw damagedBag(file, error);
}

}  // namespace mmradartwin
