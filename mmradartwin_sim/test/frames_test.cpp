#include <tbb/parallel_for.h>

#include <cmath>
#include <map>
#include <numeric>
#include <sstream>

#include "closed_form.h"
#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/coherent_average.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "mmradartwin_sim/simulate_session.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

/// Frames, chirps and samples, each mechanism against its closed form.
class FramesTest : public SceneFiles {
 protected:
  void SetUp() override {
    SceneFiles::SetUp();
    addWall("wall", "Metal", {3, -3}, {3, 3});
    writeScene();
  }
  Twin twin(const std::string& mechanisms, const RadarConfig& radar = paperRadar()) const {
    return makeTwin(path("scene.yaml"), "  specular: {max_bounces: 1}\n" + mechanisms, radar);
  }
  /// Gain that puts the wall at -12 dBFS.
  static double gainOf(const Simulation& s) { return -12 - db(s.records.at(0).amplitude); }
  std::vector<AdcCube> frames(const std::string& mechanisms, int count, double more_db = 0, std::int64_t stamp_ns = 0,
                              const std::string& pose = "a") const {
    Twin t = twin(mechanisms);
    const Simulation s = t.simulate(radarPose(0, 0, 0), stamp_ns);
    return t.simulateFrames(s, {count, gainOf(s) + more_db, pose});
  }
  static Complex sample(const AdcCube& cube, int chirp, int n, int rx) {
    const std::size_t i =
        2 * ((static_cast<std::size_t>(chirp) * 64 + static_cast<std::size_t>(n)) * 4 + static_cast<std::size_t>(rx));
    return {cube.data[i] / 32768.0, cube.data[i + 1] / 32768.0};
  }
  static std::vector<std::int16_t> all(const std::vector<AdcCube>& cubes) {
    std::vector<std::int16_t> data;
    for (const AdcCube& c : cubes) data.insert(data.end(), c.data.begin(), c.data.end());
    return data;
  }
};

TEST_F(FramesTest, AreTheGridWhereNothingActsOnFrames) {
  Twin t = twin("");
  EXPECT_FALSE(t.hasFrameStage());
  const Simulation s = t.simulate(radarPose(0, 0, 0));
  const double gain_db = gainOf(s), gain = std::pow(10, gain_db / 20);
  const auto cubes = t.simulateFrames(s, {3, gain_db, ""});
  ASSERT_EQ(cubes.size(), 3u);
  EXPECT_EQ(cubes[2].stamp_ns, 100000000);
  for (int n : {0, 40}) {
    for (int k : {1, 6}) {
      const Complex expected = gain * s.grid.x(k, n);
      const Complex is = sample(cubes[2], k / 4, n, k % 4);
      EXPECT_NEAR(is.real(), expected.real(), 0.51 / 32768);
      EXPECT_NEAR(is.imag(), expected.imag(), 0.51 / 32768);
    }
  }
}

// docs/reference/closed_forms.md 4.9: v = 1 m/s, T = 60 us, 77 GHz: 4 pi v T / lambda = 11.096 deg between slots.
TEST_F(FramesTest, WalkersTurnFromSlotToSlot) {
  RadarConfig radar = radarAt77GHz();
  radar.tx_position_m = {{0, 0, 0}, {0, 0, 0}};  // at one place, so that motion alone turns
  radar.idle_s = 20e-6;
  radar.ramp_end_s = 40e-6;
  radar.loops_per_frame = 3;
  Twin t = twin("  moving_target: {x_m: 2, y_m: 0, height_m: 0, speed_m_per_s: 1, reach_m: 0.5}\n", radar);
  const Simulation s = t.simulate(radarPose(0, 0, 0));
  std::vector<Complex> chirps;
  const Simulation still = twin("", radar).simulate(radarPose(0, 0, 0));
  t.visitChirps(s, 2, [&](const ChirpContext& c, const ComplexGrid& x) {
    EXPECT_EQ(c.slot, c.chirp % 2);
    chirps.push_back(x(0, 32) - still.grid.x(c.slot, 32));  // sample 32 is the window's centre
  });
  ASSERT_EQ(chirps.size(), 12u);
  for (std::size_t i = 1; i < 6; ++i) {
    expectForm("4.9 TDM at 1 m/s, chirp " + std::to_string(i), "deg", 11.096,
               std::arg(chirps[i] / chirps[i - 1]) * 180 / M_PI, 0.002);
  }
  // From frame to frame 50 ms: 0.1 m of path.
  const double turns = 2 * 1.0 * 0.05 / kSpeedOfLight_m_per_s * 77e9;
  EXPECT_NEAR(std::remainder(std::arg(chirps[6] / chirps[0]) / (2 * M_PI) - turns, 1.0), 0, 1e-3);
  // Radar equation: lambda sqrt(sigma) / ((4 pi)^1.5 R^2), -3 dBsm, halfway through the first window 2 m away.
  const double lambda = kSpeedOfLight_m_per_s / 77e9;
  EXPECT_NEAR(db(std::abs(chirps[0])), db(lambda * std::sqrt(std::pow(10, -0.3)) / (std::pow(4 * M_PI, 1.5) * 4)),
              0.001);
}

