#include "held_out_gain.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin {
namespace {

constexpr int kDraws = 1000;
constexpr double kLeastDrawn = 3e-4;  ///< of the strongest cell's power
constexpr double kMinRange_m = 0.16, kMaxAzimuth_rad = M_PI / 3;

/// 95 % interval of a statistic over locations drawn with replacement. The same draws every time.
std::array<double, 2> bootstrap(std::size_t locations,
                                const std::function<double(const std::vector<int>&)>& statistic) {
  std::mt19937 random(1);
  std::vector<double> values;
  std::vector<int> times(locations);
  for (int i = 0; i < kDraws; ++i) {
    std::fill(times.begin(), times.end(), 0);
    for (std::size_t l = 0; l < locations; ++l) ++times[random() % locations];
    values.push_back(statistic(times));
  }
  return {quantile(values, 0.025), quantile(values, 0.975)};
}

struct Sums {
  double missed = 0, measured = 0;
};

}  // namespace

std::vector<CellPowers> cellPowers(const ChannelData& data, const std::vector<PoseEchoes>& echoes) {
  const SignalChain chain(data.radar);
  const RangeAngleAxes& axes = chain.axes();
  const int channels = data.radar.channels(), samples = data.radar.samples_per_chirp;
  const std::size_t size = static_cast<std::size_t>(channels) * (channels + 1) / 2;
  std::vector<int> angles;
  Eigen::MatrixXcd steering(channels, kAngleBins);
  const double wave = 2 * M_PI * data.radar.virtual_pitch_m() / data.radar.wavelength_m();
  for (int a = 0; a < kAngleBins; ++a) {
    const double azimuth = axes.azimuth_rad[static_cast<std::size_t>(a)];
    if (!(std::abs(azimuth) <= kMaxAzimuth_rad)) continue;
    for (int k = 0; k < channels; ++k) {
      steering(k, static_cast<Eigen::Index>(angles.size())) = std::polar(1.0 / channels, wave * k * std::sin(azimuth));
    }
    angles.push_back(a);
  }
  const Eigen::MatrixXcd weights = steering.leftCols(static_cast<Eigen::Index>(angles.size()));
  std::vector<CellPowers> result(data.poses.size());
  tbb::parallel_for(std::size_t{0}, result.size(), [&](std::size_t i) {
    Eigen::MatrixXcd s(channels, channels);
    for (int bin = 0; bin < samples; ++bin) {
      if (axes.range_m[static_cast<std::size_t>(bin)] <= kMinRange_m) continue;
      s.setZero();
      for (const auto& group : echoes[i].groups) {
        const EchoGroup& g = *group;
        const auto* p = g.bins.power.at(bin, size);
        if (p == nullptr) continue;
        std::size_t j = 0;
        for (int k = 0; k < channels; ++k) {
          for (int l = 0; l <= k; ++l) s(k, l) += std::complex<double>(p[j++]);
        }
      }
      for (int k = 0; k < channels; ++k) {
        for (int l = 0; l < k; ++l) s(l, k) = std::conj(s(k, l));
      }
      const Eigen::VectorXcd y = data.poses[i].y.col(bin);
      for (Eigen::Index a = 0; a < weights.cols(); ++a) {
        // |w^T y|^2 and its expectation w^T S conj(w).
        result[i].measured.push_back(std::norm((weights.col(a).transpose() * y)(0)));
        const std::complex<double> e = (weights.col(a).transpose() * s * weights.col(a).conjugate())(0);
        result[i].expected.push_back(std::max(0.0, e.real()));
      }
    }
  });
  return result;
}

namespace {

double sessionGain(const std::vector<CellPowers>& poses) {
  double cross = 0, own = 0;
  for (const CellPowers& p : poses) {
    for (std::size_t j = 0; j < p.measured.size(); ++j) {
      cross += std::sqrt(p.measured[j] * p.expected[j]);
      own += p.expected[j];
    }
  }
  return own > 0 ? cross / own : 0;
}

/// Sums of one pose under the session's gain.
Sums sumsOf(const CellPowers& pose, double root_gain) {
  Sums s;
  for (std::size_t j = 0; j < pose.measured.size(); ++j) {
    const double d = std::sqrt(pose.measured[j]) - root_gain * std::sqrt(pose.expected[j]);
    s.missed += d * d;
    s.measured += pose.measured[j];
  }
  return s;
}

std::vector<Sums> sumsByLocation(const ChannelData& data, const std::vector<CellPowers>& poses) {
  const double root = sessionGain(poses);
  std::vector<Sums> sums(data.locations.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Sums own = sumsOf(poses[i], root);
    Sums& s = sums[static_cast<std::size_t>(data.poses[i].location)];
    s.missed += own.missed;
    s.measured += own.measured;
  }
  return sums;
}

double explained(const std::vector<Sums>& sums, const std::vector<int>* times) {
  double missed = 0, measured = 0;
  for (std::size_t l = 0; l < sums.size(); ++l) {
    const double n = times != nullptr ? (*times)[l] : 1;
    missed += n * sums[l].missed;
    measured += n * sums[l].measured;
  }
  return measured > 0 ? 1 - missed / measured : 0;
}

}  // namespace

double explainedPower(const std::vector<CellPowers>& poses) {
  const double root = sessionGain(poses);
  std::vector<Sums> sums;
  for (const CellPowers& p : poses) sums.push_back(sumsOf(p, root));
  return explained(sums, nullptr);
}

