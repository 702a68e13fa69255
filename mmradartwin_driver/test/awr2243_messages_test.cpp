#include "awr2243/awr2243_messages.h"

#include <gtest/gtest.h>

#include <string>

#include "deployment_registers.h"
#include "interface_bytes.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace awr2243 {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// The deployment with every field of a message set.
Awr2243Registers deployment() {
  Awr2243Registers registers = deploymentRegisters();
  registers.highpass1 = 1;
  registers.highpass2 = 2;
  registers.tx_backoff_db = 6;
  registers.loops = 3;
  return registers;
}

// Every expected string is built by hand from the tables of the interface document, field by field.
TEST(Awr2243Messages, Profile) {
  const SubBlock block = subBlock(profile(deployment()));
  EXPECT_EQ(block.id, 0x0100);
  EXPECT_EQ(block.data, fromHex("0000 00 00"    // profile 0, VCO, calibration tables
                                "e4388e55"      // 1435384036
                                "bc020000"      // idle 700
                                "58020000"      // ADC start 600
                                "d0070000"      // ramp end 2000
                                "06000600"      // back-off 6 dB on TX0 and TX2
                                "00000000"      // phases
                                "1106 0000"     // slope 1553, TX start
                                "4000 8813"     // 64 samples, 5000 ksps
                                "01 02 0000"    // corners, TX calibration
                                "a800 0000"));  // 40 | 2 << 6
}

TEST(Awr2243Messages, NegativeSlopeIsTwosComplement) {
  Awr2243Registers registers = deployment();
  registers.slope = -1;
  const SubBlock block = subBlock(profile(registers));
  EXPECT_EQ(block.data[28], 0xFF);
  EXPECT_EQ(block.data[29], 0xFF);
}

TEST(Awr2243Messages, Chirps) {
  const auto all = chirps(deployment());
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(subBlock(all[0]).id, 0x0101);
  EXPECT_EQ(subBlock(all[0]).data, fromHex("0000 0000 0000 0000 00000000 0000 0000 0000 0100"));
  EXPECT_EQ(subBlock(all[1]).data, fromHex("0100 0100 0000 0000 00000000 0000 0000 0000 0400"));
}

TEST(Awr2243Messages, FrameAndItsCopyForTheMainProcessor) {
  const SubBlock block = subBlock(frame(deployment()));
  EXPECT_EQ(block.id, 0x0102);
  EXPECT_EQ(block.data, fromHex("0000 0000 0100 0300"  // reserved, chirps 0 to 1, 3 loops
                                "0000 8000"            // frames without end, 128 half words
                                "80969800"             // 10000000 * 5 ns
                                "0100 0000 00000000"));
  const SubBlock apply = subBlock(frameApply(deployment()));
  EXPECT_EQ(apply.id, 0x40C0);
  EXPECT_EQ(apply.data, fromHex("06000000 8000 0000"));
}

TEST(Awr2243Messages, StaticConfiguration) {
  EXPECT_EQ(subBlock(channels(deployment())).data, fromHex("0f00 0500 0000 0000"));
  EXPECT_EQ(subBlock(AdcOutput()).data, fromHex("02000100 0000 0000"));
  EXPECT_EQ(subBlock(LowPower()).data, fromHex("0000 0000"));
  EXPECT_EQ(subBlock(HighSpeedClock()).data, fromHex("0900 0000"));
  EXPECT_EQ(subBlock(RfDevice()).data, fromHex("05000000 00 00 00 00 01 00 0000"));
  EXPECT_EQ(subBlock(SynthesizerBandwidth()).data, fromHex("03 08 26 09 00 00 0000 0000 0000 0000 0000"));
  EXPECT_EQ(subBlock(RegulatorBypass()).data, fromHex("0000 00 00"));
}

TEST(Awr2243Messages, DataPath) {
  EXPECT_EQ(subBlock(dataFormat(deployment())).data, fromHex("0f00 0200 0100 00 00 00000000"));
  Awr2243Registers swapped = deployment();
  swapped.q_first = true;
  EXPECT_EQ(subBlock(dataFormat(swapped)).data, fromHex("0f00 0200 0100 01 00 00000000"));
  EXPECT_EQ(subBlock(DataPath()).data, fromHex("01 01 00 00 00 00 00 00"));
  EXPECT_EQ(subBlock(LaneEnable()).data, fromHex("0f00 0000"));
  EXPECT_EQ(subBlock(LaneClock()).data, fromHex("01 01 0000"));
  EXPECT_EQ(subBlock(LvdsLanes()).data, fromHex("0000 0100"));
  EXPECT_EQ(subBlock(EventCrc()).data, fromHex("01 00 0000 00000000 00000000"));
}

TEST(Awr2243Messages, TestPattern) {
  TestPattern pattern;
  pattern.enable = 1;
  pattern.clocks = 40;
  pattern.samples = 64;
  for (std::uint16_t rx = 0; rx < 4; ++rx) {
    pattern.rx[rx].i = {static_cast<std::uint16_t>(0x1000 * rx), 1};
    pattern.rx[rx].q = {static_cast<std::uint16_t>(0x1000 * rx + 0x800), 0xFFFF};
  }
  EXPECT_EQ(subBlock(pattern).id, 0x404B);
  EXPECT_EQ(subBlock(pattern).data, fromHex("01 28 4000 00000000 0000 0100 0008 ffff 0010 0100 0018 ffff 0020 0100 "
                                            "0028 ffff 0030 0100 0038 ffff 00000000"));
}

