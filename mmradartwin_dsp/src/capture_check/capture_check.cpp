#include "mmradartwin_dsp/capture_check.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <sstream>

#include "capture_check/byte_reading.h"
#include "capture_check/chirp_boundary.h"
#include "capture_check/silent_receivers.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kChirps = 16;         ///< of a capture that are looked at, at least two of each slot
constexpr std::size_t kPosesForLayout = 4;  ///< layouts hold for a whole session
/// Share by which the smoothness of two orders of the elements may differ by chance.
constexpr double kAlikeOrders = 0.02;
/// Probability that bytes which are what radar.yaml says are called anything else, over a whole session.
constexpr double kOtherReadingRate = 1e-4, kMisalignedRate = 1e-6;

/// Standard deviations that chance exceeds in one of `tries` with the false-alarm rate.
double leastDeviations(double rate, double tries) {
  return boost::math::quantile(boost::math::complement(boost::math::normal(), rate / tries));
}

struct PoseWords {
  std::string pose;
  std::vector<std::int16_t> words;  ///< of its first chirps
  SilentReceivers silent;           ///< in its first and last chirps
};

struct Enough {};  ///< ends a visit

std::vector<std::int16_t> toWords(const std::vector<std::uint8_t>& bytes) {
  std::vector<std::int16_t> words(bytes.size() / 2);
  std::memcpy(words.data(), bytes.data(), 2 * words.size());
  return words;
}

/// The first chirps of a bag's pose as a capture would hold them.
std::vector<std::int16_t> wordsOfCubes(const Recording& recording, const Pose& pose, std::size_t bytes) {
  std::vector<std::uint8_t> found;
  try {
    recording.forEachFrame(pose, [&](const AdcCube& cube) {
      const std::vector<std::uint8_t> frame = encodeFrame(recording.radar, cube.data);
      found.insert(found.end(), frame.begin(), frame.end());
      if (found.size() >= bytes) throw Enough();
    });
  } catch (const Enough&) {
  }
  found.resize(std::min(found.size(), bytes));
  return toWords(found);
}

/// What radar.yaml says of the bytes, and the bytes.
class SessionBytes {
 public:
  explicit SessionBytes(const Recording& recording)
      : stated_(statedReading(recording.radar)), slots_(static_cast<std::size_t>(recording.radar.slots())) {
    const std::size_t chirp = recording.radar.bytes_per_chirp();
    const std::size_t bytes = std::max(kChirps, 2 * slots_) * chirp;
    for (const Pose& pose : recording.poses) {
      try {
        PoseWords words{pose.name, {}, {}};
        if (recording.captureOf) {
          const CaptureReader reader = recording.captureOf(pose);
          notes_.insert(notes_.end(), reader.notes().begin(), reader.notes().end());
          const std::size_t size = std::min(bytes, reader.size() / chirp * chirp);
          const auto from = [&](std::size_t offset) {
            std::vector<std::uint8_t> block(size);
            reader.read(offset, size, block.data());
            return toWords(block);
          };
          words.words = from(0);
          words.silent = silentReceivers(stated_, words.words);
          if (!words.silent.empty()) {
            words.silent = commonTo(words.silent, silentReceivers(stated_, from(reader.size() / chirp * chirp - size)));
          }
        } else {
          words.words = wordsOfCubes(recording, pose, bytes);
          words.silent = silentReceivers(stated_, words.words);
        }
        poses_.push_back(std::move(words));
      } catch (const InputError&) {  // whoever reads the pose says so
      }
    }
  }

  std::vector<std::string>& notes() { return notes_; }
  const std::vector<PoseWords>& poses() const { return poses_; }
  const ByteReading& stated() const { return stated_; }
  std::size_t slots() const { return slots_; }

  bool allSilent(const PoseWords& pose) const { return pose.silent.size() == stated_.receivers; }

 private:
  ByteReading stated_;
  std::size_t slots_;
  std::vector<std::string> notes_;
  std::vector<PoseWords> poses_;
};

