#include "diagnosis/gain/held_out_gain.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "diagnosis/numbers/location_bootstrap.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::gain {
namespace {

constexpr double kLeastDrawnShare = 3e-4;  ///< weakest cell of a figure, as a share of the strongest cell's power
/// Share of a change that may lie beyond either end of its place in the maps.
constexpr double kShareBesidePlace = 0.05;
constexpr double kMinRange_m = 0.16;          ///< nearest cell that is evaluated
constexpr double kMaxAzimuth_rad = M_PI / 3;  ///< widest cell that is evaluated, to either side

/// Sums over cells of the unexplained and the measured power.
struct PowerSums {
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
  const VirtualLine line = data.radar.virtualLine();
  const double wave = 2 * M_PI * line.pitch_m / data.radar.wavelength_m();
  steering.setZero();
  for (int a = 0; a < kAngleBins; ++a) {
    const double azimuth = axes.azimuth_rad[static_cast<std::size_t>(a)];
    if (!(std::abs(azimuth) <= kMaxAzimuth_rad)) continue;
    const auto elements = static_cast<double>(line.channels.size());
    for (std::size_t k = 0; k < line.channels.size(); ++k) {
      steering(line.channels[k], static_cast<Eigen::Index>(angles.size())) =
          std::polar(1.0 / elements, wave * line.places[k] * std::sin(azimuth));
    }
    angles.push_back(a);
  }
  const Eigen::MatrixXcd weights = steering.leftCols(static_cast<Eigen::Index>(angles.size()));
  std::vector<CellPowers> result(data.poses.size());
  tbb::parallel_for(std::size_t{0}, result.size(), [&](std::size_t i) {
    Eigen::MatrixXcd covariance(channels, channels);
    for (int bin = 0; bin < samples; ++bin) {
      if (axes.range_m[static_cast<std::size_t>(bin)] <= kMinRange_m) continue;
      covariance.setZero();
      for (const auto& group : echoes[i].groups) {
        const auto cell = group->bins.at(bin, size);
        if (!cell) continue;
        std::size_t j = 0;
        for (int k = 0; k < channels; ++k) {
          for (int l = 0; l <= k; ++l) covariance(k, l) += std::complex<double>(cell->power[j++]);
        }
      }
      for (int k = 0; k < channels; ++k) {
        for (int l = 0; l < k; ++l) covariance(l, k) = std::conj(covariance(k, l));
      }
      const Eigen::VectorXcd y = data.poses[i].range_spectra.col(bin);
      for (Eigen::Index a = 0; a < weights.cols(); ++a) {
        // |w^T y|^2 and its expectation w^T R conj(w).
        result[i].measured.push_back(std::norm((weights.col(a).transpose() * y)(0)));
        const std::complex<double> expected = (weights.col(a).transpose() * covariance * weights.col(a).conjugate())(0);
        result[i].expected.push_back(std::max(0.0, expected.real()));
      }
    }
  });
  return result;
}

namespace {

/// Root of the session's power gain: the amplitude gain that fits all cells best.
double amplitudeGain(const std::vector<CellPowers>& poses) {
  double cross = 0, own = 0;
  for (const CellPowers& p : poses) {
    for (std::size_t j = 0; j < p.measured.size(); ++j) {
      cross += std::sqrt(p.measured[j] * p.expected[j]);
      own += p.expected[j];
    }
  }
  return own > 0 ? cross / own : 0;
}

/// Sums of one pose under the session's amplitude gain.
PowerSums sumsOf(const CellPowers& pose, double amplitude_gain) {
  PowerSums sums;
  for (std::size_t j = 0; j < pose.measured.size(); ++j) {
    const double difference = std::sqrt(pose.measured[j]) - amplitude_gain * std::sqrt(pose.expected[j]);
    sums.missed += difference * difference;
    sums.measured += pose.measured[j];
  }
  return sums;
}

std::vector<PowerSums> sumsByLocation(const ChannelData& data, const std::vector<CellPowers>& poses) {
  const double gain = amplitudeGain(poses);
  std::vector<PowerSums> sums(data.locations.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const PowerSums of_pose = sumsOf(poses[i], gain);
    PowerSums& of_location = sums[static_cast<std::size_t>(data.poses[i].location)];
    of_location.missed += of_pose.missed;
    of_location.measured += of_pose.measured;
  }
  return sums;
}

/// Explained power with each location counted `times` times, once where that is null.
double explained(const std::vector<PowerSums>& sums, const std::vector<int>* times) {
  double missed = 0, measured = 0;
  for (std::size_t l = 0; l < sums.size(); ++l) {
    const double n = times != nullptr ? (*times)[l] : 1;
    missed += n * sums[l].missed;
    measured += n * sums[l].measured;
  }
  return measured > 0 ? 1 - missed / measured : 0;
}

}  // namespace

double powerGain(const std::vector<CellPowers>& poses) {
  const double amplitude = amplitudeGain(poses);
  return amplitude * amplitude;
}

double explainedPower(const std::vector<CellPowers>& poses) {
  const double gain = amplitudeGain(poses);
  std::vector<PowerSums> sums;
  for (const CellPowers& pose : poses) sums.push_back(sumsOf(pose, gain));
  return explained(sums, nullptr);
}

GainMetric explainedPowerGain(const ChannelData& data, const std::vector<CellPowers>& before,
                              const std::vector<CellPowers>& after) {
  const std::vector<PowerSums> sums_before = sumsByLocation(data, before), sums_after = sumsByLocation(data, after);
  GainMetric gain;
  gain.before = explained(sums_before, nullptr);
  gain.after = explained(sums_after, nullptr);
  gain.difference_ci95 = intervalOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
    return explained(sums_after, &times) - explained(sums_before, &times);
  });
  return gain;
}