TEST_F(FramesTest, WalkersAreHiddenByWallsAndTurnAtTheirReach) {
  const auto lengths = [&](const std::string& m, int frames) {
    Twin t = twin("  moving_target: {" + m + ", speed_m_per_s: 0.5, height_m: 0}\n");
    const Simulation s = t.simulate(radarPose(0, 0, 0)), still = twin("").simulate(radarPose(0, 0, 0));
    std::vector<double> levels;
    t.visitChirps(s, frames, [&](const ChirpContext& c, const ComplexGrid& x) {
      if (c.slot == 0) levels.push_back((x - still.grid.x.topRows(4)).cwiseAbs().maxCoeff());
    });
    return levels;
  };
  EXPECT_EQ(lengths("x_m: 4, y_m: 0, reach_m: 0.3", 1)[0], 0) << "behind the wall";
  EXPECT_EQ(lengths("x_m: -2, y_m: 0, reach_m: 0.3", 1)[0], 0) << "behind the radar";
  // 0.25 m to either side at 0.5 m/s: back in the middle after a second, at its far end after half, near end at 1.5 s.
  const auto walk = lengths("x_m: 2, y_m: 0, reach_m: 0.25", 41);
  EXPECT_NEAR(walk[20] / walk[0], 1, 1e-3);
  EXPECT_NEAR(walk[10] / walk[0], std::pow(2 / 2.25, 2), 1e-3);
  EXPECT_NEAR(walk[30] / walk[0], std::pow(2 / 1.75, 2), 1e-3);
  EXPECT_NEAR(walk[40] / walk[0], 1, 1e-3);
}

TEST_F(FramesTest, WalkersGoThroughPatternAndReceiver) {
  const std::string walker = "  moving_target: {x_m: 1.5, y_m: 1.5, height_m: 0, speed_m_per_s: 0}\n";
  const auto echo = [&](const std::string& m) {
    Twin t = twin(walker + m), bare = twin(m);
    const Simulation s = t.simulate(radarPose(0, 0, 0)), still = bare.simulate(radarPose(0, 0, 0));
    ComplexGrid first;
    t.visitChirps(s, 1, [&](const ChirpContext& c, const ComplexGrid& x) {
      if (c.slot == 1) first = x - still.grid.x.bottomRows(4);
    });
    return first;
  };
  const ComplexGrid plain = echo("");
  EXPECT_NEAR(db(echo("  element_pattern: {cos_exponent: 2}\n").norm() / plain.norm()), 2 * db(std::cos(M_PI / 4)),
              1e-6);
  EXPECT_LT((echo("  tx_imbalance: {phase_deg: 90}\n") - Complex(0, 1) * plain).norm(), 1e-9 * plain.norm());
  EXPECT_LT((echo("  iq_conjugation: {}\n") - plain.conjugate()).norm(), 1e-9 * plain.norm());
}

TEST_F(FramesTest, DriftOfPhaseTakesFromTheAverage) {
  for (double turn : {0.03, 0.5}) {
    CoherentAverage drifting(paperRadar(), 0), steady(paperRadar(), 0);
    for (const AdcCube& c : frames("  phase_drift: {rad_per_frame: " + std::to_string(turn) + "}\n", 20))
      drifting.add(c);
    for (const AdcCube& c : frames("", 20)) steady.add(c);
    const double expected = std::abs(std::sin(20 * turn / 2) / (20 * std::sin(turn / 2)));
    EXPECT_NEAR(drifting.grid().x.norm() / steady.grid().x.norm(), expected, 2e-4);
  }
}

