#include "mmradartwin_driver/dca1000_protocol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

std::string hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  char digits[3];
  for (const std::uint8_t byte : bytes) {
    std::snprintf(digits, sizeof digits, "%02x", byte);
    text += digits;
  }
  return text;
}

// Bytes as TI's own tools put them on the wire.
TEST(Dca1000Commands, GoldenBytes) {
  EXPECT_EQ("5aa509000000aaee", hex(encodeCommand(Dca1000Command::kSystemConnect)));
  EXPECT_EQ("5aa505000000aaee", hex(encodeCommand(Dca1000Command::kRecordStart)));
  EXPECT_EQ("5aa506000000aaee", hex(encodeCommand(Dca1000Command::kRecordStop)));
  EXPECT_EQ("5aa501000000aaee", hex(encodeCommand(Dca1000Command::kResetFpga)));
  EXPECT_EQ("5aa50e000000aaee", hex(encodeCommand(Dca1000Command::kReadFpgaVersion)));
  EXPECT_EQ("5aa50300060001010102031eaaee", hex(encodeCommand(Dca1000Command::kConfigFpga, fpgaConfigBody(4))));
  EXPECT_EQ("5aa50300060001020102031eaaee", hex(encodeCommand(Dca1000Command::kConfigFpga, fpgaConfigBody(2))));
  EXPECT_EQ("5aa50b000600be05350c0000aaee",
            hex(encodeCommand(Dca1000Command::kConfigPacketData, packetConfigBody(1470, packetDelayTicks(25)))));
  EXPECT_EQ("5aa50b000600c005350c0000aaee",
            hex(encodeCommand(Dca1000Command::kConfigPacketData, packetConfigBody(1472, packetDelayTicks(25)))));
}

TEST(Dca1000Commands, DelayIsInTicksOf8ns) {
  EXPECT_EQ(0x0271, packetDelayTicks(5));
  EXPECT_EQ(0x0c35, packetDelayTicks(25));
  EXPECT_EQ(65535, packetDelayTicks(524.28));
  EXPECT_THROW(packetDelayTicks(524.29), InputError);
  EXPECT_THROW(packetDelayTicks(-0.01), InputError);
  EXPECT_THROW(packetDelayTicks(std::nan("")), InputError);
  EXPECT_THROW(fpgaConfigBody(3), InputError);
}

TEST(Dca1000Replies, StatusAndVersion) {
  const std::uint8_t completed[] = {0x5a, 0xa5, 0x0a, 0x00, 0x00, 0x01, 0xaa, 0xee};
  const auto reply = decodeReply(completed, sizeof completed);
  ASSERT_TRUE(reply);
  EXPECT_EQ(0x0a, reply->code);
  EXPECT_EQ(kRecordCompleted, reply->status);
  EXPECT_EQ("REC_COMPLETED", describeStatus(reply->status));
  EXPECT_EQ("DDR_FULL, LVDS_BUFFER_FULL", describeStatus(kFatalStatus));
  EXPECT_EQ("NO_LVDS_DATA, 0x8000", describeStatus(0x8001));

  const FpgaVersion version = decodeFpgaVersion(0x0402);
  EXPECT_EQ(2, version.major);
  EXPECT_EQ(8, version.minor);
  EXPECT_FALSE(version.playback);
  EXPECT_EQ("", versionAdvice(version));
  EXPECT_EQ("FPGA 2.8", describeVersion(version));
  EXPECT_TRUE(decodeFpgaVersion(0x4402).playback);
  EXPECT_NE(std::string::npos, versionAdvice(decodeFpgaVersion(0x4402)).find("record image"));
  EXPECT_NE(std::string::npos, versionAdvice(decodeFpgaVersion(0x0102)).find("2.7 to 2.9"));
}

TEST(Dca1000Replies, RefusesWhatIsNone) {
  std::vector<std::uint8_t> good = {0x5a, 0xa5, 0x09, 0x00, 0x00, 0x00, 0xaa, 0xee};
  EXPECT_TRUE(decodeReply(good.data(), good.size()));
  EXPECT_FALSE(decodeReply(good.data(), 7));
  for (const std::size_t at : {0u, 1u, 6u, 7u}) {
    std::vector<std::uint8_t> bad = good;
    bad[at] ^= 0x10;
    EXPECT_FALSE(decodeReply(bad.data(), bad.size())) << at;
  }
  good.push_back(0);
  EXPECT_FALSE(decodeReply(good.data(), good.size()));
}

TEST(DataPackets, HeadIsLittleEndianWith48BitCount) {
  const std::uint8_t bytes[] = {0x04, 0x03, 0x02, 0x01, 0x16, 0x15, 0x14, 0x13, 0x12, 0x11, 0xab, 0xcd};
  const auto packet = decodeDataPacket(bytes, sizeof bytes, 42);
  ASSERT_TRUE(packet);
  EXPECT_EQ(0x01020304u, packet->sequence);
  EXPECT_EQ(0x111213141516u, packet->byte_count);
  EXPECT_EQ(2u, packet->size);
  EXPECT_EQ(bytes + 10, packet->payload);
  EXPECT_EQ(42, packet->stamp_ns);
  EXPECT_FALSE(decodeDataPacket(bytes, 10, 0));
}

}  // namespace
}  // namespace mmradartwin