TEST(Awr2243Messages, TestSource) {
  TestSource source;
  source.targets[0] = {{100, 300, 0}, {0, -5, 0}, 200, {-1000, 0, 0}, {1000, 2000, 0}};
  source.rx_position[1][0] = 4;
  source.rx_position[3][0] = -12;
  source.dither_off = 1;
  const SubBlock block = subBlock(source);
  EXPECT_EQ(block.id, 0x02C2);
  EXPECT_EQ(block.data, fromHex("6400 2c01 0000 0000 fbff 0000 c800 18fc 0000 0000 e803 d007 0000" +
                                std::string(52, '0') +  // the second target
                                "0000 0400 0000 f400 00000000 0000 01 00"));
  TestSourceEnable enable;
  enable.enable = 1;
  EXPECT_EQ(subBlock(enable).id, 0x02C3);
  EXPECT_EQ(subBlock(enable).data, fromHex("0100 0000"));
}

TEST(Awr2243Messages, CommandsGoToTheProcessorThatOwnsTheSubBlock) {
  FrameTrigger start;
  start.start = 1;
  MmwaveLinkMessage message = command(subBlock(start));
  message.sequence = 1;
  EXPECT_EQ(encodeMessage(message), sensorStartBytes());
  // 0x4000 / 32 = 0x200: opcode 5 | 0x200 << 6 = 0x8005
  const Bytes power_up = encodeMessage(command({kRfPowerUp, {}}));
  EXPECT_EQ(power_up[4], 0x05);
  EXPECT_EQ(power_up[5], 0x80);
  EXPECT_EQ(power_up[6], 12 + 4 + 4);
}

TEST(Awr2243Messages, ImageGoesInChunksThatCountDown) {
  Bytes image(1000);
  for (std::size_t i = 0; i < image.size(); ++i) image[i] = static_cast<std::uint8_t>(7 * i + i / 256);
  const auto messages = fileDownload(image, "meta.bin");
  // 8 bytes of header, 1000 of the image, 4 of its CRC: 1012 = 4 * 232 + 84
  ASSERT_EQ(messages.size(), 5u);
  Bytes stream;
  for (std::size_t i = 0; i < messages.size(); ++i) {
    EXPECT_EQ(messages[i].message_id, 0x204);
    EXPECT_EQ(messages[i].remaining_chunks, 4 - i);
    const Bytes& data = messages[i].sub_blocks.at(0).data;
    EXPECT_EQ(messages[i].sub_blocks[0].id, 0x4080);
    EXPECT_EQ(data.size(), i < 4 ? 232u : 84u);
    EXPECT_LE(encodeMessage(messages[i]).size(), 4u + 252);
    stream.insert(stream.end(), data.begin(), data.end());
  }
  EXPECT_EQ(Bytes(stream.begin(), stream.begin() + 8), fromHex("04000000 ec030000"));
  EXPECT_TRUE(std::equal(image.begin(), image.end(), stream.begin() + 8));
  // CRC-32 over data and its own little-endian CRC is a constant.
  EXPECT_EQ(crc32(stream.data() + 8, stream.size() - 8), 0x2144DF1Cu);
}

TEST(Awr2243Messages, ImageThatBringsItsCrcGoesAsItIs) {
  const Bytes image = withCrc(Bytes(100, 3));
  EXPECT_EQ(image.size(), 104u);
  EXPECT_EQ(withCrc(image), image);
  EXPECT_THROW(fileDownload({}, "meta.bin"), InputError);
}

TEST(Awr2243Messages, EventsInWords) {
  SubBlock event{kInitCalibration, fromHex("fe1f0000 fe1f0000 3d00 0000 10000000 00000000")};
  EXPECT_EQ(describeEvent(event).level, EventText::Level::kInfo);
  EXPECT_NE(describeEvent(event).text.find("61 deg C"), std::string::npos);
  event.data = fromHex("fe190000 fe1f0000 3d00 0000 10000000 00000000");  // bits 9 and 10 missing
  EXPECT_EQ(describeEvent(event).level, EventText::Level::kError);
  EXPECT_EQ(describeEvent(event).text, "RF calibration failed: TX power, RX gain (61 deg C)");
  event.data = fromHex("fe190000 fe190000 f6ff 0000 10000000 00000000");  // not asked for: no failure
  EXPECT_EQ(describeEvent(event).text, "RF calibration done (-10 deg C)");
  event.data.resize(10);
  EXPECT_EQ(describeEvent(event).level, EventText::Level::kError);
  EXPECT_EQ(describeEvent({kFrontEndCpuFault, {1, 0xAB}}).text, "fault of the front end's CPU, report 01ab");
  EXPECT_EQ(describeEvent({0x1017, {}}).text, "event 0x1017, report ");
  EXPECT_EQ(describeError(9), "CRC error");
  EXPECT_EQ(describeError(77), "error 77");
}

TEST(Awr2243Messages, VersionInWords) {
  Version version;
  ASSERT_TRUE(parseVersion({kMainVersion, fromHex("05 01 01 02 02 04 01 15 06 1e 00 00 00 00 00 00")}, version));
  EXPECT_EQ(version.text(), "2.2.4.1 (2021-06-30), hardware 5.1.1");
  EXPECT_FALSE(parseVersion({kMainVersion, {1, 2}}, version));
}

}  // namespace
}  // namespace awr2243
}  // namespace mmradartwin
