#include "mmradartwin_dsp/range_angle.h"
#include "scene_files.h"

namespace mmradartwin {
namespace {

using Complex = std::complex<double>;

/// Receiver and array, each against the closed form of its law on one plate.
class ReceiverTest : public SceneFiles {
 protected:
  static constexpr double kRange_m = 3, kAzimuth_deg = 20;
  /// A plate of 10 cm that faces the origin.
  void addPlate(double range_m = kRange_m, double azimuth_deg = kAzimuth_deg) {
    const double a = azimuth_deg * M_PI / 180;
    const Eigen::Vector2d at(range_m * std::cos(a), range_m * std::sin(a)),
        side(-0.05 * std::sin(a), 0.05 * std::cos(a));
    addWall("plate" + std::to_string(plates_++), "Metal", at - side, at + side, -0.05, 0.05);
  }
  Simulation look(const std::string& mechanisms) const {
    return makeTwin(path("scene.yaml"), "  specular: {max_bounces: 1}\n" + mechanisms).simulate(radarPose(0, 0, 0));
  }
  /// Where the strongest cell of the map lies: range in m, azimuth in degrees.
  static std::pair<double, double> peak(const ReceiveGrid& grid) {
    const RangeAngleMap map = SignalChain(paperRadar()).map(grid);
    Eigen::Index r, a;
    map.power_db.maxCoeff(&r, &a);
    return {map.axes.range_m[static_cast<std::size_t>(r)],
            map.axes.azimuth_rad[static_cast<std::size_t>(a)] * 180 / M_PI};
  }
  /// Amplitude of a tone at a beat frequency in one channel, by correlation over the window.
  static Complex tone(const ComplexGrid& x, int channel, double beat_hz) {
    const RadarConfig radar = paperRadar();
    Complex sum = 0;
    double weight = 0;
    for (int n = 0; n < 64; ++n) {
      // Hann squared: sidelobes far below what is looked for.
      const double w = std::pow(0.5 * (1 - std::cos(2 * M_PI * n / 64)), 2);
      sum +=
          w * x(channel, n) * std::polar(1.0, -2 * M_PI * beat_hz * (radar.sample_time_s(n) - radar.window_center_s()));
      weight += w;
    }
    return sum / weight;
  }
  static double beat(double length_m) { return 75e12 * length_m / kSpeedOfLight_m_per_s; }
  int plates_ = 0;
};

TEST_F(ReceiverTest, LowPassHasItsCornerAndSlope) {
  addPlate();
  writeScene();
  const double f = beat(2 * kRange_m), base = look("").grid.x.norm();
  const auto loss = [&](double corner, int order) {
    return db(look("  if_lowpass: {corner_hz: " + std::to_string(corner) + ", order: " + std::to_string(order) + "}\n")
                  .grid.x.norm() /
              base);
  };
  for (int order : {1, 2, 5, 6}) {
    EXPECT_NEAR(loss(f, order), -3.0103, 0.02);
    for (double part : {0.5, 2.0})
      EXPECT_NEAR(loss(f * part, order), -10 * std::log10(1 + std::pow(1 / part, 2 * order)), 0.05);
  }
}

TEST_F(ReceiverTest, ConjugationsMirrorWhatTheySay) {
  addPlate();
  writeScene();
  const auto plain = peak(look("").grid);
  EXPECT_NEAR(plain.first, kRange_m, 0.08);
  EXPECT_NEAR(plain.second, kAzimuth_deg, 2);
  const auto iq = peak(look("  iq_conjugation: {}\n").grid);
  EXPECT_NEAR(iq.first, paperRadar().max_range_m() - plain.first, 1e-9);
  EXPECT_NEAR(iq.second, -plain.second, 1e-9);
  const auto channels = peak(look("  channel_conjugation: {}\n").grid);
  EXPECT_NEAR(channels.first, plain.first, 1e-9);
  EXPECT_NEAR(channels.second, -plain.second, 1e-9);
  const auto reversed = peak(look("  channel_permutation: {order: [7, 6, 5, 4, 3, 2, 1, 0]}\n").grid);
  EXPECT_EQ(reversed, channels) << "the same data, as causes go";
}

TEST_F(ReceiverTest, ChannelConjugationKeepsTheRangeSpectrumsLevels) {
  addPlate();
  addPlate(5, -40);
  writeScene();
  const SignalChain chain(paperRadar());
  const ComplexGrid plain = chain.rangeSpectra(look("").grid.x),
                    turned = chain.rangeSpectra(look("  channel_conjugation: {}\n").grid.x);
  EXPECT_LT((turned - plain.conjugate()).norm(), 1e-12 * plain.norm());
}

TEST_F(ReceiverTest, PermutationDeliversInOrder) {
  addPlate();
  writeScene();
  const ComplexGrid base = look("").grid.x;
  const std::vector<int> order = {1, 0, 2, 3, 7, 4, 6, 5};
  const ComplexGrid x = look("  channel_permutation: {order: [1, 0, 2, 3, 7, 4, 6, 5]}\n").grid.x;
  for (int i = 0; i < 8; ++i) EXPECT_EQ(x.row(i), base.row(order[static_cast<std::size_t>(i)]));
  for (const char* wrong :
       {"[0, 1, 2]", "[0, 1, 2, 3, 4, 5, 6, 6]", "[0, 1, 2, 3, 4, 5, 6, 8]", "[0.5, 1, 2, 3, 4, 5, 6, 7]"}) {
    EXPECT_NE(errorOf([&] { look(std::string("  channel_permutation: {order: ") + wrong + "}\n"); }).find("0 to 7"),
              std::string::npos);
  }
}

TEST_F(ReceiverTest, CouplingFeedsNeighbours) {
  addPlate();
  writeScene();
  const ComplexGrid base = look("").grid.x;
  const ComplexGrid x = look("  mutual_coupling: {level_db: -20, decay_db: 6.0206, phase_deg: 90}\n").grid.x;
  // 0.1 j beside, 0.05 j^2 one further, 0.025 j^3 at the far end; blocks of four receivers stay apart.
  const Complex j(0, 1);
  EXPECT_NEAR(std::abs(x(4, 9) - (base(4, 9) + 0.1 * j * base(5, 9) - 0.05 * base(6, 9) - 0.025 * j * base(7, 9))) /
                  std::abs(base(4, 9)),
              0, 1e-6);
  EXPECT_NEAR(
      std::abs(x(1, 9) - (base(1, 9) + 0.1 * j * (base(0, 9) + base(2, 9)) - 0.05 * base(3, 9))) / std::abs(base(1, 9)),
      0, 1e-6);
  const ComplexGrid shares =
      look("  mutual_coupling: {next_real: 0.2, next_imaginary: -0.1, second_imaginary: 0.05}\n").grid.x;
  EXPECT_NEAR(std::abs(shares(4, 9) - (base(4, 9) + (0.2 - 0.1 * j) * base(5, 9) + 0.05 * j * base(6, 9))) /
                  std::abs(base(4, 9)),
              0, 1e-6);
  EXPECT_NE(errorOf([&] { look("  mutual_coupling: {level_db: -20, next_real: 0.1}\n"); }).find("not both"),
            std::string::npos);
}

TEST_F(ReceiverTest, ATransmitterIsHeardInTheOthersSlots) {
  addPlate();
  writeScene();
  const ComplexGrid base = look("").grid.x;
  const ComplexGrid x = look("  transmitter_coupling: {share_real: 0.3, share_imaginary: -0.2}\n").grid.x;
  const Complex share(0.3, -0.2);
  for (int channel : {1, 6}) {
    const Complex expected = base(channel, 9) + share * base((channel + 4) % 8, 9);
    EXPECT_NEAR(std::abs(x(channel, 9) - expected) / std::abs(expected), 0, 1e-6);
  }
}

TEST_F(ReceiverTest, AReplicaFollowsEveryEchoOrOneActors) {
  addPlate();
  addPlate(5, -20);
  writeScene();
  const Simulation base = look("");
  ASSERT_EQ(base.records.size(), 2u);
  const Simulation s = look("  echo_replica: {behind_m: 0.7, level_db: -9}\n");
  ASSERT_EQ(s.records.size(), 4u);
  for (std::size_t i = 0; i < 2; ++i) {
    const PathRecord &echo = s.records[i], &replica = s.records[2 + i];
    EXPECT_EQ(*replica.event, "echo_replica");
    EXPECT_EQ(replica.actors, echo.actors);
    EXPECT_NEAR(db(replica.amplitude / echo.amplitude), -9, 1e-9);
    for (std::size_t k = 0; k < echo.length_m.size(); ++k) {
      EXPECT_NEAR(replica.length_m[k] - echo.length_m[k], 1.4, 1e-12);
      // The way of a wave that is 1.4 m longer, at the window's centre (docs/reference/contracts.md section 3).
      const double tau = replica.length_m[k] / kSpeedOfLight_m_per_s, was = echo.length_m[k] / kSpeedOfLight_m_per_s;
      const RadarConfig radar = paperRadar();
      const double turns =
          radar.center_frequency_hz() * (tau - was) - 0.5 * radar.slope_hz_per_s * (tau * tau - was * was);
      EXPECT_NEAR(std::abs(replica.c[k] / echo.c[k] / std::polar(std::pow(10, -0.45), 2 * M_PI * turns) - 1.0), 0,
                  1e-6);
    }
  }
  EXPECT_TRUE(s.check.ok());
  const Simulation one = look("  echo_replica: {behind_m: -0.7, level_db: -9, actor: plate1}\n");
  ASSERT_EQ(one.records.size(), 3u);
  EXPECT_EQ(one.records[2].actors, one.records[1].actors);
  EXPECT_NEAR(one.records[2].length_m[0] - one.records[1].length_m[0], -1.4, 1e-12);
  EXPECT_EQ(look("  echo_replica: {behind_m: -4, level_db: -9}\n").records.size(), 3u)
      << "one would be behind the radar";
  EXPECT_NE(errorOf([&] { look("  echo_replica: {behind_m: 1, level_db: -9, actor: nobody}\n"); }).find("plate0"),
            std::string::npos);
}

TEST_F(ReceiverTest, ImbalanceMakesAnImage) {
  addPlate();
  writeScene();
  const Simulation base = look(""), s = look("  iq_imbalance: {image_db: -20, phase_deg: 30}\n");
  for (int k : {0, 5}) {
    const Complex host = tone(base.grid.x, k, beat(base.records[0].length_m[static_cast<std::size_t>(k)]));
    const Complex image = tone(s.grid.x, k, -beat(base.records[0].length_m[static_cast<std::size_t>(k)]));
    EXPECT_NEAR(db(std::abs(image / host)), -20, 0.01);
    EXPECT_NEAR(std::arg(image / std::conj(host)) * 180 / M_PI, 30, 0.1);
  }
}

// A feed that is longer by d one-way: the beat of that slot's channels is that of a range longer by d, and their phase
// at the window's centre is the stated one.
TEST_F(ReceiverTest, ALateTransmitterRaisesTheBeatOfItsChannels) {
  addPlate();
  writeScene();
  const Simulation base = look(""), s = look("  tx_delay: {slot: 1, delay_m: 0.07, phase_deg: 40}\n");
  for (int k = 0; k < 8; ++k) {
    const double late_hz = k < 4 ? 0 : beat(0.14);
    for (int n : {0, 20, 63}) {
      const double t_s = (n - 32) / 5e6, turn = k < 4 ? 0 : 40 * M_PI / 180 + 2 * M_PI * late_hz * t_s;
      EXPECT_LT(std::abs(s.grid.x(k, n) / base.grid.x(k, n) - std::polar(1.0, turn)), 1e-9) << k << " " << n;
    }
  }
  EXPECT_TRUE(s.check.ok());
  EXPECT_NE(errorOf([&] { look("  tx_delay: {slot: 2, delay_m: 0.07}\n"); }).find("2 transmitters"), std::string::npos);
  EXPECT_NE(errorOf([&] { look("  tx_delay: {slot: 0.5, delay_m: 0.07}\n"); }).find("slot"), std::string::npos);
}

TEST_F(ReceiverTest, EveryReceiverMayHaveAnImageOfItsOwn) {
  addPlate();
  writeScene();
  const double level_db[] = {-36.5, -34.7, -28.5, -37.7}, phase_deg[] = {10, 100, -60, 170};
  const Simulation base = look(""), s = look(
                                        "  iq_imbalance: {image_db: [-36.5, -34.7, -28.5, -37.7], phase_deg: [10, 100, "
                                        "-60, 170]}\n");
  for (int k = 0; k < 8; ++k) {
    for (int n : {0, 17, 63}) {
      const Complex beta = (s.grid.x(k, n) - base.grid.x(k, n)) / std::conj(base.grid.x(k, n));
      EXPECT_NEAR(db(std::abs(beta)), level_db[k % 4], 1e-6);
      EXPECT_NEAR(std::arg(beta) * 180 / M_PI, phase_deg[k % 4], 1e-6);
    }
  }
  EXPECT_NE(errorOf([&] { look("  iq_imbalance: {image_db: [-20, -30]}\n"); }).find("4 receivers"), std::string::npos);
  EXPECT_NE(errorOf([&] { look("  iq_imbalance: {image_db: [-20, -30, 1, -30]}\n"); }).find("image_db"),
            std::string::npos);
}

TEST_F(ReceiverTest, OffsetIsAConstantOverTheStrongestEcho) {
  addPlate();
  writeScene();
  const Simulation base = look(""), s = look("  dc_offset: {level_db: -6}\n");
  const ComplexGrid added = s.grid.x - base.grid.x;
  double power = 0;
  for (int k = 0; k < 8; ++k) {
    power += std::norm(added(k, 0)) / 8;
    for (int n = 1; n < 64; ++n) EXPECT_LT(std::abs(added(k, n) - added(k, 0)), 1e-15);
  }
  EXPECT_NEAR(db(std::sqrt(power) / base.records[0].amplitude), -6, 1e-6);
  EXPECT_GT(std::abs(added(0, 0) / added(1, 0) - added(1, 0) / added(2, 0)), 1e-3) << "no steering vector";
}

TEST_F(ReceiverTest, HarmonicsStandAtTwiceTheRangeAndFallWithTheSquare) {
  addPlate(2, 20);
  addPlate(3.1, -30);
  writeScene();
  const Simulation base = look(""), s = look("  second_harmonic: {level_db: -30}\n");
  ASSERT_EQ(base.records.size(), 2u);
  const bool first = base.records[0].amplitude > base.records[1].amplitude;
  const PathRecord &strong = base.records[first ? 0 : 1], &weak = base.records[first ? 1 : 0];
  const ComplexGrid added = s.grid.x - base.grid.x;
  // Three tones, 2 a, 2 b and a + b: solved for by least squares, so that none leaks into another.
  for (int k : {0, 6}) {
    const std::size_t c = static_cast<std::size_t>(k);
    Eigen::MatrixXcd tones(64, 3);
    const RadarConfig radar = paperRadar();
    for (int n = 0; n < 64; ++n) {
      const double t = 2 * M_PI * (radar.sample_time_s(n) - radar.window_center_s());
      tones(n, 0) = std::polar(1.0, t * beat(2 * strong.length_m[c]));
      tones(n, 1) = std::polar(1.0, t * beat(2 * weak.length_m[c]));
      tones(n, 2) = std::polar(1.0, t * beat(strong.length_m[c] + weak.length_m[c]));
    }
    const Eigen::VectorXcd level = tones.colPivHouseholderQr().solve(added.row(k).transpose());
    EXPECT_NEAR(db(std::abs(level[0]) / strong.amplitude), -30, 1e-3);
    EXPECT_NEAR(db(std::abs(level[1]) / weak.amplitude), -30 + db(weak.amplitude / strong.amplitude), 1e-3);
    EXPECT_NEAR(std::abs(level[2]), 2 * std::sqrt(std::abs(level[0]) * std::abs(level[1])),
                1e-6 * std::abs(level[2]) + 1e-15);
    EXPECT_NEAR(std::remainder(std::arg(level[0]) - 2 * std::arg(strong.c[c]), 2 * M_PI), 0, 1e-4);
  }
}

TEST_F(ReceiverTest, BouncesPassTheRadarsDelayOnceAndArriveAsTheirLastPath) {
  addPlate(1.0, 20);
  addPlate(1.7, -30);
  writeScene();
  constexpr double kBias_m = 0.06, kLevel_db = -20;
  const std::string bias = "  range_bias: {range_m: 0.06}\n";
  const Simulation plain = look(""), base = look(bias),
                   s = look(bias + "  second_harmonic: {level_db: -20, kind: bounce}\n");
  ASSERT_EQ(plain.records.size(), 2u);
  const bool first = base.records[0].amplitude > base.records[1].amplitude;
  const PathRecord &strong = base.records[first ? 0 : 1], &weak = base.records[first ? 1 : 0];
  const double strong_m = plain.records[first ? 0 : 1].length_m[0], weak_m = plain.records[first ? 1 : 0].length_m[0];
  const double of_weak_db = kLevel_db + db(weak.amplitude / strong.amplitude);
  const ComplexGrid added = s.grid.x - base.grid.x;
  const RadarConfig radar = paperRadar();
  const auto along = [](const PathRecord& path, int k) {
    return std::arg(path.c[static_cast<std::size_t>(k)] / path.c[0]);
  };
  std::vector<Eigen::VectorXcd> levels;
  for (int k : {0, 6}) {
    const auto c = static_cast<std::size_t>(k);
    // One tone per product; where a path arrives, its length is that of the channel.
    const double strong_k = strong.length_m[c] - 2 * kBias_m, weak_k = weak.length_m[c] - 2 * kBias_m;
    const double lengths[] = {strong_m + strong_k, weak_m + weak_k,   2 * strong_m + strong_k,
                              2 * weak_m + weak_k, strong_m + weak_k, weak_m + strong_k};
    Eigen::MatrixXcd tones(64, 6);
    for (int n = 0; n < 64; ++n) {
      const double t = 2 * M_PI * (radar.sample_time_s(n) - radar.window_center_s());
      for (int j = 0; j < 6; ++j) tones(n, j) = std::polar(1.0, t * beat(lengths[j] + 2 * kBias_m));
    }
    // The two mixed products differ in length by less than a bin divided by a hundred: their sum is judged.
    Eigen::MatrixXcd apart = tones.leftCols(5);
    apart.col(4) = tones.col(4) * std::polar(1.0, along(weak, k)) + tones.col(5) * std::polar(1.0, along(strong, k));
    levels.push_back(apart.colPivHouseholderQr().solve(added.row(k).transpose()));
    const Eigen::VectorXcd& level = levels.back();
    EXPECT_NEAR(db(std::abs(level[0]) / strong.amplitude), kLevel_db, 0.01);
    EXPECT_NEAR(db(std::abs(level[1]) / weak.amplitude), of_weak_db, 0.01);
    EXPECT_NEAR(db(std::abs(level[2]) / strong.amplitude), 2 * kLevel_db, 0.1);
    EXPECT_NEAR(db(std::abs(level[3]) / weak.amplitude), 2 * of_weak_db, 0.5);
    EXPECT_NEAR(db(std::abs(level[4]) / strong.amplitude), of_weak_db, 0.01);
  }
  EXPECT_NEAR(std::remainder(std::arg(levels[1][0] / levels[0][0]) - along(strong, 6), 2 * M_PI), 0, 1e-3);
  EXPECT_NEAR(std::remainder(std::arg(levels[1][1] / levels[0][1]) - along(weak, 6), 2 * M_PI), 0, 1e-3);
}

// docs/reference/causes.md A12: ripples of 20 kHz and 300 kHz leave paired echoes at -58 and -35 dBc of a host at 3 m.
TEST_F(ReceiverTest, NonlinearChirpsPairEchoes) {
  addPlate(3, 0);
  writeScene();
  const Simulation base = look("");
  const double length = base.records[0].length_m[0], host = base.records[0].amplitude;
  for (const auto& [deviation, expected] : {std::pair{20e3, -58.0}, std::pair{300e3, -34.5}}) {
    const double ripple = 400e3;
    const Simulation s =
        look("  chirp_nonlinearity: {deviation_hz: " + std::to_string(deviation) + ", ripple_hz: 400.0e+3}\n");
    // Bessel: the phase differs by 2 m sin(pi f tau) at the ripple's frequency, m = deviation / ripple.
    const double swing = 2 * deviation / ripple * std::sin(M_PI * ripple * length / kSpeedOfLight_m_per_s);
    const ComplexGrid added = s.grid.x - base.grid.x;
    for (double side : {-ripple, ripple}) {
      const double level = db(std::abs(tone(added, 0, beat(length) + side)) / host);
      EXPECT_NEAR(level, db(std::cyl_bessel_j(1, swing)), 0.1);
      EXPECT_NEAR(level, expected, 0.6);
    }
    EXPECT_NEAR(s.grid.x.norm() / base.grid.x.norm(), 1, 1e-9) << "a phase takes no power";
  }
}

TEST_F(ReceiverTest, GainDriftsWithTimeOrBySteps) {
  addPlate();
  writeScene();
  std::vector<Pose> poses(5);
  for (int i = 0; i < 5; ++i) {
    poses[static_cast<std::size_t>(i)].name = std::to_string(i);
    poses[static_cast<std::size_t>(i)].stamp_ns = 1700000000000000000 + i * 1800000000000LL;
  }
  const auto gains = [&](const std::string& m) {
    Twin twin = makeTwin(path("scene.yaml"), "  specular: {}\n" + m);
    twin.setSession(poses);
    std::vector<double> gains;
    for (const Pose& p : poses)
      gains.push_back(db(twin.simulate(radarPose(0, 0, 0), p.stamp_ns).grid.x.norm() / look("").grid.x.norm()));
    return gains;
  };
  const auto ramp = gains("  gain_drift: {db_per_hour: 3}\n"), steps = gains("  gain_drift: {steps_db: [2, -1]}\n");
  const auto at_times = gains("  gain_drift: {steps_db: [2, -3], steps_s: [900, 6000]}\n");
  const std::vector<double> after_steps = {0, 0, 2, 2, 1}, after_times = {0, 2, 2, 2, -1};
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR(ramp[i], 1.5 * static_cast<double>(i), 1e-9);
    EXPECT_NEAR(steps[i], after_steps[i], 1e-9);
    EXPECT_NEAR(at_times[i], after_times[i], 1e-9);
  }
  EXPECT_NE(errorOf([&] { look("  gain_drift: {steps_db: [2], steps_s: [1, 2]}\n"); }).find("one time for each"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { look("  gain_drift: {steps_db: [2, 1], steps_s: [2, 1]}\n"); }).find("has to rise"),
            std::string::npos);
  EXPECT_NE(errorOf([&] { look("  gain_drift: {steps_db: [2], db_per_hour: 1}\n"); }).find("not both"),
            std::string::npos);
}

TEST_F(ReceiverTest, PatternsTakeMeasuredCurves) {
  addPlate(3, 20);
  writeScene();
  const auto level = [&](const std::string& m, double pitch_deg = 0) {
    const Eigen::Isometry3d T =
        radarPose(0, 0, 0) * Eigen::AngleAxisd(pitch_deg * M_PI / 180, Eigen::Vector3d::UnitY());
    const auto records = makeTwin(path("scene.yaml"), "  specular: {max_bounces: 1}\n" + m).simulate(T).records;
    return std::make_pair(db(records.at(0).amplitude), records.at(0).departure);
  };
  // 20 degrees lie two thirds of the way from 10 to 25: -1 - 2/3 * 3 dB one way, both legs in power, that in amplitude.
  EXPECT_NEAR(
      level("  element_pattern: {angles_deg: [-60, 10, 25, 60], gain_db: [-9, -1, -4, -9]}\n").first - level("").first,
      2 * -3.0, 1e-6);
  EXPECT_NEAR(
      level("  element_pattern: {cos_exponent: 2, angles_deg: [-60, 60], gain_db: [-2, -2]}\n").first - level("").first,
      2 * db(std::cos(20 * M_PI / 180)) - 4, 1e-6);
  EXPECT_NEAR(level("  element_pattern: {angles_deg: [-10, 10], gain_db: [0, -5]}\n").first - level("").first, -10,
              1e-6)
      << "held at its end";
  const auto pitched = level("", -8);
  const double elevation_deg = std::asin(pitched.second.z()) * 180 / M_PI;
  ASSERT_LT(elevation_deg, -5);
  EXPECT_NEAR(
      level("  element_pattern: {elevation_angles_deg: [-20, 0, 20], elevation_gain_db: [-10, 0, -5]}\n", -8).first -
          pitched.first,
      elevation_deg, 1e-6)
      << "0.5 dB a degree, twice";
  EXPECT_NEAR(
      level("  elevation_pattern: {angles_deg: [-20, 0, 20], gain_db: [-10, 0, -5]}\n", -8).first - pitched.first,
      elevation_deg, 1e-6)
      << "the same curve by the cause's own name";
  EXPECT_NE(
      errorOf([&] { level("  elevation_pattern: {angles_deg: [0, 1], gain_db: [1]}\n"); }).find("elevation_pattern"),
      std::string::npos);
  EXPECT_NE(
      errorOf([&] { level("  element_pattern: {angles_deg: [0, 1], gain_db: [1]}\n"); }).find("one gain per angle"),
      std::string::npos);
  EXPECT_NE(errorOf([&] { level("  element_pattern: {angles_deg: [1, 0], gain_db: [1, 1]}\n"); }).find("rise"),
            std::string::npos);
}

}  // namespace
}  // namespace mmradartwin
