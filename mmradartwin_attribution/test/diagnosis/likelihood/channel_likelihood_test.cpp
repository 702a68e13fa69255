#include "diagnosis/likelihood/channel_likelihood.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "diagnosis/channels/echo_beam.h"
#include "diagnosis/likelihood/channel_draw.h"
#include "diagnosis/likelihood/profiled_scores.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin::diagnosis {
namespace {

const std::string kEvent = "specular";

/// An echo from a point at range and azimuth of the radar, off one actor.
PathRecord echoAt(const RadarConfig& radar, int actor, double range_m, double azimuth_rad, double amplitude) {
  PathRecord r;
  r.event = &kEvent;
  r.actors = {actor};
  r.facets = {actor};
  r.bounces = 1;
  r.departure = r.arrival = {std::cos(azimuth_rad), std::sin(azimuth_rad), 0};
  for (int k = 0; k < radar.channels(); ++k) {
    r.length_m.push_back(2 * range_m - radar.virtual_element_m(k).y() * std::sin(azimuth_rad));
  }
  setContribution(radar, amplitude, r);
  return r;
}

/// Two poses before three actors, two of which share a bin of the second pose, and channels that are not as expected.
class ThreeActors : public ::testing::Test {
 protected:
  void SetUp() override {
    data_.radar = paperRadar();
    data_.locations = {"a", "b"};
    const double ranges_m[][3] = {{2.0, 2.3, 4.1}, {3.0, 3.02, 5.3}};
    for (int i = 0; i < 2; ++i) {
      std::vector<PathRecord>& paths = paths_.emplace_back();
      for (int a = 0; a < 3; ++a) {
        paths.push_back(echoAt(data_.radar, a, ranges_m[i][a], 0.3 * a - 0.2, 0.03 / (1 + a)));
        paths.push_back(echoAt(data_.radar, a, ranges_m[i][a] + 0.05, 0.3 * a - 0.15, 0.01 / (1 + a)));
      }
      PoseChannels p;
      p.location = i;
      p.noise_power = 1e-9;
      const int channels = data_.radar.channels(), bins = data_.radar.samples_per_chirp;
      const std::size_t size = static_cast<std::size_t>(channels * (channels + 1) / 2);
      p.clutter.bins = bins;
      p.clutter.packed.assign(static_cast<std::size_t>(bins) * size, {});
      for (int b = 0; b < bins; ++b) {
        for (int k = 0; k < channels; ++k) p.clutter.at(b, size)[k * (k + 3) / 2] = 1;
      }
      data_.poses.push_back(p);
    }
    measure(0.1);
    latents_.log_gain = 0.2;
    latents_.log_floor = std::log(1e-9);
    latents_.log_relative = -3.5;
    latents_.log_range = 0.3;
    latents_.floor_shape = {0.1, -0.2, 0.3, 0, 0.2, -0.1};
    latents_.actor_gain = {0.1, -0.2, 0.15, 0};
    latents_.actor_range_m = {0.006, -0.004, 0.003, 0};
    latents_.yaw_rad = {0.002, -0.003};
  }
  /// Fills the channels, each of which an echo has with an error of its own.
  void measure(double channel_error) {
    std::mt19937 random(1);
    std::normal_distribution<double> normal(0, 1);
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      PoseChannels& p = data_.poses[i];
      p.range_spectra.resize(data_.radar.channels(), data_.radar.samples_per_chirp);
      for (std::complex<double>& y : p.range_spectra.reshaped())
        y = 2e-5 * std::complex<double>(normal(random), normal(random));
      for (const PathRecord& r : paths_[i]) {
        const int bin = static_cast<int>(std::lround(0.5 * meanLength_m(r) / data_.radar.range_bin_m()));
        for (int k = 0; k < data_.radar.channels(); ++k) {
          p.range_spectra(k, bin) += (1 + channel_error * normal(random)) * r.c[static_cast<std::size_t>(k)];
        }
      }
      p.beams = chooseBeams(data_.radar, paths_[i], 2);
      ASSERT_FALSE(p.beams.empty());
      for (EchoBeam& beam : p.beams) {
        beam.y = formBeam(beam, p.range_spectra);
        beam.clutter = 1;
      }
    }
  }
  /// share: of the third actor's power.
  std::vector<PoseEchoes> echoes(double share = 1) const {
    std::vector<PoseEchoes> all;
    static const std::vector<double> kNone;
    for (std::size_t i = 0; i < paths_.size(); ++i) {
      EchoCollector collector(data_.radar, 0.003, data_.poses[i].beams, kNone);
      for (int a = 0; a < 3; ++a) {
        std::vector<PathRecord> own;
        for (PathRecord r : paths_[i]) {
          if (r.actors.front() != a) continue;
          if (a == 2) scaleRecord(std::sqrt(share), r);
          own.push_back(r);
        }
        std::vector<const PathRecord*> records;
        for (const PathRecord& r : own) records.push_back(&r);
        collector.addTones(records, 0.03 * 0.03);
      }
      PoseEchoes& of_pose = all.emplace_back();
      of_pose.groups = collector.take();
      collector.addTones({&paths_[i][1]}, 0.03 * 0.03);
      of_pose.pose_sensitive = collector.take();
    }
    return all;
  }