namespace {

/// Simulated over measured power in dB by cell [N][64], both summed over all poses. NaN where neither has a visible
/// echo.
RealGrid differences_db(const RangeAngleAxes& axes, const std::vector<CellPowers>& poses) {
  std::vector<double> measured(poses.front().measured.size(), 0.0), expected(measured);
  const double gain = std::pow(amplitudeGain(poses), 2);
  for (const CellPowers& p : poses) {
    for (std::size_t j = 0; j < measured.size(); ++j) {
      measured[j] += p.measured[j];
      expected[j] += gain * p.expected[j];
    }
  }
  const double least = kLeastDrawnShare * *std::max_element(measured.begin(), measured.end());
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

/// Interval of an axis that holds all of a weight except kShareBesidePlace at either end. weights: pairs of position on
/// the axis and weight, in any order.
std::array<double, 2> middle(std::vector<std::pair<double, double>> weights) {
  std::sort(weights.begin(), weights.end());
  double all = 0, below = 0;
  for (const auto& [place, weight] : weights) all += weight;
  std::array<double, 2> ends = {weights.front().first, weights.back().first};
  bool begun = false;
  for (const auto& [place, weight] : weights) {
    below += weight;
    if (!begun && below >= kShareBesidePlace * all) {
      ends[0] = place;
      begun = true;
    }
    if (below >= (1 - kShareBesidePlace) * all) {
      ends[1] = place;
      break;
    }
  }
  return ends;
}

/// Sets the ranges and azimuths that hold nine tenths of the squared change of amplitude, summed over all poses. Does
/// nothing where no amplitude changes.
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

void measureHeldOutGain(const ChannelData& data, const std::vector<CellPowers>& before,
                        const std::vector<CellPowers>& after, Finding& finding) {
  if (!finding.gain) finding.gain.emplace();
  finding.gain->explained_power = explainedPowerGain(data, before, after);
  const RangeAngleAxes axes = SignalChain(data.radar).axes();
  if (finding.where.size() == 1 && !finding.where.front().range_m)
    placeInMaps(axes, before, after, finding.where.front());
  finding.maps =
      std::make_shared<FindingMaps>(FindingMaps{axes, differences_db(axes, before), differences_db(axes, after)});
}

GainMetric likelihoodGain(const ChannelData& data, const std::vector<double>& before,
                          const std::vector<double>& after) {
  std::vector<double> by_location(data.locations.size(), 0.0), count(data.locations.size(), 0.0);
  GainMetric gain;
  gain.before = gain.after = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const std::size_t location = static_cast<std::size_t>(data.poses[i].location);
    by_location[location] += after[i] - before[i];
    count[location] += 1;
    gain.before += before[i] / static_cast<double>(before.size());
    gain.after += after[i] / static_cast<double>(before.size());
  }
  gain.difference_ci95 = intervalOverLocations(data.locations.size(), [&](const std::vector<int>& times) {
    double sum = 0, n = 0;
    for (std::size_t l = 0; l < times.size(); ++l) {
      sum += times[l] * by_location[l];
      n += times[l] * count[l];
    }
    return n > 0 ? sum / n : 0.0;
  });
  return gain;
}

void addGainInNats(const ChannelData& data, const std::map<std::string, double>& by_pose, Finding& finding) {
  if (data.locations.size() < 2) return;
  if (!finding.gain) finding.gain.emplace();
  if (by_pose.empty()) {
    const double poses = static_cast<double>(data.poses.size());
    finding.gain->log_likelihood_per_pose = {0, finding.evidence.log_likelihood_gain / poses, {}};
    return;
  }
  std::vector<double> nats;
  for (const PoseChannels& p : data.poses) {
    const auto entry = by_pose.find(p.pose.name);
    nats.push_back(entry == by_pose.end() ? 0 : entry->second);
  }
  finding.gain->log_likelihood_per_pose = likelihoodGain(data, std::vector<double>(nats.size(), 0.0), nats);
}

}  // namespace mmradartwin::diagnosis::gain
