#include "diagnosis/channels/echo_beam.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin::diagnosis::channels {
namespace {

constexpr int kFewestChannels = 4;      ///< the main lobe of a tone has four bins, and a beam as many as channels
constexpr std::size_t kMostBeams = 10;  ///< of a pose
constexpr double kWeakestShare = 1e-3;  ///< power over that of the strongest path
constexpr double kApart_bins = 1.5;     ///< between beams of one direction
constexpr double kSameDirection = 0.3;  ///< share of a beam's power that another one receives

}  // namespace

Eigen::VectorXcd formBeam(const EchoBeam& beam, const Eigen::MatrixXcd& range_spectra) {
  const Eigen::Index bins = beam.weights.size();
  Eigen::VectorXcd formed = (beam.weights.adjoint() * range_spectra.middleCols(beam.first_bin, bins)).transpose();
  // The middle of Hann's window is sample N/2. Relative to it, tones of one echo are real multiples of each other.
  for (Eigen::Index i = 0; i < bins; ++i) {
    if ((beam.first_bin + i) % 2 != 0) formed[i] = -formed[i];
  }
  return formed;
}

std::vector<EchoBeam> chooseBeams(const RadarConfig& radar, const std::vector<PathRecord>& expected, int first_bin) {
  const int channels = radar.channels(), bins = radar.samples_per_chirp;
  std::vector<EchoBeam> beams;
  if (channels < kFewestChannels || bins < first_bin + channels) return beams;
  double low = 1e9, high = -1e9;
  for (int k = 0; k < channels; ++k) {
    low = std::min(low, radar.virtual_element_m(k).y());
    high = std::max(high, radar.virtual_element_m(k).y());
  }
  std::vector<const PathRecord*> strongest;
  for (const PathRecord& r : expected) strongest.push_back(&r);
  std::stable_sort(strongest.begin(), strongest.end(),
                   [](const PathRecord* a, const PathRecord* b) { return a->amplitude > b->amplitude; });
  std::vector<double> places;
  for (const PathRecord* record : strongest) {
    if (beams.size() == kMostBeams ||
        record->amplitude * record->amplitude < kWeakestShare * std::pow(strongest.front()->amplitude, 2))
      break;
    const double place = 0.5 * meanLength_m(*record) / radar.range_bin_m();
    if (place < first_bin || place > bins - 1) continue;
    EchoBeam beam;
    beam.weights.resize(channels);
    for (int k = 0; k < channels; ++k) {
      // Hamming's taper over the aperture suppresses other directions.
      const double across = (radar.virtual_element_m(k).y() - low) / std::max(high - low, 1e-9);
      beam.weights[k] = std::polar(0.54 - 0.46 * std::cos(2 * M_PI * (0.05 + 0.9 * across)), std::arg(record->c[k]));
    }
    beam.weights.normalize();
    bool taken = false;
    for (std::size_t i = 0; i < beams.size() && !taken; ++i) {
      taken =
          std::abs(places[i] - place) < kApart_bins && std::norm(beams[i].weights.dot(beam.weights)) > kSameDirection;
    }
    if (taken) continue;
    beam.first_bin = std::clamp(static_cast<int>(std::lround(place)) - (channels - 1) / 2, first_bin, bins - channels);
    places.push_back(place);
    beams.push_back(std::move(beam));
  }
  return beams;
}

}  // namespace mmradartwin::diagnosis::channels
