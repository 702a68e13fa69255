// Packets recorded by the rig, and made a capture of again.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>

#include "emulated_rig.h"
#include "mmradartwin_driver/packet_replay.h"
#include "mmradartwin_driver/pcap_capture.h"
#include "mmradartwin_driver/pcap_reader.h"
#include "mmradartwin_driver/pcap_writer.h"
#include "mmradartwin_driver/rig.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/input_error.h"
#include "real_data.h"

namespace mmradartwin {
namespace {

sockaddr_in endpoint(const char* ip, std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  inet_aton(ip, &address.sin_addr);
  return address;
}

/// Sequence number from 1 and byte count, then samples.
std::vector<std::uint8_t> dataDatagram(std::uint32_t sequence, std::uint64_t count, const std::uint8_t* bytes,
                                       std::size_t size) {
  std::vector<std::uint8_t> datagram;
  for (int i = 0; i < 4; ++i) datagram.push_back(static_cast<std::uint8_t>(sequence >> 8 * i));
  for (int i = 0; i < 6; ++i) datagram.push_back(static_cast<std::uint8_t>(count >> 8 * i));
  datagram.insert(datagram.end(), bytes, bytes + size);
  return datagram;
}

/// Records `bytes` in packets of 1456, without those whose numbers are listed.
void recordPackets(const std::string& file, const std::vector<std::uint8_t>& bytes,
                   const std::vector<std::uint32_t>& without) {
  PcapWriter writer(file);
  std::uint32_t sequence = 1;
  for (std::size_t at = 0; at < bytes.size(); at += 1456, ++sequence) {
    if (std::count(without.begin(), without.end(), sequence)) continue;
    const auto datagram = dataDatagram(sequence, at, &bytes[at], std::min<std::size_t>(1456, bytes.size() - at));
    writer.add({endpoint("192.168.33.180", 1024), endpoint("192.168.33.30", 4098), datagram.data(), datagram.size(),
                1'700'000'000'000'000'000 + sequence * 100'000});
  }
}

TEST(PcapWriter, WritesWhatTheWireCarries) {
  TestFolder folder;
  {
    PcapWriter writer(folder.file("a.pcap"));
    const std::uint8_t reply[] = {0x5a, 0xa5, 0x09, 0x00, 0x00, 0x00, 0xaa, 0xee};
    writer.add({endpoint("192.168.33.180", 1024), endpoint("192.168.33.30", 4096), reply, sizeof reply,
                1'700'000'000'123'456'789});
    writer.flush();
    EXPECT_EQ(1u, writer.written());
  }
  // File and record head by the format's description; the frame from a real card's: see the other fields there.
  const std::vector<std::uint8_t> expected = {
      0x4d, 0x3c, 0xb2, 0xa1, 2,    0,    4,    0,    0,    0,    0,    0,    0,    0,    0,   0,  0xff,
      0xff, 0,    0,    1,    0,    0,    0,  // nanoseconds, Ethernet
      0x00, 0xf1, 0x53, 0x65, 0x15, 0xcd, 0x5b, 0x07, 50,   0,    0,    0,    50,   0,    0,   0,  0x02,
      0,    0,    0,    0,    0x01, 0x12, 0x34, 0x56, 0x78, 0x90, 0x12, 0x08, 0x00, 0x45, 0,   0,  36,
      0,    0,    0x40, 0,    255,  17,   0xb7, 0x8b, 192,  168,  33,   180,  192,  168,  33,  30, 0x04,
      0x00, 0x10, 0x00, 0,    16,   0,    0,    0x5a, 0xa5, 0x09, 0x00, 0x00, 0x00, 0xaa, 0xee};
  const std::vector<std::uint8_t> bytes = readBytes(folder.file("a.pcap"));
  ASSERT_EQ(expected.size(), bytes.size());
  std::uint32_t sum = 0;  // the receiver's check: the header adds up to all ones
  for (int i = 0; i < 20; i += 2) sum += static_cast<std::uint32_t>(bytes[54 + i] << 8 | bytes[55 + i]);
  EXPECT_EQ(0xffffu, (sum >> 16) + (sum & 0xffff));
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i == 64 || i == 65) continue;  // that checksum
    EXPECT_EQ(expected[i], bytes[i]) << "byte " << i;
  }
  PcapVisitor visitor;
  visitor.reply = [](const Dca1000Reply& reply, std::int64_t stamp_ns) {
    EXPECT_EQ(9, reply.code);
    EXPECT_EQ(1'700'000'000'123'456'789, stamp_ns);
  };
  EXPECT_EQ(1u, readPcap(folder.file("a.pcap"), visitor).replies);
}

TEST(PcapWriter, KeepsToItsWordAboutFiles) {
  TestFolder folder;
  EXPECT_THROW(PcapWriter("/nowhere/a.pcap"), InputError);
  writeText(folder.file("a.pcap"), "old");
  EXPECT_THROW(PcapWriter(folder.file("a.pcap")), InputError);
  const PcapWriter stamped(folder.file("a_{stamp}.pcap"));
  EXPECT_EQ(std::string::npos, stamped.file().find('{'));
}

TEST(PcapWriter, SaysThatTheDiskIsFull) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "/dev/full is missing";
  PcapWriter writer("/dev/full");
  const std::vector<std::uint8_t> datagram(1466);
  writer.add({endpoint("127.0.0.1", 1024), endpoint("127.0.0.1", 4098), datagram.data(), datagram.size(), 1});
  writer.flush();
  EXPECT_NE(std::string::npos, writer.problem().find("No space left")) << writer.problem();
  EXPECT_EQ(0u, writer.written());
  EXPECT_EQ(1u, writer.left_out());
  writer.add({endpoint("127.0.0.1", 1024), endpoint("127.0.0.1", 4098), datagram.data(), datagram.size(), 2});
  EXPECT_EQ(2u, writer.left_out());
}

TEST(PcapWriter, LeavesSpaceOnTheDisk) {
  TestFolder folder;
  const std::string file = folder.file("a.pcap");
  PcapWriter writer(file, 1 << 20, std::uint64_t{1} << 62);  // more than any disk has
  const std::vector<std::uint8_t> datagram(1466);
  for (int i = 0; i < 3; ++i) {
    writer.add({endpoint("127.0.0.1", 1024), endpoint("127.0.0.1", 4098), datagram.data(), datagram.size(), i});
    writer.flush();
  }
  EXPECT_NE(std::string::npos, writer.problem().find("ends after 1 packets (less than")) << writer.problem();
  EXPECT_NE(std::string::npos, writer.problem().find("what it holds is whole")) << writer.problem();
  EXPECT_EQ(1u, writer.written());
  EXPECT_EQ(2u, writer.left_out());
  EXPECT_EQ(1u, readPcap(file, PcapVisitor()).frames);
}

TEST(PcapCapture, NamesFramesWithLosses) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const std::string random = randomBytes(20 * 2048, 7);
  const std::vector<std::uint8_t> sent(random.begin(), random.end());
  // Packet 4 holds bytes 4368 to 5823: the tail of frame 2's first chirp (from 4096) and 704 bytes of its second.
  // Packets 8 to 11 hold 10192 to 16015: frames 5, 6 and in part 4 and 7.
  recordPackets(folder.file("a.pcap"), sent, {4, 8, 9, 10, 11});
  const PcapCapture capture = pcapToCapture(folder.file("a.pcap"), radar, folder.file("a.bin"));
  ASSERT_EQ(20u, capture.frames);
  const std::vector<std::uint8_t> got = readBytes(folder.file("a.bin"));
  ASSERT_EQ(sent.size(), got.size());
  std::size_t wrong = 0;
  for (std::size_t i = 0; i < sent.size(); ++i) {
    const bool lost = (i >= 4368 && i < 5824) || (i >= 10192 && i < 16016);
    wrong += got[i] != (lost ? 0 : sent[i]) ? 1 : 0;
  }
  EXPECT_EQ(0u, wrong);
  std::map<std::uint64_t, std::pair<std::uint64_t, std::vector<int>>> flaws;
  for (const CaptureFlaw& flaw : capture.flaws) flaws[flaw.frame] = {flaw.lost_bytes, flaw.chirps};
  const decltype(flaws) expected = {
      {2, {1456, {0, 1}}}, {4, {48, {1}}}, {5, {2048, {0, 1}}}, {6, {2048, {0, 1}}}, {7, {16016 - 14336, {0, 1}}}};
  EXPECT_EQ(expected, flaws);
  EXPECT_EQ(1u, capture.recordings.size());
}