  ChannelData data_;
  std::vector<std::vector<PathRecord>> paths_;
  SessionLatents latents_;
};

/// Slope of a pose's likelihood by central differences, and how far off they may be.
struct Slope {
  double value, error;
};

// A step promises only what its slope is good for.
TEST_F(ThreeActors, ScoresAreTheLikelihoodsSlopes) {
  const ChannelLikelihood model(data_, 3, PoseAccuracy());
  const auto expected = echoes();
  const Basis basis = model.basis(expected, latents_);
  const auto slopeOf = [&](const std::function<double&(SessionLatents&)>& number, double step, std::size_t pose) {
    const auto at = [&](double by) {
      SessionLatents latents = latents_;
      number(latents) += by;
      return model.byPose(expected, latents, {0, 1})[pose];
    };
    const double near = (at(step) - at(-step)) / (2 * step), far = (at(2 * step) - at(-2 * step)) / (4 * step);
    // Both differ from the slope by the third derivative: the far one by four times as much. Sums over some hundred
    // terms round.
    const double rounding = 100 * std::numeric_limits<double>::epsilon() * std::abs(at(0)) / step;
    return Slope{(4 * near - far) / 3, std::abs(far - near) / 3 + rounding};
  };
  // A group of echoes that changes a cell by less than 3e-4, even 3 cm off, has no slope there; a cell counts half.
  const double cells = data_.radar.samples_per_chirp + static_cast<double>(data_.poses[0].beams.size());
  const double by_level = 0.5 * 3e-4 * cells, by_metre = by_level / 0.03;
  const double by_radian =
      by_level * 2 * M_PI / data_.radar.wavelength_m() * data_.radar.virtual_element_m(data_.radar.channels() - 1).y();
  // Scores hold the share that the strongest echo has of a cell. Here two paths share each cell, so that a score is
  // good to a quarter of its own standard deviation. Pose-sensitive paths (3) and range errors (4) do little but change
  // that share; their scores are no slopes here.
  const auto held = [&](std::size_t pose, int j) { return 0.25 * std::sqrt(basis.poses[pose].information(j, j)); };
  const int ranges = latents_.globals() - static_cast<int>(latents_.actor_range_m.size());
  for (std::size_t pose = 0; pose < 2; ++pose) {
    for (int j = 0; j < latents_.globals(); ++j) {
      if (j == 3 || j == 4) continue;
      const Slope want = slopeOf([j](SessionLatents& n) -> double& { return n.global(j); }, 1e-4, pose);
      EXPECT_NEAR(basis.poses[pose].score[j], want.value,
                  0.15 * std::abs(want.value) + held(pose, j) + want.error + (j < ranges ? by_level : by_metre))
          << "of number " << j << ", pose " << pose;
    }
    const Slope want = slopeOf([pose](SessionLatents& n) -> double& { return n.yaw_rad[pose]; }, 1e-5, pose);
    EXPECT_NEAR(basis.poses[pose].score[latents_.globals()], want.value,
                0.15 * std::abs(want.value) + held(pose, latents_.globals()) + want.error + by_radian)
        << "of the heading, pose " << pose;
  }
}

// A step in which a number goes beyond its limit promises what it cannot bring.
TEST_F(ThreeActors, PromisesNothingBeyondALimit) {
  const int relative = 2;
  latents_.global(relative) = -11.5;
  for (double channel_error : {0.1, 0.0}) {
    measure(channel_error);
    const ChannelLikelihood model(data_, 3, PoseAccuracy());
    const Basis basis = model.basis(echoes(), latents_);
    const double beyond = basis.poses[0].score[relative] + basis.poses[1].score[relative];
    ASSERT_EQ(beyond < 0, channel_error == 0) << beyond;
    const Scores scores = model.scores(basis, {}, {0, 1});
    EXPECT_EQ(scores.total[relative] == 0, channel_error == 0);
    EXPECT_EQ(scores.information.ldlt().solve(scores.total)[relative] == 0, channel_error == 0);
  }
}

