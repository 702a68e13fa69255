#include "mmradartwin_driver/mmwavelink_frame.h"

#include <gtest/gtest.h>

#include <random>
#include <stdexcept>
#include <string>

#include "interface_bytes.h"

namespace mmradartwin {
namespace {

using Bytes = std::vector<std::uint8_t>;

MmwaveLinkMessage sensorStart() {
  MmwaveLinkMessage message;
  message.message_id = 0x0A;
  message.sequence = 1;
  message.sub_blocks = {{0x0140, {1, 0, 0, 0}}};
  return message;
}

TEST(MmwaveLinkFrame, ChecksumOfTheInterfaceDocument) {
  const std::uint16_t words[5] = {0x0281, 0x0800, 0x040C, 0x0000, 0x0001};
  EXPECT_EQ(internetChecksum(words, 5), 0xF171);
}

TEST(MmwaveLinkFrame, PublishedCheckValuesOfTheCrcs) {
  const std::string text = "123456789";
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
  EXPECT_EQ(crc32(bytes, 9), 0xCBF43926u);
  EXPECT_EQ(crc16(bytes, 9), 0x29B1);
}

TEST(MmwaveLinkFrame, SensorStart) { EXPECT_EQ(encodeMessage(sensorStart()), sensorStartBytes()); }

TEST(MmwaveLinkFrame, FlagsOfRetryAndOfNoAcknowledgement) {
  MmwaveLinkMessage message = sensorStart();
  message.sequence = 0;
  message.crc = MmwaveLinkCrc::k16;
  message.retry = true;
  EXPECT_EQ(encodeMessage(message)[8], 0x03);
  EXPECT_EQ(encodeMessage(message)[9], 0x00);
  message.retry = false;
  message.wants_acknowledgement = false;
  message.crc = MmwaveLinkCrc::kNone;
  EXPECT_EQ(encodeMessage(message)[8], 0x0C);
  EXPECT_EQ(encodeMessage(message)[9], 0x03);
}

TEST(MmwaveLinkFrame, PadsWithOnesBeforeTheCrc) {
  MmwaveLinkMessage message = sensorStart();
  message.sub_blocks = {{0x4080, {0xAA, 0xBB, 0xCC, 0xDD, 0xEE}}};
  const Bytes bytes = encodeMessage(message);
  ASSERT_EQ(bytes.size(), 4u + 12 + 4 + 5 + 3 + 4);
  EXPECT_EQ(bytes[6], 12 + 4 + 5 + 3 + 4);
  EXPECT_EQ(bytes[18], 9);  // the sub-block's own length does not count the padding
  EXPECT_EQ(Bytes(bytes.begin() + 25, bytes.begin() + 28), Bytes(3, 0xFF));
  const auto decoded = decodeMessage(bytes.data() + 4, bytes.size() - 4);
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->sub_blocks.at(0).data, Bytes({0xAA, 0xBB, 0xCC, 0xDD, 0xEE}));
}

TEST(MmwaveLinkFrame, LengthLimits) {
  MmwaveLinkMessage message;
  EXPECT_EQ(encodeMessage(message).size(), 4u + 12 + 4);
  message.sub_blocks = {{0x4080, Bytes(232)}};
  EXPECT_EQ(encodeMessage(message).size(), 4u + 252);
  message.sub_blocks = {{0x4080, Bytes(233)}};
  EXPECT_THROW(encodeMessage(message), std::length_error);
  message.sub_blocks.clear();
  message.sequence = 16;
  EXPECT_THROW(encodeMessage(message), std::invalid_argument);
}

TEST(MmwaveLinkFrame, ReadsAnEventWithCrc16) {
  // Main processor's power-up event, message id 0x280, direction 6, type 3: opcode 0xA036.
  Bytes bytes = fromHex("36a0 1600 0000 0000 0100 0000 0050 0800 0000 0000");
  const std::uint16_t words[5] = {0xA036, 0x0016, 0x0000, 0x0000, 0x0001};
  std::uint32_t sum = 0;
  for (const std::uint16_t value : words) sum += value;  // no carry here: 0xA04D
  ASSERT_EQ(sum, 0xA04Du);
  bytes[10] = 0xB2;
  bytes[11] = 0x5F;
  const std::uint16_t crc = crc16(bytes.data(), bytes.size());
  bytes.push_back(static_cast<std::uint8_t>(crc));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  const auto decoded = decodeMessage(bytes.data(), bytes.size());
  ASSERT_TRUE(decoded.message) << decoded.problem;
  EXPECT_EQ(decoded.message->type, MmwaveLinkType::kEvent);
  EXPECT_EQ(decoded.message->direction, MmwaveLinkDirection::kFromMain);
  EXPECT_EQ(decoded.message->message_id, 0x280);
  EXPECT_EQ(decoded.message->sub_blocks.at(0).id, 0x5000);
}

TEST(MmwaveLinkFrame, EverySingleFlippedBitIsNoticed) {
  const Bytes good = encodeMessage(sensorStart());
  for (std::size_t bit = 8 * 4; bit < 8 * good.size(); ++bit) {
    Bytes bytes = good;
    bytes[bit / 8] ^= static_cast<std::uint8_t>(1u << bit % 8);
    EXPECT_FALSE(decodeMessage(bytes.data() + 4, bytes.size() - 4).message) << "bit " << bit;
  }
}

TEST(MmwaveLinkFrame, EveryTruncationIsRefused) {
  const Bytes good = encodeMessage(sensorStart());
  for (std::size_t size = 0; size + 4 < good.size(); ++size) {
    const Bytes part(good.begin() + 4, good.begin() + 4 + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(decodeMessage(part.data(), part.size()).message) << size;
  }
}

TEST(MmwaveLinkFrame, RoundTripOfRandomMessagesAndNoCrashOnRandomBytes) {
  std::mt19937 random(7);
  const auto below = [&random](unsigned limit) { return static_cast<unsigned>(random() % limit); };
  for (int i = 0; i < 2000; ++i) {
    MmwaveLinkMessage message;
    message.message_id = static_cast<std::uint16_t>(below(0x400));
    message.type = static_cast<MmwaveLinkType>(below(4));
    message.crc = static_cast<MmwaveLinkCrc>(below(3));
    message.sequence = static_cast<std::uint8_t>(below(16));
    message.retry = below(2) != 0;
    message.remaining_chunks = static_cast<std::uint16_t>(below(65536));
    for (unsigned block = below(4); block > 0; --block) {
      Bytes data(below(40));
      for (auto& byte : data) byte = static_cast<std::uint8_t>(below(256));
      message.sub_blocks.push_back({static_cast<std::uint16_t>(below(65536)), data});
    }
    Bytes bytes = encodeMessage(message);
    const auto decoded = decodeMessage(bytes.data() + 4, bytes.size() - 4);
    ASSERT_TRUE(decoded.message) << decoded.problem;
    EXPECT_EQ(encodeMessage(*decoded.message), bytes);
    for (int flips = 0; flips < 3; ++flips) bytes[4 + below(bytes.size() - 4)] ^= static_cast<std::uint8_t>(below(256));
    decodeMessage(bytes.data() + 4, bytes.size() - 4);
  }
}

TEST(MmwaveLinkFrame, SubBlocksThatOverrunAreRefused) {
  MmwaveLinkMessage message = sensorStart();
  message.crc = MmwaveLinkCrc::kNone;
  Bytes bytes = encodeMessage(message);
  bytes[18] = 12;  // the sub-block's length, with nothing behind it
  EXPECT_NE(decodeMessage(bytes.data() + 4, bytes.size() - 4).problem.find("overruns"), std::string::npos);
  bytes[18] = 3;
  EXPECT_FALSE(decodeMessage(bytes.data() + 4, bytes.size() - 4).message);
}

}  // namespace
}  // namespace mmradartwin