TEST_F(FramesTest, WhatFramesShowWithoutACauseIsPlayedAgain) {
  const auto plain = frames("", 4), settled = frames("  empirical_frame_gain: {gain_db: [-6, -3, 0]}\n", 4);
  const auto level = [](const AdcCube& cube) {
    double sum = 0;
    for (std::int16_t v : cube.data) sum += static_cast<double>(v) * v;
    return std::sqrt(sum);
  };
  const std::vector<double> gain_db = {-6, -3, 0, 0};
  for (std::size_t f = 0; f < 4; ++f) {
    EXPECT_NEAR(db(level(settled[f]) / level(plain[f])), gain_db[f], 0.02) << f;
  }
  // A tone of the echo's level adds its power to each frame, and next to nothing to what frames have in common.
  const auto toned = frames("  empirical_tone: {beat_hz: 2.31e6, level_db: 0}\n", 40), still = frames("", 40);
  CoherentAverage with(paperRadar(), 0), without(paperRadar(), 0);
  for (const AdcCube& c : toned) with.add(c);
  for (const AdcCube& c : still) without.add(c);
  EXPECT_NEAR(db(level(toned[0]) / level(still[0])), 3.0, 0.6);
  EXPECT_LT((with.grid().x - without.grid().x).norm(), 0.4 * without.grid().x.norm());
}

TEST_F(FramesTest, NoiseHasTheLevelThatTheTwinStates) {
  for (const auto& [m, level] :
       {std::pair{std::string("level_dbfs: -50"), -50.0}, {std::string("level_dbfs: -46, delta_db: 6"), -40.0}}) {
    const auto noisy = frames("  noise_floor: {" + m + "}\n", 40), clean = frames("", 1);
    double power = 0, real_power = 0;
    Complex mean = 0, over_channels = 0, over_frames = 0;
    std::size_t count = 0;
    for (std::size_t f = 0; f < noisy.size(); ++f) {
      for (int n = 0; n < 64; ++n) {
        for (int k = 0; k < 8; ++k) {
          const Complex w = sample(noisy[f], k / 4, n, k % 4) - sample(clean[0], k / 4, n, k % 4);
          const Complex next =
              sample(noisy[f], ((k + 1) % 8) / 4, n, (k + 1) % 4) - sample(clean[0], ((k + 1) % 8) / 4, n, (k + 1) % 4);
          const Complex later =
              sample(noisy[(f + 1) % noisy.size()], k / 4, n, k % 4) - sample(clean[0], k / 4, n, k % 4);
          power += std::norm(w);
          real_power += w.real() * w.real();
          mean += w;
          over_channels += w * std::conj(next);
          over_frames += w * std::conj(later);
          ++count;
        }
      }
    }
    EXPECT_NEAR(10 * std::log10(power / static_cast<double>(count)), level, 0.1);  // 20480 draws: 0.03 dB rms
    EXPECT_NEAR(real_power / power, 0.5, 0.02);
    EXPECT_LT(std::abs(mean) / std::sqrt(power * static_cast<double>(count)), 0.03);
    EXPECT_LT(std::abs(over_channels) / power, 0.03);
    EXPECT_LT(std::abs(over_frames) / power, 0.03);
  }
}