TEST(PcapCapture, RefusesHolesThatDwarfTheSamples) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const std::vector<std::uint8_t> samples(1024);
  {
    PcapWriter writer(folder.file("a.pcap"));
    // Each leap of 61 MB comes with packets enough to be believed, and is less than the hole that ends a recording.
    for (std::uint32_t leap = 0; leap < 20; ++leap) {
      for (std::uint32_t i = 0; i < 8; ++i) {
        const std::uint32_t packet = leap * 60'000 + i;
        const auto datagram = dataDatagram(packet + 1, std::uint64_t{1024} * packet, samples.data(), samples.size());
        writer.add({endpoint("192.168.33.180", 1024), endpoint("192.168.33.30", 4098), datagram.data(), datagram.size(),
                    1'700'000'000'000'000'000 + packet * 100'000LL});
      }
    }
  }
  try {
    pcapToCapture(folder.file("a.pcap"), radar, folder.file("a.bin"));
    FAIL();
  } catch (const InputError& error) {
    const std::string said = error.what();
    EXPECT_NE(said.find("a.pcap: the counts of its packets leave out "), std::string::npos) << said;
  }
  EXPECT_LT(std::filesystem::file_size(folder.file("a.bin")), 64u << 20);
}

TEST(PcapCapture, BeginsWithTheFileWhereTheRecordingWasUnderWay) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const std::string random = randomBytes(20 * 2048, 8);
  const std::vector<std::uint8_t> sent(random.begin(), random.end());
  // The eighth packet begins 48 bytes before the end of frame 4.
  recordPackets(folder.file("a.pcap"), sent, {1, 2, 3, 4, 5, 6, 7});
  const PcapCapture capture = pcapToCapture(folder.file("a.pcap"), radar, folder.file("a.bin"));
  EXPECT_EQ(4u, capture.before_file);
  EXPECT_EQ(16u, capture.frames);
  ASSERT_EQ(1u, capture.flaws.size());
  EXPECT_EQ(0u, capture.flaws[0].frame);
  EXPECT_EQ(2000u, capture.flaws[0].lost_bytes);
  std::vector<std::uint8_t> expected(sent.begin() + 4 * 2048, sent.end());
  std::fill(expected.begin(), expected.begin() + 2000, std::uint8_t{0});
  EXPECT_EQ(expected, readBytes(folder.file("a.bin")));
  EXPECT_NEAR(1.7e18 + 8e5, static_cast<double>(capture.first_stamp_ns), 0.3e9);
}