/// Moves poses without any signal to the recording's problems.
void leaveOutSilentPoses(const SessionBytes& bytes, Recording& recording) {
  for (const PoseWords& words : bytes.poses()) {
    if (!bytes.allSilent(words)) continue;
    const bool zeros = std::all_of(words.silent.begin(), words.silent.end(),
                                   [](const auto& receiver) { return receiver.second == "only zeros"; });
    recording.problems.push_back({words.pose, "pose '" + words.pose + "': all its samples are " +
                                                  (zeros ? "zero" : "constant") +
                                                  "; check the LVDS lanes and record it again, it was left out"});
    recording.poses.erase(std::remove_if(recording.poses.begin(), recording.poses.end(),
                                         [&](const Pose& pose) { return pose.name == words.pose; }),
                          recording.poses.end());
  }
  if (recording.poses.empty() && !recording.problems.empty()) {
    throw InputError(recording.source +
                     ": no pose can be used; the first problem: " + recording.problems.front().message);
  }
}

/// Leaves out receivers that are silent at all poses, and poses at which others are.
void leaveOutSilentReceivers(const SessionBytes& bytes, Recording& recording, std::vector<std::string>& notes) {
  std::optional<SilentReceivers> everywhere;
  for (const PoseWords& words : bytes.poses()) {
    if (bytes.allSilent(words)) continue;
    everywhere = everywhere ? commonTo(*everywhere, words.silent) : words.silent;
  }
  if (!everywhere) return;
  const std::size_t receivers = bytes.stated().receivers;
  for (const auto& [receiver, what] : *everywhere) {
    notes.push_back(recording.source + ": receiver " + std::to_string(receiver) + " delivers " + what +
                    " at all poses: look at its LVDS lane and at rx_enable; it was left out");
  }
  if (!everywhere->empty() && everywhere->size() + 1 >= receivers && receivers > 1) {
    throw InputError(notes.back() + ", and fewer than two receivers are left");
  }
  for (const PoseWords& words : bytes.poses()) {
    if (bytes.allSilent(words) || words.silent.size() == everywhere->size()) continue;
    for (const auto& [receiver, what] : words.silent) {
      if (everywhere->count(receiver)) continue;
      recording.problems.push_back({words.pose, "pose '" + words.pose + "': receiver " + std::to_string(receiver) +
                                                    " delivers " + what +
                                                    " at this pose, not at others: record it again, it was left out"});
      recording.poses.erase(std::remove_if(recording.poses.begin(), recording.poses.end(),
                                           [&](const Pose& pose) { return pose.name == words.pose; }),
                            recording.poses.end());
      break;
    }
  }
  if (!everywhere->empty()) leaveOut(*everywhere, recording);
}

std::string inDecibels(double nats) {
  std::ostringstream text;
  text.precision(1);
  text << std::fixed << nats * 10 / std::log(10.0) << " dB";
  return text.str();
}

/// Evidence of a reading over several poses.
struct ReadingEvidence {
  ByteReading reading;
  double nats = 0, variance = 0;  ///< of the mean over poses
};

ReadingEvidence evidenceOf(const ByteReading& reading, std::size_t slots,
                           const std::vector<std::vector<std::int16_t>>& poses) {
  ReadingEvidence evidence{reading, 0, 0};
  for (const std::vector<std::int16_t>& words : poses) {
    const Concentration c = concentrationOf(reading, slots, words.data(), words.size());
    evidence.nats += c.nats / static_cast<double>(poses.size());
    evidence.variance += c.variance / static_cast<double>(poses.size() * poses.size());
  }
  return evidence;
}

double deviations(const ReadingEvidence& more, const ReadingEvidence& less) {
  return (more.nats - less.nats) / std::sqrt(more.variance + less.variance);
}

/// True where the stated reading is as concentrated as the other once its words begin with a chirp.
bool isMerelyMisaligned(const SessionBytes& bytes, const std::vector<const PoseWords*>& poses,
                        const ReadingEvidence& other) {
  double nats = 0;
  for (const PoseWords* pose : poses) {
    const std::optional<ChirpBoundary> boundary = findChirpBoundary(bytes.stated(), bytes.slots(), pose->words);
    nats += boundary ? boundary->from_there.nats
                     : concentrationOf(bytes.stated(), bytes.slots(), pose->words.data(), pose->words.size()).nats;
  }
  return nats / static_cast<double>(poses.size()) >= other.nats;
}