TEST_F(FramesTest, InterferenceComesInBurstsOfSomeFrames) {
  const std::string m =
      "  interference: {frame_fraction: 0.3, level_db: -6, slope_difference_hz_per_s: 5.0e+12, azimuth_deg: 30}\n";
  const auto hit = frames(m, 200), clean = frames("", 1);
  const double echo = std::pow(10, -12 / 20.0);
  const RadarConfig radar = paperRadar();
  int bursts = 0;
  std::vector<double> starts;
  for (const AdcCube& cube : hit) {
    if (cube.data == clean[0].data) continue;
    ++bursts;
    for (int chirp = 0; chirp < 2; ++chirp) {
      int samples = 0, first = -1;
      for (int n = 0; n < 64; ++n) {
        const Complex b = sample(cube, chirp, n, 0) - sample(clean[0], chirp, n, 0);
        if (std::abs(b) < 1e-3) continue;
        if (first < 0) first = n;
        ++samples;
        EXPECT_NEAR(std::abs(b) / echo, std::pow(10, -6 / 20.0), 2e-3);
        // One wave: -2 pi y sin(30 deg) / lambda from receiver to receiver.
        const Complex step = (sample(cube, chirp, n, 1) - sample(clean[0], chirp, n, 1)) / b;
        const double expected = -2 * M_PI * radar.rx_position_m[1].y() * 0.5 / radar.wavelength_m();
        EXPECT_NEAR(std::remainder(std::arg(step) - expected, 2 * M_PI), 0, 2e-3);
      }
      // 2 * 2.5 MHz / 5 MHz/us * 5 MHz = 5 samples, less at the window's ends.
      EXPECT_LE(samples, 5);
      EXPECT_GE(samples, 1);
      starts.push_back(first);
    }
  }
  EXPECT_NEAR(bursts, 60, 20);  // 6.5 rms
  EXPECT_GT(*std::max_element(starts.begin(), starts.end()), 50);
  EXPECT_LT(*std::min_element(starts.begin(), starts.end()), 10);
}

// docs/reference/causes.md A11: -95 dBc/Hz at 1 MHz leaves a skirt of -64 dBc a bin beside a host at 3 m, -54 dBc at 10
// m.
TEST_F(FramesTest, PhaseNoiseLeavesASkirtThatGrowsWithTheRange) {
  const auto skirt = [&](double range_m) {
    addWall("wall", "Metal", {range_m, -3}, {range_m, 3});
    writeScene();
    Twin t = twin("  phase_noise: {level_dbc_per_hz: -95}\n"), bare = twin("");
    const Simulation s = t.simulate(radarPose(0, 0, 0));
    EXPECT_EQ(s.grid.x, bare.simulate(radarPose(0, 0, 0)).grid.x) << "an expectation has no skirt";
    double power = 0;
    int samples = 0;
    t.visitChirps(s, 200, [&](const ChirpContext& c, const ComplexGrid& x) {
      const ComplexGrid noise = x - s.grid.x.middleRows(4 * c.slot, 4);
      power += noise.row(0).squaredNorm();
      samples += 64;
      EXPECT_NEAR(std::abs(noise(0, 5) / noise(3, 5) / (s.grid.x(4 * c.slot, 5) / s.grid.x(4 * c.slot + 3, 5))), 1,
                  1e-3)
          << "the oscillator is common to the receivers";
    });
    // White: what falls into one of 64 bins.
    return 10 * std::log10(power / samples / 64) - db(s.records[0].amplitude);
  };
  EXPECT_NEAR(skirt(3), -64, 0.5);
  EXPECT_NEAR(skirt(9), -64 + db(3), 0.5);
}

TEST_F(FramesTest, FewBitsRoundToTheirStep) {
  // Noise of about a step makes the error of rounding uniform and white.
  const std::string noise = "  noise_floor: {level_dbfs: -28}\n";
  const auto coarse = all(frames("  quantisation: {bits: 6}\n" + noise, 20)), fine = all(frames(noise, 20));
  double power = 0;
  for (std::size_t i = 0; i < coarse.size(); ++i) {
    EXPECT_EQ(coarse[i] % 1024, 0);
    power += std::pow((coarse[i] - fine[i]) / 32768.0, 2);
  }
  EXPECT_NEAR(db(std::sqrt(power / static_cast<double>(coarse.size()))), db(std::pow(2, -5) / std::sqrt(12)), 0.1);
}

TEST_F(FramesTest, ConverterHoldsAtFullScale) {
  const auto cubes = frames("  adc_saturation: {clipped_fraction: 0.1}\n", 1, 18);
  int clipped = 0;
  for (std::int16_t v : cubes[0].data) clipped += v == 32767 || v == -32768;
  // A sine 6 dB over full scale lies beyond it for 1 - 2 asin(1/2)/pi of the time.
  EXPECT_NEAR(clipped / static_cast<double>(cubes[0].data.size()), 2.0 / 3, 0.03);
}

