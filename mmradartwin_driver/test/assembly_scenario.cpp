#include "assembly_scenario.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "packet_stream.h"

namespace mmradartwin {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::uint64_t kEpoch = 7;  // of the only recording; any number

struct HandedOut {
  AdcCube cube;
  std::uint64_t epoch;
};

std::size_t between(std::mt19937_64& random, std::size_t low, std::size_t high) {
  return std::uniform_int_distribution<std::size_t>(low, high)(random);
}

/// A recording of any length. Drawn one by one: compilers order the arguments of a call as they like.
std::vector<ArrivingPacket> drawnPackets(std::mt19937_64& random, std::uint64_t epoch, std::uint64_t begin) {
  const std::size_t bytes = between(random, 1, 60000);
  const bool equal = random() % 2;
  return cutIntoPackets(random, epoch, begin, bytes, equal);
}

/// Bytes of `cube` that are not those of recording `epoch`; zeros count as lost where their chirp is not whole.
std::uint64_t misplacedBytes(const RadarConfig& radar, const AdcCube& cube, std::uint64_t epoch) {
  const std::uint64_t frame_bytes = radar.bytes_per_frame();
  std::uint64_t misplaced = 0;
  for (std::size_t word = 0; word < cube.data.size(); ++word) {
    const std::size_t at = byteOfWord(radar, word);
    if (cube.data[word] == 0 && !cube.chirp_valid[at * static_cast<std::size_t>(cube.chirps) / frame_bytes]) continue;
    const std::uint64_t byte = cube.sequence * frame_bytes + at;
    const auto value = static_cast<std::uint16_t>(cube.data[word]);
    misplaced += (value & 0xff) != streamByte(epoch, byte);
    misplaced += value >> 8 != streamByte(epoch, byte + 1);
  }
  return misplaced;
}

/// Bytes that are not in `arrived`, though the cube says that their chirp is whole or counts fewer lost ones.
std::uint64_t unflaggedBytes(const AdcCube& cube, const std::vector<bool>& arrived) {
  std::uint64_t missing = 0, in_whole_chirps = 0;
  for (std::size_t byte = 0; byte < arrived.size(); ++byte) {
    if (arrived[byte]) continue;
    ++missing;
    in_whole_chirps += cube.chirp_valid[byte * static_cast<std::size_t>(cube.chirps) / arrived.size()];
  }
  return std::max(in_whole_chirps, missing - std::min(missing, cube.lost_bytes));
}

void say(AssemblyScenario& result, const std::string& problem) {
  if (result.problem.empty()) result.problem = problem;
}

/// A frame of one recording: to the byte what the rule says.
void checkAgainstRule(const RadarConfig& radar, const AdcCube& cube, std::uint64_t frame,
                      const std::vector<bool>& arrived, AssemblyScenario& result) {
  const std::size_t bytes = radar.bytes_per_frame();
  const std::string name = "frame " + std::to_string(frame);
  if (cube.sequence != static_cast<std::uint32_t>(frame))
    say(result, name + " came as " + std::to_string(cube.sequence));
  if (cube.data.size() != bytes / 2 || cube.chirp_valid.size() != static_cast<std::size_t>(cube.chirps)) {
    return say(result, name + " has another size");
  }
  result.unflagged += unflaggedBytes(cube, arrived);
  std::vector<std::uint8_t> valid(cube.chirp_valid.size(), 1);
  for (std::size_t byte = 0; byte < bytes; ++byte) {
    if (!arrived[byte]) valid[byte * valid.size() / bytes] = 0;
  }
  const auto lost = static_cast<std::uint64_t>(std::count(arrived.begin(), arrived.end(), false));
  if (lost != cube.lost_bytes) say(result, name + " says " + std::to_string(cube.lost_bytes) + " bytes lost");
  if (valid != cube.chirp_valid) say(result, name + " flags other chirps");
  for (std::size_t word = 0; word < cube.data.size(); ++word) {
    const std::size_t at = byteOfWord(radar, word);
    const std::uint64_t byte = frame * bytes + at;
    const bool whole = arrived[at] && arrived[at + 1];
    const auto value = static_cast<std::uint16_t>(cube.data[word]);
    result.misplaced += (value & 0xff) != (whole ? streamByte(kEpoch, byte) : 0);
    result.misplaced += value >> 8 != (whole ? streamByte(kEpoch, byte + 1) : 0);
  }
}

void runOneRecording(std::mt19937_64& random, AssemblyScenario& result) {
  const RadarConfig radar = randomRadar(random);
  const std::uint64_t frame_bytes = radar.bytes_per_frame();
  FrameAssembler::Options options;
  options.window_frames = static_cast<int>(between(random, 2, 4));
  options.window_bytes = between(random, 0, 8000);
  options.window_packets = random() % 2 ? 64 : 0;
  std::vector<AdcCube> cubes;
  FrameAssembler assembler(
      radar, [&cubes](AdcCube&& cube) { cubes.push_back(std::move(cube)); }, options);

  const std::vector<std::uint64_t> begins = {
      0, 0, 0, 1456 * 100, (std::uint64_t{1} << 32) - 5000, (std::uint64_t{1} << 48) - 20000};
  const std::uint64_t begin = begins[random() % begins.size()];
  auto sent = drawnPackets(random, kEpoch, begin);
  Impairment how;
  const auto share = [&] { return random() % 2 ? std::uniform_real_distribution<double>(0, 0.3)(random) : 0.0; };
  how.loss = share();
  how.duplicate = share();
  how.reorder = share();
  how.truncate = share();
  how.depth = static_cast<int>(random() % 4 ? between(random, 1, 12) : between(random, 50, 200));
  how.spared = 4;  // confirm a recording whose first packet is lost, and show whether lengths vary
  if (begin <= options.plausible_gap_bytes && random() % 4 == 0) {
    sent.erase(sent.begin(), sent.begin() + static_cast<std::ptrdiff_t>(random() % sent.size()));
  }
  if (sent.size() < how.spared) return;

  ArrivalOracle oracle(frame_bytes, std::max({static_cast<std::uint64_t>(options.window_frames) * frame_bytes,
                                              std::uint64_t{options.window_bytes},
                                              static_cast<std::uint64_t>(options.window_packets) * 1462}));
  std::int64_t now_ns = 1'000'000'000;
  for (ArrivingPacket& packet : impair(random, sent, how)) {
    packet.stamp_ns = now_ns += 20'000;
    assembler.add(packet.view());
    oracle.arrive(packet.offset, packet.payload.size());
    ++result.packets;
    // Before anything is placed there are suspects alone, which a flush rejects.
    if (random() % 200 == 0 && begin <= options.plausible_gap_bytes && assembler.counters().bytes > 0) {
      assembler.flush();
      oracle.flush();
    }
  }
  assembler.flush();

  const FrameAssembler::Counters& counters = assembler.counters();
  if (counters.epochs != 1) say(result, "a restart was seen where there was none");
  if (oracle.frames().size() != cubes.size() || counters.frames != cubes.size()) {
    return say(result, std::to_string(cubes.size()) + " frames instead of " + std::to_string(oracle.frames().size()));
  }
  std::size_t i = 0;
  std::uint64_t received = 0;
  for (const auto& [frame, arrived] : oracle.frames()) {
    result.lost += cubes[i].lost_bytes;
    checkAgainstRule(radar, cubes[i++], frame, arrived, result);
    received += static_cast<std::uint64_t>(std::count(arrived.begin(), arrived.end(), true));
  }
  if (received != counters.bytes) say(result, "bytes are counted wrongly");
  result.frames = cubes.size();
  result.bytes = counters.bytes;
}

/// Whatever is handed out holds bytes of one recording only, in their places, the rest flagged; the frames of a
/// recording come in order and once, and so do the recordings.
void runRestarts(std::mt19937_64& random, AssemblyScenario& result) {
  const RadarConfig radar = randomRadar(random);
  const std::uint64_t frame_bytes = radar.bytes_per_frame();
  std::vector<HandedOut> handed_out;
  const FrameAssembler* counted = nullptr;
  FrameAssembler assembler(radar, [&](AdcCube&& cube) {
    handed_out.push_back({std::move(cube), counted->counters().epochs});
  });
  counted = &assembler;
  Impairment how;
  const bool impaired = random() % 3 != 0;
  if (impaired) {
    how.loss = how.duplicate = how.reorder = how.truncate = 0.1;
    how.depth = 4;
  }
  const std::size_t recordings = between(random, 2, 4);
  std::vector<std::map<std::uint64_t, std::vector<bool>>> arrived(recordings);
  std::uint64_t shortest = std::numeric_limits<std::uint64_t>::max(), sent = 0;
  std::int64_t now_ns = 1'000'000'000;
  for (std::size_t epoch = 0; epoch < recordings; ++epoch) {
    const auto cut = drawnPackets(random, epoch, 0);
    sent += cut.back().offset + cut.back().payload.size();
    const auto arriving = impair(random, cut, how);
    if (arriving.empty()) continue;
    // A recording whose first packet to arrive lies beyond the end of one before passes as its continuation; nothing
    // but being told of the arming helps there.
    if (arriving.front().offset >= shortest) assembler.restart();
    std::uint64_t end = 0;
    for (ArrivingPacket packet : arriving) {
      packet.stamp_ns = now_ns += 20'000;
      assembler.add(packet.view());
      ++result.packets;
      end = std::max(end, packet.offset + packet.payload.size());
      for (std::uint64_t byte = packet.offset; byte < packet.offset + packet.payload.size(); ++byte) {
        std::vector<bool>& frame = arrived[epoch][byte / frame_bytes];
        frame.resize(frame_bytes);
        frame[byte % frame_bytes] = true;
      }
    }
    shortest = std::min(shortest, end);
    now_ns += 100 * kMillisecond;
  }
  assembler.flush();

  std::size_t recording = 0;
  std::int64_t last_frame = -1;
  std::uint64_t counted_bytes = 0;
  for (std::size_t i = 0; i < handed_out.size(); ++i) {
    const AdcCube& cube = handed_out[i].cube;
    if (i > 0 && handed_out[i].epoch != handed_out[i - 1].epoch) last_frame = -1;
    if (static_cast<std::int64_t>(cube.sequence) <= last_frame) say(result, "frames out of order");
    last_frame = cube.sequence;
    // The recording that it fits best, none before the last one's: bytes of another one are misplaced. A frame of which
    // half a word came is all zeros and fits every recording; what arrived of each tells them apart.
    constexpr std::pair<std::uint64_t, std::uint64_t> kNone{0, 0};
    std::pair<std::uint64_t, std::uint64_t> fewest{std::numeric_limits<std::uint64_t>::max(), 0};
    std::size_t best = recording;
    for (std::size_t candidate = recording; candidate < recordings && fewest != kNone; ++candidate) {
      std::vector<bool>& there = arrived[candidate][cube.sequence];
      there.resize(frame_bytes);
      const auto wrong = std::pair(misplacedBytes(radar, cube, candidate), unflaggedBytes(cube, there));
      if (wrong < fewest) fewest = wrong, best = candidate;
    }
    recording = best;
    result.misplaced += fewest.first;
    result.unflagged += fewest.second;
    counted_bytes += frame_bytes - cube.lost_bytes;
    result.lost += cube.lost_bytes;
  }
  if (!impaired && sent != counted_bytes) say(result, "bytes that arrived were not handed out");
  if (counted_bytes != assembler.counters().bytes) say(result, "bytes are counted wrongly");
  result.frames = handed_out.size();
  result.bytes = assembler.counters().bytes;
}

}  // namespace

AssemblyScenario runAssemblyScenario(std::uint64_t seed) {
  std::mt19937_64 random(seed);
  AssemblyScenario result;
  if (seed % 3 == 2) {
    runRestarts(random, result);
  } else {
    runOneRecording(random, result);
  }
  return result;
}

}  // namespace mmradartwin
