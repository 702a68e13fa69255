#include "mmradartwin_dsp/strict_yaml.h"

#include <gtest/gtest.h>

#include <fstream>

#include "test_radar.h"

namespace mmradartwin {
namespace {

YamlMap yaml(const std::string& text) { return YamlMap::parse(text, "a.yaml"); }

TEST(StrictYaml, NumbersAsBothVersionsWriteThem) {
  YamlMap map = yaml("a: 77.0e9\nb: 77.0e+9\nc: '77.0e9'\nd: +1.5\ne: -2\nf: .5\ng: 1e-6\nh: \"77.0e+9\"\n");
  for (const char* key : {"a", "b", "c", "h"}) EXPECT_EQ(map.number(key, 0, 1e12), 77.0e9) << key;
  EXPECT_EQ(map.number("d", 0, 2), 1.5);
  EXPECT_EQ(map.number("e", -2, 2), -2);
  EXPECT_EQ(map.number("f", 0, 2), 0.5);
  EXPECT_EQ(map.number("g", 0, 2), 1e-6);
  map.rejectUnknownKeys();
}

TEST(StrictYaml, RangeErrorsNameFileKeyValueAndRange) {
  YamlMap map = yaml("a: 12\nb: .nan\nc: .inf\nd: x12\ne: 1.5\nf: -.inf\ng: [1]\nh: nan\ni: 0x10\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.number("a", 0, 10); }), "a.yaml", "key a", "'12'", "0 to 10"));
  for (const char* key : {"b", "c", "f"}) {
    EXPECT_TRUE(saysInOneLine(inputError([&] { map.number(key, -1e300, 1e300); }), "out of range")) << key;
  }
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.number("d", 0, 10); }), "'x12' is no number"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.integer("e", 0, 10); }), "'1.5' is no whole number", "0 to 10"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.number("g", 0, 10); }), "a list is no number"));
  EXPECT_FALSE(inputError([&] { map.number("h", 0, 10); }).empty());
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.number("i", 0, 100); }), "no number"));
}

TEST(StrictYaml, UnknownKeysAreErrorsWithASuggestion) {
  YamlMap map = yaml("carrier_hz: 1\nslop_hz_per_s: 2\n");
  map.number("carrier_hz", 0, 1);
  map.has("slope_hz_per_s");
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.rejectUnknownKeys(); }), "a.yaml", "key slop_hz_per_s",
                            "did you mean 'slope_hz_per_s'", "carrier_hz"));
}

TEST(StrictYaml, MissingKeyNamesTheMisspeltOne) {
  YamlMap map = yaml("carier_hz: 1\n");
  EXPECT_TRUE(
      saysInOneLine(inputError([&] { map.number("carrier_hz", 0, 1); }), "key carrier_hz", "missing", "carier_hz"));
}

TEST(StrictYaml, NestedMapsKeepTheirPath) {
  YamlMap map = yaml("meshes:\n  - {file: a.obj, scale: 0}\nempty:\n");
  std::vector<YamlMap> meshes = map.maps("meshes");
  ASSERT_EQ(meshes.size(), 1u);
  EXPECT_TRUE(saysInOneLine(inputError([&] { meshes[0].number("scale", 1e-6, 1e6); }), "key meshes[0].scale", "'0'"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { meshes[0].rejectUnknownKeys(); }), "meshes[0].file", "is not known"));
  EXPECT_TRUE(map.map("empty").keys().empty());
}

TEST(StrictYaml, BrokenFilesAreErrors) {
  EXPECT_TRUE(saysInOneLine(inputError([] { yaml("a: [1,\nb: 2\n"); }), "a.yaml", "line"));
  EXPECT_TRUE(saysInOneLine(inputError([] { yaml(""); }), "empty"));
  EXPECT_TRUE(saysInOneLine(inputError([] { yaml("- 1\n"); }), "mapping"));
  EXPECT_TRUE(saysInOneLine(inputError([] { yaml("a: 1\nb: 2\na: 3\n"); }), "key a", "twice", "line 3"));
  EXPECT_TRUE(saysInOneLine(inputError([] { YamlMap::load("/nowhere/a.yaml"); }), "/nowhere/a.yaml"));
  EXPECT_TRUE(saysInOneLine(inputError([] { YamlMap::load("/tmp"); }), "/tmp"));
}

TEST(StrictYaml, ChoicesListsAndBooleans) {
  YamlMap map = yaml("l: 4lan\nrows: [[1, 2, 3], [1, 2]]\nb: maybe\nt: [a, b]\n");
  EXPECT_TRUE(saysInOneLine(inputError([&] {
                              map.choice("l", {"4lane", "2lane"});
                            }),
                            "'4lan'", "did you mean '4lane'"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.rows("rows", 3, -1, 5); }), "rows[1]", "3 numbers"));
  EXPECT_TRUE(saysInOneLine(inputError([&] { map.boolean("b"); }), "key b", "'maybe'"));
  EXPECT_EQ(map.texts("t"), (std::vector<std::string>{"a", "b"}));
}

TEST(RadarYaml, PaperValues) {
  const RadarConfig radar = paperRadar();
  EXPECT_EQ(radar.channels(), 8);
  EXPECT_DOUBLE_EQ(radar.bandwidth_hz(), 960e6);
  EXPECT_NEAR(radar.range_bin_m(), 0.1561, 5e-5);
  EXPECT_NEAR(radar.center_frequency_hz(), 77.93e9, 1e3);
  EXPECT_EQ(radar.bytes_per_frame(), 2u * 64 * 4 * 4);
  EXPECT_NEAR(radar.virtual_pitch_m(), 299792458.0 / 77e9 / 2, 1e-7);
  EXPECT_NEAR(radar.virtual_element_m(6).y(), 0.0077867 + 0.0038934, 1e-12);
}