TEST_F(FramesTest, LostPacketsAreZerosOnPacketBoundaries) {
  const auto lossy = frames("  packet_loss: {lost_fraction: 0.1}\n", 91), whole = frames("", 91);
  const RadarConfig radar = paperRadar();
  std::vector<std::uint8_t> payload, original;
  for (std::size_t f = 0; f < 91; ++f) {
    EXPECT_EQ(lossy[f].lost_bytes, 0u);
    for (std::uint8_t v : lossy[f].chirp_valid) EXPECT_EQ(v, 1) << "not flagged";
    for (const auto& [cube, bytes] : {std::make_pair(&lossy[f], &payload), std::make_pair(&whole[f], &original)}) {
      const auto encoded = encodeFrame(radar, cube->data);
      bytes->insert(bytes->end(), encoded.begin(), encoded.end());
    }
  }
  int lost = 0;
  for (std::size_t p = 0; p < payload.size() / 1456; ++p) {
    const auto begin = payload.begin() + static_cast<std::ptrdiff_t>(p * 1456);
    const bool zero = std::all_of(begin, begin + 1456, [](std::uint8_t b) { return b == 0; });
    lost += zero;
    if (!zero) {
      EXPECT_TRUE(std::equal(begin, begin + 1456, original.begin() + static_cast<std::ptrdiff_t>(p * 1456)));
    }
  }
  EXPECT_NEAR(lost, 12.8, 11);  // of 128 packets
  EXPECT_GT(lost, 0);
}

TEST_F(FramesTest, UnfilledLossSlipsOnePose) {
  const std::string m = "  packet_misalignment: {pose: b, packet: 3}\n  noise_floor: {level_dbfs: -40}\n";
  const std::string noise = "  noise_floor: {level_dbfs: -40}\n";
  EXPECT_EQ(all(frames(m, 5, 0, 0, "a")), all(frames(noise, 5, 0, 0, "a"))) << "another pose";
  const RadarConfig radar = paperRadar();
  const auto bytes = [&](const std::vector<AdcCube>& cubes) {
    std::vector<std::uint8_t> payload;
    for (const AdcCube& c : cubes) {
      const auto encoded = encodeFrame(radar, c.data);
      payload.insert(payload.end(), encoded.begin(), encoded.end());
    }
    return payload;
  };
  const auto slipped = bytes(frames(m, 5, 0, 0, "b"));
  const auto whole = bytes(frames(noise, 6, 0, 0, "b"));
  ASSERT_GE(whole.size(), slipped.size() + 1456);
  std::vector<std::uint8_t> expected(whole.begin(), whole.begin() + 3 * 1456);
  expected.insert(expected.end(), whole.begin() + 4 * 1456,
                  whole.begin() + 1456 + static_cast<std::ptrdiff_t>(slipped.size()));
  EXPECT_EQ(slipped, expected);
  EXPECT_NE(errorOf([&] { frames("  packet_misalignment: {pose: b, packet: 300}\n", 5, 0, 0, "b"); }).find("beyond"),
            std::string::npos);
}

constexpr double kPlainChange = 1e-3;  // of the root mean square of a recording

const char* const kEveryFrameMechanism =
    "  moving_target: {x_m: 2, y_m: 0.5, height_m: 0, speed_m_per_s: 0.7, fading_m: 0.05}\n"
    "  interference: {frame_fraction: 0.2}\n  phase_drift: {rad_per_frame: 0.01}\n"
    "  noise_floor: {level_dbfs: -60}\n  phase_noise: {level_dbc_per_hz: -80}\n  quantisation: {bits: 14}\n"
    "  packet_loss: {lost_fraction: 0.05}\n";

TEST_F(FramesTest, AreTheSameBitsOnAnyThread) {
  Twin t = twin(kEveryFrameMechanism);
  t.prepare({radarPose(0, 0, 0)});
  const auto make = [&t](int i) {
    return all(t.simulateFrames(t.simulate(radarPose(0.1 * i, 0, 0), 1000 * i), {5, 70, ""}));
  };
  std::vector<std::vector<std::int16_t>> alone, together(8);
  for (int i = 0; i < 8; ++i) alone.push_back(make(i));
  tbb::parallel_for(0, 8, [&](int i) { together[static_cast<std::size_t>(i)] = make(i); });
  for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(alone[i], together[i]);
  EXPECT_NE(alone[0], alone[1]);
}