TEST(PcapCapture, TakesRecordingsApart) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const std::string random = randomBytes(9 * 2048, 8);
  const std::vector<std::uint8_t> sent(random.begin(), random.end());
  {
    PcapWriter writer(folder.file("a.pcap"));
    const sockaddr_in card = endpoint("192.168.33.180", 1024), host = endpoint("192.168.33.30", 4098);
    const sockaddr_in host_config = endpoint("192.168.33.30", 4096);
    std::int64_t stamp_ns = 1'700'000'000'000'000'000;
    for (int recording = 0; recording < 2; ++recording) {
      const std::uint8_t start[] = {0x5a, 0xa5, 0x05, 0x00, 0x00, 0x00, 0xaa, 0xee};
      writer.add({card, host_config, start, sizeof start, stamp_ns += 1'000'000});
      // The first ends 48 bytes before a frame's end, the second with a frame's.
      const std::size_t begin = recording == 0 ? 0 : 5 * 2048, end = recording == 0 ? 10192 : 9 * 2048;
      std::uint32_t sequence = 1;
      for (std::size_t at = begin; at < end; at += 1456, ++sequence) {
        const auto datagram = dataDatagram(sequence, at - begin, &sent[at], std::min<std::size_t>(1456, end - at));
        writer.add({card, host, datagram.data(), datagram.size(), stamp_ns += 1'000'000});
      }
    }
  }
  const PcapCapture capture = pcapToCapture(folder.file("a.pcap"), radar, folder.file("a.bin"));
  EXPECT_EQ((std::vector<std::uint64_t>{0, 4}), capture.recordings);
  EXPECT_EQ(std::vector<std::uint64_t>{2000}, capture.cut_off);
  EXPECT_TRUE(capture.flaws.empty());
  std::vector<std::uint8_t> expected(sent.begin(), sent.begin() + 4 * 2048);
  expected.insert(expected.end(), sent.begin() + 5 * 2048, sent.end());
  EXPECT_EQ(expected, readBytes(folder.file("a.bin")));
}