/// Throws InputError where another reading than the stated one makes the spectra far more concentrated.
void requireStatedReading(const SessionBytes& bytes, const Recording& recording) {
  std::vector<const PoseWords*> usable, poses;
  for (const PoseWords& words : bytes.poses()) {
    // Readings are compared over the same words: whole chirps of each.
    if (!bytes.allSilent(words) && words.words.size() >= bytes.stated().words()) usable.push_back(&words);
  }
  const std::size_t count = std::min(kPosesForLayout, usable.size());
  for (std::size_t i = 0; i < count; ++i) poses.push_back(usable[i * usable.size() / count]);
  if (poses.empty()) return;
  std::vector<std::vector<std::int16_t>> quiet;
  for (const PoseWords* pose : poses) quiet.push_back(quietLoops(pose->words, bytes.slots() * bytes.stated().words()));
  const ReadingEvidence stated = evidenceOf(bytes.stated(), bytes.slots(), quiet);
  std::vector<ReadingEvidence> others;
  for (const ByteReading& reading : otherReadings(recording.radar)) {
    const bool fits = std::all_of(poses.begin(), poses.end(), [&](const PoseWords* pose) {
      return pose->words.size() >= reading.words() && pose->words.size() % bytes.stated().words() == 0;
    });
    if (fits) others.push_back(evidenceOf(reading, bytes.slots(), quiet));
  }
  if (others.empty()) return;
  std::sort(others.begin(), others.end(), [](const auto& a, const auto& b) { return a.nats > b.nats; });
  const ReadingEvidence& best = others.front();
  const double least = leastDeviations(kOtherReadingRate, static_cast<double>(others.size()));
  if (!(deviations(best, stated) > least) || isMerelyMisaligned(bytes, poses, best)) return;
  std::string names = best.reading.name(), advice = best.reading.advice();
  for (std::size_t i = 1; i < others.size(); ++i) {
    if (deviations(best, others[i]) > 2) break;  // that much less likely, it is not mentioned
    names += " or " + others[i].reading.name();
    advice += ", or " + others[i].reading.advice();
  }
  const bool real = best.reading.real && !bytes.stated().real, complex = !best.reading.real && bytes.stated().real;
  throw InputError(recording.source + ": " +
                   (real      ? "samples look real, not complex: "
                    : complex ? "samples look complex, not real (set samples: complex): "
                              : "") +
                   "bytes look like " + names + ", not " + bytes.stated().name() + " (range spectra " +
                   inDecibels(best.nats - stated.nats) + " more concentrated at " + std::to_string(poses.size()) +
                   " pose(s)); " + advice + "; nothing was judged");
}

/// Captures that begin at the same word of a chirp.
struct AlikeCaptures {
  std::vector<std::string> poses;
  std::vector<double> smoothness;  ///< sum over poses, see ChirpBoundary
  std::vector<double> breaks;      ///< the same
  double nats = 0, variance = 0;   ///< by which the spectra become more concentrated
  bool clear = false;              ///< at one pose at least
  std::size_t period = 0, stride = 0;
};