// Every mechanism of the registry changes what a moving radar records, and its parameters bear their units in their
// names. Values are those at which its parameters say that it plainly does something, unless they stand here.
TEST_F(FramesTest, EveryMechanismCanBeSwitchedOn) {
  addWall("ahead", "RoughConcrete", {4, -2}, {4, 3.5}, -1, 1);
  addWall("left", "Concrete", {4, 3.5}, {-1, 3.5}, -1, 1);
  addWall("right", "Metal", {-1, -2}, {4, -2}, -1, 1);
  addRectangle("floor", "Concrete", {-2, -3, -0.9}, {8, 0, 0}, {0, 6, 0});
  addBox("cabinet", "Metal", {2, 0.6, -0.9}, {2.5, 1.2, 0.6});
  addWall("pane", "Metal", {1.5, -0.5}, {1.5, 0.2}, -1, 1);
  addWall("screen_left", "Metal", {3, -1.98}, {3, -1.2}, -1, 1);
  writeScene("causes");
  const std::string base_mechanisms = "  specular: {}\n  diffuse: {spacing_m: 0.2}\n";
  const std::map<std::string, std::string> examples = {
      {"actor_absent", "actor: cabinet"},
      {"actor_moved", "actor: cabinet, dx_m: 0.1, dy_m: 0, dyaw_deg: 0"},
      {"actor_unmodelled", "x_m: 1.5, y_m: -1, size_m: 0.2"},
      {"adc_saturation", "clipped_fraction: 0.2"},
      {"carrier_scale", "scale: 0.012"},
      {"channel_permutation", "order: [1, 0, 2, 3, 4, 5, 6, 7]"},
      {"channel_phase_error", "phase_deg: [0, 9, 8, 7, 6, 5, 4, 3]"},
      {"chirp_nonlinearity", "deviation_hz: 1.0e+6, ripple_hz: 1.0e+5"},
      {"corner_reflection", "actors: [screen_left, right]"},
      {"dc_offset", "level_db: -10"},
      {"diffuse_scattering", "material: Metal, scattering_coefficient: 0.4"},
      {"echo_replica", "behind_m: 0.5, level_db: -10"},
      {"edge_diffraction", "level: 20"},
      {"element_pattern", "cos_exponent: 2.1"},
      {"elevation_pattern", "cos_exponent: 8"},
      {"empirical_clutter", "actor: floor, level_db: 0"},
      {"empirical_echo", "x_m: 1.2, y_m: -0.8, rcs_dbsm: 0, height_m: 0"},
      {"empirical_frame_gain", "gain_db: [3, 0]"},
      {"empirical_law", "variable: range_m, at: [0, 10], gain_db: [-3, -3]"},
      {"empirical_tone", "beat_hz: 1.0e+6, level_db: -10"},
      {"excess_attenuation", "db_per_m: 0.8"},
      {"floor_ceiling_multipath", "level: 1"},
      {"gain_drift", "db_per_hour: 1000"},
      {"if_highpass", "corner_hz: 700.0e+3"},
      {"if_lowpass", "corner_hz: 2.0e+6"},
      {"interference", "frame_fraction: 1"},
      {"iq_imbalance", "image_db: -20"},
      {"material_reflectivity", "material: Metal, delta_db: -6"},
      {"moving_target", "x_m: 1.2, y_m: -1, height_m: 0, speed_m_per_s: 0.5"},
      {"mutual_coupling", "level_db: -15"},
      {"noise_floor", "level_dbfs: -40"},
      {"packet_loss", "lost_fraction: 0.6"},
      {"packet_misalignment", "pose: \"1\""},
      {"phase_drift", "rad_per_frame: 0.3"},
      {"phase_noise", "level_dbc_per_hz: -80"},
      {"pose_time_lag", "lag_s: 0.05"},
      {"quantisation", "bits: 4"},
      {"radar_pitch_offset", "pitch_deg: 12"},
      {"radar_position_offset", "forward_m: 0.03, left_m: 0.02"},
      {"radar_yaw_offset", "yaw_deg: 2"},
      {"range_bias", "range_m: 0.03"},
      {"range_scale", "scale: 0.01"},
      {"scene_registration", "x_m: 0.05, y_m: 0.02, yaw_deg: 1"},
      {"scene_scale", "scale: 0.005"},
      {"second_harmonic", "level_db: -15"},
      {"surface_roughness", "material: Metal, roughness_rms_m: 0.0002"},
      {"transmission", "actor: pane, one_way_db: -3"},
      {"tx_delay", "slot: 1, delay_m: 0.02"},
      {"tx_imbalance", "phase_deg: 25, gain_db: -1"},
      {"tx_rx_leakage", "range_m: 0.06, level_db: 3"},
      {"wall_ghost", "walls: [left]"}};
  std::vector<Pose> poses(3);
  for (int i = 0; i < 3; ++i) {
    poses[i].name = std::to_string(i);
    poses[i].stamp_ns = 1000000000LL + 100000000LL * i;
    poses[i].T_map_radar = radarPose(0.02 * i, 0.01, 0, 3.0 * i);
  }
  const auto recorded = [&](const std::string& mechanisms) {
    Twin t = makeTwin(path("causes.yaml"), base_mechanisms + mechanisms);
    t.setSession(poses);
    const Simulation s = t.simulate(poses[1].T_map_radar, poses[1].stamp_ns);
    const double clipped_db = t.clippedFraction() > 0 ? 20 : 0;
    return all(t.simulateFrames(s, {4, 60 + clipped_db, poses[1].name}));
  };
  const auto exampleOf = [&](const std::string& name, const std::vector<ParameterSpec>& specs) {
    const auto found = examples.find(name);
    if (found != examples.end()) return found->second;
    std::ostringstream values;
    for (const ParameterSpec& s : specs) {
      if (std::isfinite(s.typical)) values << (values.tellp() > 0 ? ", " : "") << s.name << ": " << s.typical;
    }
    return values.str();
  };
  const auto base = recorded("");
  EXPECT_GT(*std::max_element(base.begin(), base.end()), 1000);
  const std::vector<std::pair<std::string, std::string>> units = {{"_m", "m"},   {"_deg", "deg"}, {"_db", "dB"},
                                                                  {"_hz", "Hz"}, {"_s", "s"},     {"_fraction", "1"}};
  const MechanismRegistry& registry = MechanismRegistry::instance();
  for (const std::string& name : registry.names()) {
    const std::vector<ParameterSpec> specs = registry.create(name)->parameters();
    for (const ParameterSpec& s : specs) {
      for (const auto& [ending, unit] : units) {
        const bool ends =
            s.name.size() > ending.size() && s.name.compare(s.name.size() - ending.size(), ending.size(), ending) == 0;
        if (ends && s.name.find("_per_") == std::string::npos) {
          EXPECT_EQ(s.unit, unit) << name << " " << s.name;
        }
      }
      if (s.kind == ParameterKind::kNumber) {
        EXPECT_LT(s.min, s.max) << name << " " << s.name;
      }
    }
    if (base_mechanisms.find(" " + name + ":") != std::string::npos) continue;  // is on already
    const auto with = recorded("  " + name + ": {" + exampleOf(name, specs) + "}\n");
    ASSERT_EQ(with.size(), base.size()) << name;
    double change = 0, power = 0;
    for (std::size_t i = 0; i < base.size(); ++i) {
      change += std::pow(static_cast<double>(with[i]) - base[i], 2);
      power += std::pow(static_cast<double>(base[i]), 2);
    }
    EXPECT_GT(std::sqrt(change / power), kPlainChange) << name;
  }
}

