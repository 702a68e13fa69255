#include "echo_field.h"

#include <algorithm>
#include <cmath>

namespace mmradartwin {
namespace {

constexpr int kLobe = 2;   ///< bins to either side that a weak path reaches
constexpr int kSkirt = 6;  ///< and a strong one

void reserve(BinCovariance& field, int bins, std::size_t size) {
  if (!field.packed.empty()) return;
  field.bins = bins;
  field.packed.assign(static_cast<std::size_t>(bins) * size, {});
}

void accumulate(BinCovariance& field, int bin, double factor, const std::vector<std::complex<float>>& packed) {
  const float f = static_cast<float>(factor);
  std::complex<float>* to = field.at(bin, packed.size());
  for (std::size_t i = 0; i < packed.size(); ++i) to[i] += f * packed[i];
}

double pathCosine(const PathRecord& record) {
  const auto cosine = [](const Eigen::Vector3d& d) { return std::hypot(d.x(), d.z()) * (d.x() < 0 ? -1 : 1); };
  return 0.5 * (cosine(record.departure) + cosine(record.arrival));
}

double meanLength_m(const PathRecord& record) {
  double sum = 0;
  for (double l : record.length_m) sum += l;
  return sum / static_cast<double>(record.length_m.size());
}

/// Cuts the empty bins off both ends.
void trim(BinCovariance& field, std::size_t size) {
  const auto empty = [&](int i) {
    const auto begin = field.packed.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(i) * size);
    return std::all_of(begin, begin + static_cast<std::ptrdiff_t>(size), [](auto v) { return v == 0.0f; });
  };
  int low = 0, high = field.bins;
  while (low < high && empty(low)) ++low;
  while (high > low && empty(high - 1)) --high;
  field.packed = std::vector<std::complex<float>>(
      field.packed.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(low) * size),
      field.packed.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(high) * size));
  field.first += low;
  field.bins = high - low;
}

}  // namespace

double hannResponse(double offset) {
  const double d = std::abs(offset);
  if (d < 1e-6) return 1;
  if (std::abs(d - 1) < 1e-6) return 0.5;
  return std::sin(M_PI * d) / (M_PI * d * (1 - d * d));
}

double hannSlope(double offset) {
  constexpr double kStep = 1e-3;
  return (hannResponse(offset + kStep) - hannResponse(offset - kStep)) / (2 * kStep);
}

EchoCollector::EchoCollector(const RadarConfig& radar, double angle_error_rad)
    : radar_(radar),
      angle_error_rad_(angle_error_rad),
      channels_(radar.channels()),
      samples_(radar.samples_per_chirp),
      size_(static_cast<std::size_t>(channels_) * (channels_ + 1) / 2),
      bin_m_(radar.range_bin_m()) {
  for (int k = 0; k < channels_; ++k) {
    element_phase_.push_back(2 * M_PI / radar.wavelength_m() * radar.virtual_element_m(k).y());
  }
}

EchoGroup& EchoCollector::group(const std::vector<int>& actors) {
  for (EchoGroup& g : echoes_.groups) {
    if (g.actors == actors) return g;
  }
  echoes_.groups.emplace_back();
  EchoGroup& g = echoes_.groups.back();
  g.actors = actors;
  for (BinCovariance* field : {&g.power, &g.shift, &g.bend, &g.cosine}) reserve(*field, samples_, size_);
  return g;
}

void EchoCollector::outer(const std::complex<double>* c, double cosine,
                          std::vector<std::complex<float>>& packed) const {
  packed.resize(size_);
  if (cosine == 0) {  // no direction to be wrong about
    std::size_t i = 0;
    for (int k = 0; k < channels_; ++k) {
      for (int l = 0; l <= k; ++l) packed[i++] = std::complex<float>(c[k] * std::conj(c[l]));
    }
    return;
  }
  const double spread = 0.5 * cosine * cosine * angle_error_rad_ * angle_error_rad_;
  std::size_t i = 0;
  for (int k = 0; k < channels_; ++k) {
    for (int l = 0; l <= k; ++l) {
      // A direction known to angle_error: E exp(j(s_k - s_l)e) of a normal e.
      const double apart = element_phase_[k] - element_phase_[l];
      packed[i++] = std::complex<float>(c[k] * std::conj(c[l]) * std::exp(-spread * apart * apart));
    }
  }
}