GainMetric explainedPowerGain(const ChannelData& data, const std::vector<CellPowers>& before,
                              const std::vector<CellPowers>& after) {
  const std::vector<Sums> b = sumsByLocation(data, before), a = sumsByLocation(data, after);
  GainMetric m;
  m.before = explained(b, nullptr);
  m.after = explained(a, nullptr);
  m.difference_ci95 = bootstrap(data.locations.size(), [&](const std::vector<int>& times) {
    return explained(a, &times) - explained(b, &times);
  });
  return m;
}

namespace {

/// Simulated over measured power of a cell, over all poses.
RealGrid differences_db(const RangeAngleAxes& axes, const std::vector<CellPowers>& poses) {
  std::vector<double> measured(poses.front().measured.size(), 0.0), expected(measured);
  const double gain = std::pow(sessionGain(poses), 2);
  for (const CellPowers& p : poses) {
    for (std::size_t j = 0; j < measured.size(); ++j) {
      measured[j] += p.measured[j];
      expected[j] += gain * p.expected[j];
    }
  }
  const double least = kLeastDrawn * *std::max_element(measured.begin(), measured.end());
  RealGrid grid = RealGrid::Constant(static_cast<Eigen::Index>(axes.range_m.size()), kAngleBins,
                                     std::numeric_limits<double>::quiet_NaN());
  std::size_t j = 0;
  for (std::size_t bin = 0; bin < axes.range_m.size(); ++bin) {
    if (axes.range_m[bin] <= kMinRange_m) continue;
    for (std::size_t a = 0; a < static_cast<std::size_t>(kAngleBins); ++a) {
      if (!(std::abs(axes.azimuth_rad[a]) <= kMaxAzimuth_rad)) continue;
      if (std::max(measured[j], expected[j]) > least) {
        grid(static_cast<Eigen::Index>(bin), static_cast<Eigen::Index>(a)) =
            10 * std::log10(std::max(expected[j], 0.1 * least) / std::max(measured[j], 0.1 * least));
      }
      ++j;
    }
  }
  return grid;
}

}  // namespace

void compareMaps(const ChannelData& data, const std::vector<CellPowers>& before, const std::vector<CellPowers>& after,
                 Finding& f) {
  if (!f.gain) f.gain.emplace();
  f.gain->explained_power = explainedPowerGain(data, before, after);
  const RangeAngleAxes axes = SignalChain(data.radar).axes();
  f.maps = std::make_shared<FindingMaps>(FindingMaps{axes, differences_db(axes, before), differences_db(axes, after)});
}

GainMetric likelihoodGain(const ChannelData& data, const std::vector<double>& before,
                          const std::vector<double>& after) {
  std::vector<double> by_location(data.locations.size(), 0.0), count(data.locations.size(), 0.0);
  GainMetric m;
  m.before = m.after = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::size_t l = static_cast<std::size_t>(data.poses[i].location);
    by_location[l] += after[i] - before[i];
    count[l] += 1;
    m.before += before[i] / static_cast<double>(before.size());
    m.after += after[i] / static_cast<double>(before.size());
  }
  m.difference_ci95 = bootstrap(data.locations.size(), [&](const std::vector<int>& times) {
    double sum = 0, n = 0;
    for (std::size_t l = 0; l < times.size(); ++l) {
      sum += times[l] * by_location[l];
      n += times[l] * count[l];
    }
    return n > 0 ? sum / n : 0.0;
  });
  return m;
}

void addMapMetrics(const Recording& recording, const Twin& twin, const ChannelData& data,
                   const std::vector<std::vector<NamedParameters>>& before,
                   const std::vector<std::vector<NamedParameters>>& after, const std::function<int(int)>& fold_of,
                   const EvaluationOptions& options, FindingGain& gain) {
  Recording used = recording;
  used.poses.clear();
  for (const PoseChannels& p : data.poses) used.poses.push_back(p.pose);
  const auto summary = [&](const std::vector<std::vector<NamedParameters>>& folds) {
    std::vector<Twin> twins;
    for (const auto& mechanisms : folds) twins.push_back(twin.changed(mechanisms));
    std::vector<SimulatedBranch> branches;
    for (const Twin& t : twins) branches.push_back(simulatedByTwin(t));
    const SimulatedBranch simulated = [&](const Pose& pose) {
      const auto at = std::find_if(data.poses.begin(), data.poses.end(),
                                   [&](const PoseChannels& p) { return p.pose.name == pose.name; });
      const std::size_t fold = static_cast<std::size_t>(fold_of(at->location)) % branches.size();
      return branches[fold](pose);
    };
    return evaluate(used, simulated, twin.scene(), twin.rays(), options).central;
  };
  const LedgerSummary b = summary(before), a = summary(after);
  const auto set = [](GainMetric& m, double from, double to) { m = {from, to, {}}; };
  set(gain.recall, b.recall, a.recall);
  for (std::size_t i = 0; i < 3; ++i) set(gain.recall_band[i], b.recall_band[i], a.recall_band[i]);
  set(gain.q1, b.q1_energy, a.q1_energy);
  set(gain.q2, b.q2_energy, a.q2_energy);
  set(gain.q3_median_db, b.q3_median_db, a.q3_median_db);
  for (std::size_t i = 0; i < 5; ++i) set(gain.classes[i], b.class_count[i], a.class_count[i]);
}

}  // namespace mmradartwin