class FrameSessionTest : public FramesTest {
 protected:
  SimulatedNoise noise = SimulatedNoise::kNone;
  SimulateResult run(const std::string& mechanisms, const std::string& output, int frames, int jobs = 0,
                     std::uint64_t seed = 1) {
    std::filesystem::create_directories(path("session"));
    write("session/radar.yaml", toYaml(paperRadar()));
    write("session/poses.csv",
          "pose,location,stamp,x,y,z,qx,qy,qz,qw\na,1,100.0,0,0,0,0,0,0.17365,0.98481\nb,1,200.0,0.5,0,0,0,0,-0.08716,"
          "0.99619\n");
    write("session/session.yaml",
          "format: mmradartwin_session/1\nradar: radar.yaml\nscene: ../scene.yaml\nposes: poses.csv\n"
          "captures: captures/{pose}.bin\n");
    write("session.twin.yaml", "scene: scene.yaml\nmechanisms:\n  specular: {max_bounces: 1}\n" + mechanisms);
    SimulateOptions options;
    options.session = path("session");
    options.output = path(output);
    options.twin_file = path("session.twin.yaml");
    options.frames = frames;
    options.jobs = jobs;
    options.seed = seed;
    options.noise = noise;
    return simulateSession(options);
  }
  std::vector<std::int16_t> samples(const std::string& output, const std::string& only = "") const {
    std::vector<std::int16_t> data;
    const Recording recording = openSession(path(output));
    for (const Pose& pose : recording.poses) {
      if (!only.empty() && pose.name != only) continue;
      recording.forEachFrame(pose, [&](const AdcCube& c) { data.insert(data.end(), c.data.begin(), c.data.end()); });
    }
    return data;
  }
};