void addTo(std::vector<double>& sum, const std::vector<double>& values) {
  sum.resize(std::max(sum.size(), values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) sum[i] += values[i];
}

/// Captures whose words break elsewhere than where they begin, by the word.
std::map<std::size_t, AlikeCaptures> capturesByBoundary(const SessionBytes& bytes) {
  const double tries = static_cast<double>(bytes.poses().size());
  std::map<std::size_t, AlikeCaptures> groups;
  for (const PoseWords& pose : bytes.poses()) {
    if (bytes.allSilent(pose) || !mayBeginWithin(bytes.stated(), pose.words)) continue;
    const std::optional<ChirpBoundary> found = findChirpBoundary(bytes.stated(), bytes.slots(), pose.words);
    if (!found) continue;
    AlikeCaptures& group = groups[found->word];
    group.period = found->period;
    group.stride = found->stride;
    group.nats += found->from_there.nats - found->from_the_start.nats;
    group.variance += found->from_there.variance + found->from_the_start.variance;
    group.clear = group.clear || found->breaksThere(tries);
    group.poses.push_back(pose.pose);
    addTo(group.smoothness, found->smoothness);
    addTo(group.breaks, found->breaks);
  }
  return groups;
}

constexpr std::size_t kNearSamples = 4;  ///< by which noise may displace a boundary

void merge(const AlikeCaptures& part, AlikeCaptures& group) {
  group.poses.insert(group.poses.end(), part.poses.begin(), part.poses.end());
  addTo(group.smoothness, part.smoothness);
  addTo(group.breaks, part.breaks);
  group.nats += part.nats;
  group.variance += part.variance;
  group.clear = group.clear || part.clear;
}

/// The word, a whole number of samples from `word`, at which the words of all captures together break most.
std::size_t commonWord(std::size_t word, const AlikeCaptures& group) {
  if (group.poses.size() < 2) return word;
  const std::size_t period = group.period, first = (word + period - kNearSamples * group.stride % period) % period;
  std::size_t best = word;
  for (std::size_t i = 0; i <= 2 * kNearSamples; ++i) {
    const std::size_t there = (first + i * group.stride) % period;
    if (group.breaks[there] > group.breaks[best]) best = there;
  }
  return best;
}

/// Noise displaces boundaries by some samples: these captures begin where most of their neighbours do.
std::map<std::size_t, AlikeCaptures> withoutStrays(std::map<std::size_t, AlikeCaptures> groups) {
  std::map<std::size_t, AlikeCaptures> kept;
  while (!groups.empty()) {
    const auto most = std::max_element(groups.begin(), groups.end(), [](const auto& a, const auto& b) {
      return a.second.poses.size() < b.second.poses.size();
    });
    const std::size_t word = most->first;
    AlikeCaptures group = std::move(most->second);
    groups.erase(most);
    for (auto other = groups.begin(); other != groups.end();) {
      const std::size_t apart = std::max(word, other->first) - std::min(word, other->first);
      const bool stray = apart <= kNearSamples * group.stride && apart % group.stride == 0 &&
                         other->second.poses.size() < group.poses.size();
      if (stray) merge(other->second, group);
      other = stray ? groups.erase(other) : std::next(other);
    }
    const std::size_t common = commonWord(word, group);
    AlikeCaptures& place = kept[common];
    place.poses.empty() ? (void)(place = std::move(group)) : merge(group, place);
  }
  return kept;
}

/// Bytes of a frame that are missing where captures begin with a word. Where the array does not tell, the fewest.
std::size_t missingBytes(const SessionBytes& bytes, std::size_t word, const AlikeCaptures& group) {
  const std::size_t loop = bytes.slots() * bytes.stated().words();
  std::size_t begin = word + (loop - 1 - word) / group.period * group.period;
  if (!group.smoothness.empty()) {
    const double most = *std::max_element(group.smoothness.begin(), group.smoothness.end());
    for (std::size_t i = 0; i < group.smoothness.size(); ++i) {
      if (group.smoothness[i] > most * (1 - kAlikeOrders)) begin = word + i * group.period;
    }
  }
  return 2 * (loop - begin);
}

/// True where the spectra of a capture speak for beginning with `word` rather than with `other`.
bool beginsRatherAt(const SessionBytes& bytes, const PoseWords& pose, std::size_t word, std::size_t other) {
  const std::size_t loop = bytes.slots() * bytes.stated().words();
  if (pose.words.size() < 2 * loop) return false;
  const std::size_t used = (pose.words.size() / loop - 1) * loop;
  const auto at = [&](std::size_t begin) {
    return concentrationOf(bytes.stated(), bytes.slots(), pose.words.data() + begin, used).nats;
  };
  return at(word) > at(other);
}

/// Captures that begin within a frame: by how many bytes, and of which poses.
std::map<std::string, std::size_t> findMisaligned(const SessionBytes& bytes) {
  const std::size_t poses = bytes.poses().size();
  const double least = leastDeviations(kMisalignedRate, static_cast<double>(std::max<std::size_t>(1, poses)));
  std::map<std::size_t, AlikeCaptures> groups = withoutStrays(capturesByBoundary(bytes));
  const AlikeCaptures* most = nullptr;
  std::size_t most_word = 0;
  std::map<std::string, std::pair<std::size_t, std::size_t>> found;  // word and missing bytes, by pose
  for (const auto& [word, group] : groups) {
    const bool common = 2 * group.poses.size() >= poses;
    // Spectra hardly tell a whole sample from the next: a session tells by most of its captures, or not at all.
    if (!common && std::min(word, group.period - word) <= kNearSamples * group.stride) continue;
    if (!group.clear && !(group.nats > least * std::sqrt(group.variance))) continue;
    for (const std::string& pose : group.poses) found[pose] = {word, missingBytes(bytes, word, group)};
    if (common) most = &group, most_word = word;
  }
  std::map<std::string, std::size_t> misaligned;
  for (const auto& [pose, begins] : found) misaligned[pose] = begins.second;
  if (most == nullptr) return misaligned;
  // What most captures do, the others do as well unless their spectra speak against it.
  for (const PoseWords& pose : bytes.poses()) {
    const auto known = found.find(pose.pose);
    const std::size_t own = known == found.end() ? 0 : known->second.first;
    if (bytes.allSilent(pose) || own == most_word || !beginsRatherAt(bytes, pose, most_word, own)) continue;
    misaligned[pose.pose] = missingBytes(bytes, most_word, *most);
  }
  return misaligned;
}

/// "pose '1': its capture begins 8 bytes into a frame", and how many others do.
std::string inWords(const std::map<std::string, std::size_t>& misaligned) {
  std::map<std::size_t, std::vector<std::string>> by_bytes;
  for (const auto& [pose, bytes] : misaligned) by_bytes[bytes].push_back(pose);
  const auto most = std::max_element(by_bytes.begin(), by_bytes.end(),
                                     [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
  const std::size_t alike = most->second.size() - 1, unlike = misaligned.size() - most->second.size();
  return "pose '" + most->second.front() + "': its capture begins " + std::to_string(most->first) +
         " bytes into a frame (packet_misalignment)" +
         (alike > 0 ? ", and so do those of " + std::to_string(alike) + " other pose(s)" : "") +
         (unlike > 0 ? ", elsewhere within one those of " + std::to_string(unlike) + " more" : "");
}

void alignCaptures(const SessionBytes& bytes, const CaptureCheckOptions& options, Recording& recording,
                   std::vector<std::string>& notes) {
  if (!recording.begins_within || !recording.captureOf) return;
  const std::map<std::string, std::size_t> misaligned = findMisaligned(bytes);
  if (misaligned.empty()) return;
  const std::string what = recording.source + ": " + inWords(misaligned);
  if (options.misaligned == CaptureCheckOptions::Misaligned::kRefused) {
    throw InputError(what +
                     "; give --align to read it from its first whole chirp on, or record it again (start the card "
                     "before the radar)");
  }
  recording.aligned_by_user = options.misaligned == CaptureCheckOptions::Misaligned::kAligned;
  *recording.begins_within = misaligned;
  notes.push_back(what + "; it is read from its first whole chirp on");
}

}  // namespace

std::vector<std::string> checkCaptures(Recording& recording, const CaptureCheckOptions& options) {
  SessionBytes bytes(recording);
  std::vector<std::string> notes = std::move(bytes.notes());
  leaveOutSilentPoses(bytes, recording);
  requireStatedReading(bytes, recording);
  alignCaptures(bytes, options, recording, notes);
  leaveOutSilentReceivers(bytes, recording, notes);
  return notes;
}

void leaveOutReceivers(const RadarConfig& recorded, RadarConfig& radar) {
  if (recorded.whole_line_rx_m.empty() || radar.rx_position_m != recorded.whole_line_rx_m) return;
  radar.rx_position_m = recorded.rx_position_m;
  radar.rx_enable = recorded.rx_enable;
  radar.whole_line_rx_m = recorded.whole_line_rx_m;
}

}  // namespace mmradartwin