void EchoCollector::add(const PathRecord& record, bool weak) {
  EchoGroup& g = group(record.actors);
  const double cosine = pathCosine(record), place = 0.5 * meanLength_m(record) / bin_m_;
  std::vector<std::complex<float>> packed;
  outer(record.c.data(), weak ? 0 : cosine, packed);  // a weak path's own angle error drowns in the others
  const int reach = weak ? kLobe : kSkirt, middle = static_cast<int>(std::lround(place));
  for (int r = std::max(0, middle - reach); r <= std::min(samples_ - 1, middle + reach); ++r) {
    const double w = hannResponse(r - place), slope = -hannSlope(r - place) / bin_m_;
    accumulate(g.power, r, w * w, packed);
    accumulate(g.shift, r, 2 * w * slope, packed);
    accumulate(g.bend, r, slope * slope, packed);
    accumulate(g.cosine, r, w * w * cosine, packed);
  }
}

void EchoCollector::add(const PathRecord& record, const Eigen::MatrixXcd& y) {
  EchoGroup& g = group(record.actors);
  const double cosine = pathCosine(record), place = 0.5 * meanLength_m(record) / bin_m_;
  const double strongest = y.colwise().squaredNorm().maxCoeff();
  if (!(strongest > 0)) return;
  std::vector<std::complex<float>> packed;
  std::vector<std::complex<double>> c(static_cast<std::size_t>(channels_));
  for (int r = 0; r < samples_; ++r) {
    if (y.col(r).squaredNorm() < 1e-7 * strongest) continue;
    for (int k = 0; k < channels_; ++k) c[k] = y(k, r);
    outer(c.data(), cosine, packed);
    accumulate(g.power, r, 1, packed);
    accumulate(g.cosine, r, cosine, packed);
  }
  // The range derivative moves the tone alone: its channels are those at its own bin.
  const int middle = std::clamp(static_cast<int>(std::lround(place)), 0, samples_ - 1);
  const double peak = hannResponse(middle - place);
  if (!(std::abs(peak) > 0.1)) return;
  for (int k = 0; k < channels_; ++k) c[k] = y(k, middle) / peak;
  outer(c.data(), cosine, packed);
  for (int r = std::max(0, middle - kLobe); r <= std::min(samples_ - 1, middle + kLobe); ++r) {
    const double w = hannResponse(r - place), slope = -hannSlope(r - place) / bin_m_;
    accumulate(g.shift, r, 2 * w * slope, packed);
    accumulate(g.bend, r, slope * slope, packed);
  }
}

void EchoCollector::addGraze(const PathRecord& record, double share) {
  reserve(echoes_.graze, samples_, size_);
  const double place = 0.5 * meanLength_m(record) / bin_m_;
  std::vector<std::complex<float>> packed;
  outer(record.c.data(), pathCosine(record), packed);
  const int middle = static_cast<int>(std::lround(place));
  for (int r = std::max(0, middle - kLobe); r <= std::min(samples_ - 1, middle + kLobe); ++r) {
    const double w = hannResponse(r - place);
    accumulate(echoes_.graze, r, share * w * w, packed);
  }
}

PoseEchoes EchoCollector::take() {
  for (EchoGroup& g : echoes_.groups) {
    for (BinCovariance* field : {&g.power, &g.shift, &g.bend, &g.cosine}) trim(*field, size_);
  }
  if (!echoes_.graze.packed.empty()) trim(echoes_.graze, size_);
  PoseEchoes result = std::move(echoes_);
  echoes_ = {};
  return result;
}

}  // namespace mmradartwin