TEST_F(ThreeActors, LatentsGoOnAlongALineToTheirLimits) {
  const ChannelLikelihood model(data_, 3, PoseAccuracy());
  SessionLatents there = latents_, from = latents_;
  there.log_gain += 0.2;
  there.log_relative += 3;
  there.yaw_rad[0] += 0.01;
  from.log_floor += 1;
  const SessionLatents half = model.extrapolated(from, latents_, there, 0.5);
  EXPECT_DOUBLE_EQ(half.log_gain, latents_.log_gain + 0.1);
  EXPECT_DOUBLE_EQ(half.log_floor, latents_.log_floor + 1);
  EXPECT_DOUBLE_EQ(half.yaw_rad[0], latents_.yaw_rad[0] + 0.005);
  const SessionLatents far = model.extrapolated(from, latents_, there, 100);
  const int relative = 2;
  EXPECT_DOUBLE_EQ(far.log_relative, limitsOf(relative, 4, LatentSpread()).high);
}

TEST_F(ThreeActors, ScoresOfAMechanismAreTheLikelihoodsSlopes) {
  PoseAccuracy known;
  known.heading_rad = 1e-7;  // nothing is eliminated
  latents_.yaw_rad = {0, 0};
  const ChannelLikelihood model(data_, 3, known);
  const double step = 0.01;
  const auto at = [&](double share) { return model.covariance(echoes(share), latents_, {0, 1}); };
  const Scores scores = model.scores(model.basis(echoes(), latents_), {difference(at(1.5), at(0.5), 1)}, {0, 1});
  const double want =
      (model.logLikelihood(echoes(1 + step), latents_) - model.logLikelihood(echoes(1 - step), latents_)) / (2 * step);
  EXPECT_NEAR(scores.total[scores.total.size() - 1], want, 0.05 * std::abs(want));
}

// Draws have the expected covariance, and the strongest echo a level that does not fade.
TEST_F(ThreeActors, AFactorOnUncertainPathsThatWentFarAwayIsTriedAgainFromOne) {
  const ChannelLikelihood likelihood(data_, 3, PoseAccuracy());
  const std::vector<PoseEchoes> expected = echoes();
  SessionLatents latents = latents_;
  latents.log_pose_sensitive = 6;
  const double trapped = likelihood.logLikelihood(expected, latents);
  const double reached = likelihood.fitWithoutTrap(expected, latents, trapped);
  EXPECT_GT(reached, trapped + 10);
  EXPECT_DOUBLE_EQ(reached, likelihood.logLikelihood(expected, latents));
  EXPECT_LT(latents.log_pose_sensitive, 1);
  // What is not far away stays, and so does what is likelier.
  SessionLatents same = latents;
  EXPECT_DOUBLE_EQ(likelihood.fitWithoutTrap(expected, same, reached), reached);
  EXPECT_DOUBLE_EQ(same.log_pose_sensitive, latents.log_pose_sensitive);
  latents.log_pose_sensitive = 6;
  EXPECT_DOUBLE_EQ(likelihood.fitWithoutTrap(expected, latents, reached + 1e6), reached + 1e6);
  EXPECT_DOUBLE_EQ(latents.log_pose_sensitive, 6);
}

TEST_F(ThreeActors, DrawsChannelsAsItExpectsThem) {
  const ChannelLikelihood model(data_, 3, PoseAccuracy());
  const auto expected = echoes();
  const auto bins = model.expectedBins(expected[0], latents_, 0);
  constexpr int kDraws = 1000;
  std::mt19937 random(5);
  Eigen::VectorXd power = Eigen::VectorXd::Zero(data_.radar.samples_per_chirp), squares = power;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd own =
        drawnChannels(model, expected[0], latents_, 0, random).colwise().squaredNorm().transpose();
    power += own / kDraws;
    squares += own.cwiseProduct(own) / kDraws;
  }
  int alone = 0;
  for (const auto& bin : bins) {
    const double trace = bin.covariance.trace().real();
    EXPECT_NEAR(power[bin.bin], trace, 0.15 * trace) << bin.bin;
    const double variance = squares[bin.bin] / (power[bin.bin] * power[bin.bin]) - 1;
    if (bin.echo.power * data_.radar.channels() < 0.9 * trace) continue;
    ++alone;
    EXPECT_LT(variance, 0.5) << bin.bin;  // 1 where it fades
  }
  EXPECT_GT(alone, 0);
}

}  // namespace
}  // namespace mmradartwin::diagnosis