/// Two cards that send to one host at the same time; of the first, packets 5, 9 and 10 are lost.
class TwoCards : public ::testing::Test {
 protected:
  void SetUp() override {
    writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
    const std::string random = randomBytes(60 * 2048, 10);
    for (std::size_t card = 0; card < 2; ++card) {
      sent[card].assign(random.begin() + static_cast<std::ptrdiff_t>(card * 30 * 2048),
                        random.begin() + static_cast<std::ptrdiff_t>((card + 1) * 30 * 2048));
    }
    PcapWriter writer(folder.file("a.pcap"));
    const std::uint8_t start[] = {0x5a, 0xa5, 0x05, 0x00, 0x00, 0x00, 0xaa, 0xee};
    std::int64_t stamp_ns = 1'700'000'000'000'000'000;
    writer.add({endpoint(kCards[0], 1024), endpoint("192.168.33.30", 4096), start, sizeof start, stamp_ns});
    const auto send = [&](std::size_t card, std::uint32_t sequence) {
      const std::size_t at = (sequence - 1) * 1456;
      if (sequence == 0 || at >= sent[card].size()) return;
      const auto datagram =
          dataDatagram(sequence, at, &sent[card][at], std::min<std::size_t>(1456, sent[card].size() - at));
      writer.add({endpoint(kCards[card], 1024), endpoint("192.168.33.30", 4098), datagram.data(), datagram.size(),
                  stamp_ns += 500'000});
    };
    for (std::uint32_t sequence = 1; sequence <= 45; ++sequence) {
      if (sequence != 5 && sequence != 9 && sequence != 10) send(0, sequence);
      // The second card is armed while the first one sends.
      if (sequence == 3) {
        writer.add({endpoint(kCards[1], 1024), endpoint("192.168.33.30", 4096), start, sizeof start, stamp_ns});
      }
      if (sequence >= 3) send(1, sequence - 2);
    }
  }
  /// Status of the program, and what it says.
  std::pair<int, std::string> run(const std::string& arguments) const {
    const std::string command = std::string(MMRADARTWIN_PCAP_TO_CAPTURE) + " " + folder.file("a.pcap") + " --radar " +
                                folder.file("radar.yaml") + " --output " + folder.file("a.bin") + " " + arguments +
                                " >" + folder.file("log") + " 2>&1";
    const int status = WEXITSTATUS(std::system(command.c_str()));
    const std::vector<std::uint8_t> log = readBytes(folder.file("log"));
    return {status, std::string(log.begin(), log.end())};
  }

  static constexpr const char* kCards[] = {"192.168.33.180", "192.168.33.181"};
  TestFolder folder;
  std::vector<std::uint8_t> sent[2];
};

TEST_F(TwoCards, AreAskedFor) {
  const auto [status, log] = run("");
  EXPECT_EQ(2, status);
  EXPECT_NE(std::string::npos, log.find("2 cards: 192.168.33.180 (40 packets), 192.168.33.181 (43 packets)")) << log;
  EXPECT_NE(std::string::npos, log.find("--card-ip")) << log;
  EXPECT_FALSE(std::filesystem::exists(folder.file("a.bin")));
  const auto [other_status, other_log] = run("--card-ip 192.168.33.182");
  EXPECT_EQ(2, other_status);
  EXPECT_NE(std::string::npos, other_log.find("no packet of samples from 192.168.33.182")) << other_log;
  EXPECT_EQ(2, run("--card-ip 192.168.33.x").first);
  EXPECT_THROW(replayPackets(folder.file("a.pcap"), {}), InputError);
}

TEST_F(TwoCards, AreTakenApart) {
  const auto [status, log] = run("--card-ip 192.168.33.180");
  EXPECT_EQ(2, status);
  EXPECT_NE(std::string::npos, log.find("30 frame(s)")) << log;
  EXPECT_NE(std::string::npos, log.find("3 packets lost")) << log;
  std::vector<std::uint8_t> expected = sent[0];
  for (const std::ptrdiff_t lost : {4, 8, 9}) {
    std::fill(expected.begin() + lost * 1456, expected.begin() + (lost + 1) * 1456, std::uint8_t{0});
  }
  EXPECT_TRUE(expected == readBytes(folder.file("a.bin")));
  const auto [whole_status, whole_log] = run("--card-ip 192.168.33.181 --force");
  EXPECT_EQ(0, whole_status);
  EXPECT_NE(std::string::npos, whole_log.find("30 frame(s)")) << whole_log;
  EXPECT_NE(std::string::npos, whole_log.find("0 with losses\n")) << whole_log;
  EXPECT_TRUE(sent[1] == readBytes(folder.file("a.bin")));
}

TEST(PcapCapture, CountsLostPacketsOfLateAndDoubledOnes) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const std::string random = randomBytes(20 * 2048, 11);
  const std::vector<std::uint8_t> sent(random.begin(), random.end());
  {
    PcapWriter writer(folder.file("a.pcap"));
    std::int64_t stamp_ns = 1'700'000'000'000'000'000;
    // The file begins with packet 2; 5 comes after 7, 8 twice, 11 and 12 never.
    for (const std::uint32_t sequence : {2, 3, 4, 6, 7, 5, 8, 8, 9, 10, 13, 14, 15}) {
      const std::size_t at = (sequence - 1) * 1456;
      const auto datagram = dataDatagram(sequence, at, &sent[at], 1456);
      writer.add({endpoint("192.168.33.180", 1024), endpoint("192.168.33.30", 4098), datagram.data(), datagram.size(),
                  stamp_ns += 100'000});
    }
  }
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  EXPECT_EQ(2u, pcapToCapture(folder.file("a.pcap"), radar, folder.file("a.bin")).lost_packets);
}

TEST(PcapCapture, SaysThatThereAreNoSamples) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  recordPackets(folder.file("a.pcap"), {}, {});
  EXPECT_THROW(pcapToCapture(folder.file("a.pcap"), loadRadarConfig(folder.file("radar.yaml")), folder.file("a.bin")),
               InputError);
}

TEST(PacketReplay, ComesThroughTheDriverWithItsLosses) {
  TestFolder folder;
  writeText(folder.file("radar.yaml"), paperRadarYaml(0.05));
  const RadarConfig radar = loadRadarConfig(folder.file("radar.yaml"));
  const std::string random = randomBytes(20 * 2048, 9);
  std::vector<std::uint8_t> bytes(random.begin(), random.end());
  // As above: frames 5 and 6 are gone altogether, 2, 4 and 7 have holes.
  recordPackets(folder.file("a.pcap"), bytes, {4, 8, 9, 10, 11});
  std::fill(bytes.begin() + 4368, bytes.begin() + 5824, std::uint8_t{0});
  std::fill(bytes.begin() + 10192, bytes.begin() + 16016, std::uint8_t{0});
  const std::map<std::uint64_t, std::uint64_t> lost = {{2, 1456}, {4, 48}, {7, 1680}};
  std::mutex mutex;
  std::vector<AdcCube> cubes;
  RigOptions options;
  options.host_ip = loopbackIp(1);
  options.card_ip = loopbackIp(2);
  options.configure_card = false;
  const Rig rig(
      radar, options,
      [&](AdcCube&& cube) {
        const std::lock_guard<std::mutex> lock(mutex);
        cubes.push_back(std::move(cube));
      },
      [](Rig::Level, const std::string&) {});
  ASSERT_TRUE(waitUntil([&] { return rig.state().armings == 1; }));
  const auto replay = [&](const std::string& file) {
    return WEXITSTATUS(std::system((std::string(MMRADARTWIN_REPLAY_PACKETS) + " " + folder.file(file) + " --host-ip " +
                                    options.host_ip + " --card-ip " + options.card_ip + " --rate 0.05 2>/dev/null")
                                       .c_str()));
  };
  EXPECT_EQ(2, replay("none.pcap"));
  ASSERT_EQ(0, replay("a.pcap"));
  EXPECT_TRUE(waitUntil([&] {
    const std::lock_guard<std::mutex> lock(mutex);
    return cubes.size() == 18;
  }));
  const std::lock_guard<std::mutex> lock(mutex);
  ASSERT_EQ(18u, cubes.size());
  for (std::size_t i = 0; i < cubes.size(); ++i) {
    const std::uint64_t frame = cubes[i].sequence;
    EXPECT_EQ(i < 5 ? i : i + 2, frame);
    std::vector<std::int16_t> expected;
    decodeFrame(radar, bytes.data() + frame * 2048, expected);
    EXPECT_EQ(expected, cubes[i].data) << frame;
    EXPECT_EQ(lost.count(frame) ? lost.at(frame) : 0, cubes[i].lost_bytes) << frame;
  }
  EXPECT_EQ(29u - 5, rig.state().packets.packets);
}

/// Emulator -> rig -> pcap -> capture.
void roundTrip(const TestFolder& folder, const std::string& session, const RadarConfig& radar,
               const std::vector<std::uint8_t>& sent, std::size_t frames) {
  EmulatorProcess emulator(
      loopbackIp(1), loopbackIp(2),
      {session, "--radar", folder.file("radar.yaml"), "--start-delay-s", "0.1", "--flush-s", "0.2", "--deaf-s", "0.1"});
  const std::size_t packets = (sent.size() + 1455) / 1456;
  std::atomic<std::size_t> cubes{0};
  {
    RigOptions options;
    options.host_ip = loopbackIp(1);
    options.card_ip = loopbackIp(2);
    options.record_pcap = folder.file("packets.pcap");
    const Rig rig(
        radar, options, [&](AdcCube&&) { ++cubes; }, [](Rig::Level, const std::string&) {});
    EXPECT_TRUE(waitUntil([&] { return cubes >= frames; }));
    ASSERT_TRUE(emulator.waitFor("completed"));
    EXPECT_TRUE(waitUntil([&] { return rig.state().packets.packets >= packets; }));
  }
  ASSERT_EQ(frames, cubes);
  PcapVisitor visitor;
  std::vector<int> codes;
  visitor.reply = [&](const Dca1000Reply& reply, std::int64_t) { codes.push_back(reply.code); };
  const PcapCounters counters = readPcap(folder.file("packets.pcap"), visitor);
  EXPECT_EQ(packets, counters.data);
  EXPECT_TRUE(std::count(codes.begin(), codes.end(), 0x05)) << "RECORD_START is not in the recording";

  const std::string command = std::string(MMRADARTWIN_PCAP_TO_CAPTURE) + " " + folder.file("packets.pcap") +
                              " --radar " + folder.file("radar.yaml") + " --output " + folder.file("again.bin") +
                              " 2>" + folder.file("log");
  EXPECT_EQ(0, std::system(command.c_str()));
  EXPECT_TRUE(sent == readBytes(folder.file("again.bin"))) << "the capture made of the packets is another one";
}

TEST(PcapRecording, RoundTripOfASession) {
  TestFolder folder;
  writeSession(folder, 0.01, {40});
  roundTrip(folder, folder.file("captures/a.bin"), loadRadarConfig(folder.file("radar.yaml")),
            readBytes(folder.file("captures/a.bin")), 40);
}

TEST(PcapRecording, RoundTripOfARealCapture) {
  const std::string capture = realData("openradar_indoor/xwr22xx_4lane_adc_data.bin");
  SKIP_WITHOUT(capture);
  TestFolder folder;
  // The chirp as the data's README tells it; one frame of 128 loops.
  writeText(folder.file("radar.yaml"),
            "device: iwr1642\ncarrier_hz: 77.4201e+9\nslope_hz_per_s: 60.0e+12\nsamples_per_chirp: 128\n"
            "sample_rate_hz: 2.5e+6\nadc_start_s: 7.0e-6\nloops_per_frame: 128\nframe_period_s: 0.1\n"
            "idle_s: 30.0e-6\nramp_end_s: 62.0e-6\ntx_position_m: [[0, 0, 0], [0, 0.0077, 0]]\n"
            "rx_position_m: [[0, 0, 0], [0, 0.0019, 0], [0, 0.0038, 0], [0, 0.0057, 0]]\n");
  roundTrip(folder, capture, loadRadarConfig(folder.file("radar.yaml")), readBytes(capture), 1);
}

}  // namespace
}  // namespace mmradartwin
