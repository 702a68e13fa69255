#include "diagnosis/gain/held_out_gain.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/numbers/location_bootstrap.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::gain {
namespace {

constexpr double kLeastDrawn = 3e-4;   ///< of the strongest cell's power
constexpr double kBesideCells = 0.05;  ///< of what changes, beyond either end of the cells that are told
constexpr double kMinRange_m = 0.16, kMaxAzimuth_rad = M_PI / 3;

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
        const auto own = g.bins.at(bin, size);
        if (!own) continue;
        std::size_t j = 0;
        for (int k = 0; k < channels; ++k) {
          for (int l = 0; l <= k; ++l) s(k, l) += std::complex<double>(own->power[j++]);
        }
      }
      for (int k = 0; k < channels; ++k) {
        for (int l = 0; l < k; ++l) s(l, k) = std::conj(s(k, l));
      }
      const Eigen::VectorXcd y = data.poses[i].range_spectra.col(bin);
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
  m.difference_ci95 = intervalOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
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

/// From where to where `weights` of falling or rising `axis` hold all but 5 % at either end.
std::array<double, 2> middle(std::vector<std::pair<double, double>> weights) {
  std::sort(weights.begin(), weights.end());
  double all = 0, below = 0;
  for (const auto& [at, weight] : weights) all += weight;
  std::array<double, 2> ends = {weights.front().first, weights.back().first};
  bool begun = false;
  for (const auto& [at, weight] : weights) {
    below += weight;
    if (!begun && below >= kBesideCells * all) {
      ends[0] = at;
      begun = true;
    }
    if (below >= (1 - kBesideCells) * all) {
      ends[1] = at;
      break;
    }
  }
  return ends;
}

/// The cells that hold nine tenths, in range and in azimuth, of what a change does to amplitudes, all poses taken
/// together. Nothing where it does nothing to them.
void placeInMaps(const RangeAngleAxes& axes, const std::vector<CellPowers>& before,
                 const std::vector<CellPowers>& after, FindingPlace& place) {
  std::vector<std::pair<double, double>> by_range, by_azimuth;
  double all = 0;
  std::size_t j = 0;
  for (double range_m : axes.range_m) {
    if (range_m <= kMinRange_m) continue;
    for (double azimuth_rad : axes.azimuth_rad) {
      if (!(std::abs(azimuth_rad) <= kMaxAzimuth_rad)) continue;
      double change = 0;
      for (std::size_t i = 0; i < before.size(); ++i) {
        change += std::pow(std::sqrt(after[i].expected[j]) - std::sqrt(before[i].expected[j]), 2);
      }
      by_range.emplace_back(range_m, change);
      by_azimuth.emplace_back(azimuth_rad * 180 / M_PI, change);
      all += change;
      ++j;
    }
  }
  if (!(all > 0)) return;
  place.range_m = middle(std::move(by_range));
  place.azimuth_deg = middle(std::move(by_azimuth));
}

}  // namespace

void compareMaps(const ChannelData& data, const std::vector<CellPowers>& before, const std::vector<CellPowers>& after,
                 Finding& f) {
  if (!f.gain) f.gain.emplace();
  f.gain->explained_power = explainedPowerGain(data, before, after);
  const RangeAngleAxes axes = SignalChain(data.radar).axes();
  if (f.where.size() == 1 && !f.where.front().range_m) placeInMaps(axes, before, after, f.where.front());
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
  m.difference_ci95 = intervalOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
    double sum = 0, n = 0;
    for (std::size_t l = 0; l < times.size(); ++l) {
      sum += times[l] * by_location[l];
      n += times[l] * count[l];
    }
    return n > 0 ? sum / n : 0.0;
  });
  return m;
}

void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& f) {
  if (data.locations.size() < 2) return;
  if (!f.gain) f.gain.emplace();
  if (by_pose.empty()) {
    const double poses = static_cast<double>(data.poses.size());
    f.gain->log_likelihood_per_pose = {0, f.evidence.log_likelihood_gain / poses, {}};
    return;
  }
  std::vector<double> nats;
  for (const PoseChannels& p : data.poses) {
    const auto at = by_pose.find(p.pose.name);
    nats.push_back(at == by_pose.end() ? 0 : at->second);
  }
  f.gain->log_likelihood_per_pose = likelihoodGain(data, std::vector<double>(nats.size(), 0.0), nats);
}

}  // namespace mmradartwin::diagnosis::gain
