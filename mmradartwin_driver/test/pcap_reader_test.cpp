#include "mmradartwin_driver/pcap_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_dsp/input_error.h"
#include "real_data.h"

namespace mmradartwin {
namespace {

/// What the sender's configuration must have been: one frame of 16384 bytes; packets of 1456 bytes came 0.97 or 1.94 ms
/// apart in just the order in which chirps of 1024 bytes, one every 0.972 ms, fill them. With four receivers on two
/// lanes a chirp of 1024 bytes has 64 complex samples; 16 chirps are 8 loops of 2 TX (or 16 of 1, which changes nothing
/// here).
RadarConfig radarOfTheCapture() {
  RadarConfig radar;
  radar.device = "iwr1843";
  radar.carrier_hz = 77e9;
  radar.slope_hz_per_s = 60e12;
  radar.samples_per_chirp = 64;
  radar.sample_rate_hz = 2.5e6;
  radar.adc_start_s = 6e-6;
  radar.idle_s = 912e-6;
  radar.ramp_end_s = 60e-6;
  radar.loops_per_frame = 8;
  radar.frame_period_s = 0.1;
  radar.tx_position_m.assign(2, Eigen::Vector3d::Zero());
  radar.rx_position_m.assign(4, Eigen::Vector3d::Zero());
  radar.layout = CaptureLayout::kTwoLane;
  return radar;
}

TEST(RealPcap, OneFrameWithoutLoss) {
  const std::string file = realData("dca1000_pcap/test_one_frame.pcap");
  SKIP_WITHOUT(file);
  std::vector<AdcCube> cubes;
  FrameAssembler assembler(radarOfTheCapture(), [&](AdcCube&& cube) { cubes.push_back(std::move(cube)); });
  std::vector<std::uint8_t> payload;
  std::vector<std::int64_t> stamps_ns;
  std::vector<std::uint16_t> statuses;
  PcapVisitor visitor;
  visitor.data = [&](const DataPacket& packet) {
    EXPECT_EQ(payload.size(), packet.byte_count);
    payload.insert(payload.end(), packet.payload, packet.payload + packet.size);
    stamps_ns.push_back(packet.stamp_ns);
    assembler.add(packet);
  };
  visitor.reply = [&](const Dca1000Reply& reply, std::int64_t) {
    if (reply.code == 0x0a) statuses.push_back(reply.status);
  };
  const PcapCounters counters = readPcap(file, visitor);
  EXPECT_EQ(18u, counters.frames);
  EXPECT_EQ(12u, counters.data);
  EXPECT_EQ(6u, counters.replies);
  EXPECT_EQ(0u, counters.other);
  EXPECT_EQ(std::vector<std::uint16_t>{kRecordCompleted}, statuses);

  ASSERT_EQ(16384u, payload.size());
  ASSERT_EQ(1u, cubes.size());  // complete, so it is handed out without a flush
  const AdcCube& cube = cubes.front();
  EXPECT_EQ(0u, cube.lost_bytes);
  EXPECT_EQ(0u, cube.sequence);
  EXPECT_EQ(std::vector<std::uint8_t>(16, 1), cube.chirp_valid);
  EXPECT_EQ(0u, assembler.counters().lost_bytes);
  EXPECT_EQ(16384u, assembler.counters().bytes);

  // Two lanes, SWRA581B figure 11: per chirp RX after RX, groups of I[n] I[n+1] Q[n] Q[n+1].
  const auto word = [&](std::size_t i) { return static_cast<std::int16_t>(payload[2 * i] | payload[2 * i + 1] << 8); };
  for (std::size_t chirp = 0; chirp < 16; ++chirp) {
    for (std::size_t n = 0; n < 64; ++n) {
      for (std::size_t rx = 0; rx < 4; ++rx) {
        const std::size_t group = ((chirp * 4 + rx) * 64 + (n & ~std::size_t{1})) * 2 + (n & 1);
        const std::size_t at = ((chirp * 64 + n) * 4 + rx) * 2;
        ASSERT_EQ(word(group), cube.data[at]);
        ASSERT_EQ(word(group + 2), cube.data[at + 1]);
      }
    }
  }

  // The first packet left when its last byte had been sampled: in the second chirp.
  const double sampled_s = 912e-6 + 6e-6 + 64 / 2.5e6;
  EXPECT_NEAR((0.972e-3 + sampled_s) * 1e9, static_cast<double>(stamps_ns.front() - cube.stamp_ns), 2);
}

TEST(RealPcap, RepliesOfARealCard) {
  const std::string file = realData("dca1000_pcap/test_cmd.pcap");
  SKIP_WITHOUT(file);
  std::vector<std::pair<int, int>> replies;
  PcapVisitor visitor;
  visitor.reply = [&](const Dca1000Reply& reply, std::int64_t) { replies.emplace_back(reply.code, reply.status); };
  const PcapCounters counters = readPcap(file, visitor);
  EXPECT_EQ(0u, counters.data);
  const std::vector<std::pair<int, int>> expected = {{0x01, 0}, {0x02, 0}, {0x05, 0}, {0x06, 0}, {0x0b, 0},
                                                     {0x03, 0}, {0x04, 0}, {0x09, 0}, {0x0a, 0}, {0x0e, 0x0402}};
  EXPECT_EQ(expected, replies);
}

TEST(Pcap, SaysWhatIsWrongWithTheFile) {
  EXPECT_THROW(readPcap("/nowhere/none.pcap", {}), InputError);
  const std::string file = (std::filesystem::temp_directory_path() / "mmradartwin_not_a.pcap").string();
  std::ofstream(file) << "this is no capture";
  EXPECT_THROW(readPcap(file, {}), InputError);
  std::filesystem::remove(file);
}

TEST(Pcap, CutShortGivesWhatIsWholeAndThenSaysSo) {
  const std::string whole = realData("dca1000_pcap/test_one_frame.pcap");
  SKIP_WITHOUT(whole);
  std::ifstream in(whole, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  const std::string file = (std::filesystem::temp_directory_path() / "mmradartwin_cut.pcap").string();
  std::ofstream(file, std::ios::binary) << bytes.substr(0, 10000);
  int packets = 0;
  PcapVisitor visitor;
  visitor.data = [&](const DataPacket&) { ++packets; };
  EXPECT_THROW(readPcap(file, visitor), InputError);
  // 24 bytes of file header, 5 replies of 16 + 60, then data packets of 16 + 1508 bytes: six are whole.
  EXPECT_EQ(6, packets);
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace mmradartwin