TEST(RadarYaml, TextReadsBack) {
  const std::string text = std::string(paperRadarYaml()) +
                           "idle_s: 7.0e-6\nramp_end_s: 20.0e-6\nrx_gain_db: 30\ntx_backoff_db: 0\n"
                           "if_highpass_hz: [175.0e+3, 350.0e+3]\nlayout: 2lane\niq_order: qi\n"
                           "tx_enable: [[0], [1, 2]]\nrx_enable: [0, 1, 2, 3]\n";
  const RadarConfig radar = parseRadarConfig(text, "a");
  const std::string written = toYaml(radar);
  EXPECT_EQ(toYaml(parseRadarConfig(written, "b")), written);
  EXPECT_EQ(parseRadarConfig(written, "b").carrier_hz, 77.0e9);
  EXPECT_EQ(parseRadarConfig(written, "b").tx_position_m[1].y(), 0.0077867);
  EXPECT_EQ(parseRadarConfig(written, "b").tx_enable, (std::vector<std::vector<int>>{{0}, {1, 2}}));
  EXPECT_TRUE(parseRadarConfig(written, "b").iq_order == IqOrder::kQi);
  // PyYAML's rule: a float has a point and a signed exponent.
  EXPECT_TRUE(contains(written, "carrier_hz: 7.7e+10\n") || contains(written, "carrier_hz: 77000000000.0\n"))
      << written;
}

TEST(RadarYaml, StrictAboutWhatCannotBe) {
  const auto with = [](const std::string& from, const std::string& to) {
    std::string text = paperRadarYaml();
    text.replace(text.find(from), from.size(), to);
    return inputError([&] { parseRadarConfig(text, "radar.yaml"); });
  };
  EXPECT_TRUE(saysInOneLine(with("carrier_hz: 77.0e+9", "carrier_hz: 77.0"), "radar.yaml", "carrier_hz", "'77.0'"));
  EXPECT_TRUE(saysInOneLine(with("frame_period_s: 0.05", "frame_period_s: 0.00001"), "frame_period_s", "2 chirps"));
  EXPECT_TRUE(saysInOneLine(with("device", "devise: x\ndevice"), "devise", "not known"));
  EXPECT_TRUE(saysInOneLine(with("slope_hz_per_s: 75.0e+12\n", ""), "slope_hz_per_s", "missing"));
  EXPECT_TRUE(saysInOneLine(with("device", "ramp_end_s: 10.0e-6\ndevice"), "ramp_end_s", "last sample"));
  EXPECT_TRUE(saysInOneLine(with("device", "tx_enable: [[0]]\ndevice"), "tx_enable", "1 slots"));
  EXPECT_TRUE(saysInOneLine(with("samples_per_chirp: 64", "layout: 2lane\nsamples_per_chirp: 63"), "samples_per_chirp",
                            "even"));
}

TEST(RadarYaml, LayoutIsTheDevicesWhereTheFileIsSilent) {
  const auto layout = [](const std::string& device, const std::string& more = "") {
    std::string yaml = paperRadarYaml();
    return parseRadarConfig(yaml.replace(yaml.find("awr2243"), 7, device) + more, "radar.yaml").layout;
  };
  for (const char* device : {"awr2243", "AWR1243", "xwr1443", "something"}) {
    EXPECT_EQ(layout(device), CaptureLayout::kFourLane) << device;
  }
  for (const char* device : {"awr1642", "iwr1843", "IWR6843AOP", "xwr6443"}) {
    EXPECT_EQ(layout(device), CaptureLayout::kTwoLane) << device;
  }
  EXPECT_EQ(layout("iwr1843", "layout: 4lane\n"), CaptureLayout::kFourLane);
  EXPECT_EQ(layout("awr2243", "layout: 2lane\n"), CaptureLayout::kTwoLane);
}

/// What yaml-cpp never comes back from, or what never ends when it is walked.
TEST(StrictYaml, ComesToAnEndWithHostileText) {
  const auto refusal = [](const std::string& text) { return inputError([&] { YamlMap::parse(text, "a.yaml"); }); };
  EXPECT_FALSE(refusal(", a: 1").empty());
  EXPECT_FALSE(refusal(",").empty());
  EXPECT_FALSE(refusal("a: 1\n]\n,").empty());
  EXPECT_FALSE(refusal(std::string(100000, '[')).empty());
  EXPECT_TRUE(saysInOneLine(refusal("a: &x [1, *x]"), "line 1", "alias"));
  std::string grows = "a0: &a0 [1, 1]\n";
  for (int i = 1; i < 40; ++i) {
    const std::string before = "*a" + std::to_string(i - 1);
    grows += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + before + ", " + before + "]\n";
  }
  EXPECT_TRUE(saysInOneLine(refusal(grows), "aliases"));
  YamlMap shared = YamlMap::parse("a: &x [1, 2]\nb: *x\n", "a.yaml");
  EXPECT_EQ(shared.numbers("b", 0, 9), (std::vector<double>{1, 2}));
}

TEST(StrictYaml, InputErrorIsOneLineWithoutControlCharacters) {
  EXPECT_STREQ(InputError("a\nb\tc\x1b[31m\x7f").what(), "a b c [31m ");
  EXPECT_STREQ(InputError("Büro \xff\xc3").what(), "Büro ??");
  EXPECT_STREQ(InputError("\xc2\x9b"
                          "1m")
                   .what(),
               " 1m");
  EXPECT_LT(std::string(InputError(std::string(1 << 20, 'x')).what()).size(), 5000u);
}

}  // namespace
}  // namespace mmradartwin