TEST_F(FrameSessionTest, KeepsItsGainUnderNoise) {
  const SimulateResult plain = run("", "plain", 10), noisy = run("  noise_floor: {level_dbfs: -50}\n", "noisy", 10);
  EXPECT_EQ(plain.gain_db, noisy.gain_db);
  const auto a = samples("plain"), b = samples("noisy");
  ASSERT_EQ(a.size(), b.size());
  double power = 0;
  for (std::size_t i = 0; i < a.size(); ++i) power += std::pow((b[i] - a[i]) / 32768.0, 2);
  EXPECT_NEAR(10 * std::log10(2 * power / static_cast<double>(a.size())), -50, 0.1);
}

TEST_F(FrameSessionTest, AddsThermalNoiseWhereTheTwinStatesNone) {
  const SimulateResult plain = run("", "plain", 10);
  noise = SimulatedNoise::kThermal;
  const SimulateResult noisy = run("", "noisy", 10);
  EXPECT_FALSE(plain.noise_dbfs);
  ASSERT_TRUE(noisy.noise_dbfs);
  EXPECT_EQ(plain.gain_db, noisy.gain_db);
  // -174 dBm/Hz and 12 dB noise figure in 5 MHz, against 12 dBm and twice 10.5 dBi.
  EXPECT_NEAR(*noisy.noise_dbfs - noisy.gain_db, -174 + 67 + 12 - 12 - 21, 0.1);
  const auto a = samples("plain"), b = samples("noisy");
  ASSERT_EQ(a.size(), b.size());
  double power = 0;
  for (std::size_t i = 0; i < a.size(); ++i) power += std::pow((b[i] - a[i]) / 32768.0, 2);
  EXPECT_NEAR(db(std::sqrt(2 * power / static_cast<double>(a.size()))), *noisy.noise_dbfs, 0.1);
  EXPECT_FALSE(run("  noise_floor: {level_dbfs: -50}\n", "stated", 1).noise_dbfs);
}

TEST_F(FrameSessionTest, StrongestSampleOfAllFramesIsAtMinusSix) {
  run("  interference: {frame_fraction: 0.2, level_db: 20}\n", "out", 20);
  int strongest = 0;
  for (std::int16_t v : samples("out")) strongest = std::max(strongest, std::abs(static_cast<int>(v)));
  EXPECT_NEAR(db(strongest / 32768.0), -6, 0.001);
}

TEST_F(FrameSessionTest, SaturatesTheShareThatItSays) {
  run("  adc_saturation: {clipped_fraction: 0.02}\n", "out", 2);
  const auto data = samples("out");
  const auto clipped =
      std::count_if(data.begin(), data.end(), [](std::int16_t v) { return v == 32767 || v == -32768; });
  EXPECT_NEAR(static_cast<double>(clipped) / static_cast<double>(data.size()), 0.02, 0.003);
}

TEST_F(FrameSessionTest, RefusesAPoseThatIsNotThere) {
  EXPECT_NE(errorOf([&] { run("  packet_misalignment: {pose: z}\n", "out", 2); }).find("no pose z"), std::string::npos);
}

TEST_F(FrameSessionTest, DependsOnSeedNotOnThreads) {
  run(kEveryFrameMechanism, "one", 7, 1);
  run(kEveryFrameMechanism, "two", 7, 2);
  run(kEveryFrameMechanism, "other", 7, 2, 5);
  EXPECT_EQ(samples("one"), samples("two"));
  EXPECT_NE(samples("one"), samples("other"));
}

}  // namespace
}  // namespace mmradartwin
