#include "diagnosis/echoes/echo_field.h"

#include <algorithm>
#include <array>
#include <boost/functional/hash.hpp>
#include <cmath>
#include <utility>

#include "diagnosis/numbers/packed_hermitian.h"

namespace mmradartwin::diagnosis::echoes {
namespace {

constexpr int kLobe_bins = 2;   ///< reach of a weak path to either side
constexpr int kSkirt_bins = 6;  ///< reach of other paths
/// Reach of a strong path: -60 to -100 dB, above the noise where there is no clutter.
constexpr int kFarSkirt_bins = 32;
/// Power over that of the pose's strongest path, below which a path is weak and from which it is strong. The likelihood
/// jumps where a path passes one of them: see docs/verification/calibration_of_bounds.md, reach of paths.
constexpr double kWeakShare = 1e-6, kStrongShare = 0.003;
/// Power over that of the strongest bin, below which a changed response is left out.
constexpr double kLeastResponse = 1e-7;
constexpr std::size_t kMostBeamBins = 16;  ///< kMaxChannels
/// Farthest that a channel's range may lie from the mean one for responses to be taken to first order in it. Such a
/// response is wrong by half the square of this, times the window's curvature of 3: -38 dB.
constexpr double kNear_bins = 0.09;
/// Share of a path's power (of a weak path's power) below which a beam skips it.
constexpr double kOffBeam = 1e-7, kOffBeamWeak = 1e-3;

using Fields = EchoGroup::Fields;

/// Fields of a cell, [kOfCell][size]; extends the cells where needed.
std::complex<float>* cover(Fields& fields, int cell, std::size_t size) {
  const std::size_t of_cell = Fields::kOfCell * size;
  if (fields.cells == 0) fields.first = cell;
  if (cell < fields.first) {
    const auto before = static_cast<std::size_t>(fields.first - cell);
    fields.packed.insert(fields.packed.begin(), before * of_cell, {});
    for (std::vector<float>* v : {&fields.cosine, &fields.mean, &fields.squares}) v->insert(v->begin(), before, 0.0f);
    fields.first = cell;
  }
  const auto at = static_cast<std::size_t>(cell - fields.first);
  if (at >= fields.cosine.size()) {
    fields.packed.resize((at + 1) * of_cell);
    for (std::vector<float>* v : {&fields.cosine, &fields.mean, &fields.squares}) v->resize(at + 1);
  }
  fields.cells = static_cast<int>(fields.cosine.size());
  return fields.packed.data() + at * of_cell;
}

void accumulate(float factor, const std::vector<std::complex<float>>& packed, std::complex<float>* to) {
  for (std::size_t i = 0; i < packed.size(); ++i) to[i] += factor * packed[i];
}

double pathCosine(const PathRecord& record) {
  const auto cosine = [](const Eigen::Vector3d& d) {
    return std::sqrt(d.x() * d.x() + d.z() * d.z()) * (d.x() < 0 ? -1 : 1);
  };
  return 0.5 * (cosine(record.departure) + cosine(record.arrival));
}

}  // namespace

double hannResponse(double offset) {
  const double d = std::abs(offset);
  if (d < 1e-6) return 1;
  if (std::abs(d - 1) < 1e-6) return 0.5;
  return std::sin(M_PI * d) / (M_PI * d * (1 - d * d));
}

namespace {

/// Table of hannResponse() and its slope per bin, linear between entries; error below 2e-6.
class HannTable {
 public:
  HannTable() {
    constexpr double kStep = 1e-3;
    for (int i = 0; i <= kSize; ++i) {
      const double d = static_cast<double>(i) / kPerBin;
      response_[i] = hannResponse(d);
      slope_[i] = (hannResponse(d + kStep) - hannResponse(d - kStep)) / (2 * kStep);
    }
  }
  std::pair<double, double> at(double offset) const {
    const double place = std::min(std::abs(offset) * kPerBin, kSize - 1.0);
    const int i = static_cast<int>(place);
    const double f = place - i, slope = slope_[i] + f * (slope_[i + 1] - slope_[i]);
    return {response_[i] + f * (response_[i + 1] - response_[i]), offset < 0 ? -slope : slope};
  }

 private:
  static constexpr int kPerBin = 512, kSize = (kFarSkirt_bins + 1) * kPerBin;
  std::array<double, kSize + 1> response_, slope_;
};
const HannTable kHann;

}  // namespace

void addToSignature(const PathRecord& record, std::size_t& signature) {
  const auto sign = [&](double v) { boost::hash_combine(signature, v); };
  for (double v : record.length_m) sign(v);
  for (const std::complex<double>& v : record.c) sign(v.real()), sign(v.imag());
  sign(record.departure.y());
  sign(record.arrival.y());
}

EchoCollector::EchoCollector(const RadarConfig& radar, double angle_error_rad, const std::vector<EchoBeam>& beams,
                             const std::vector<double>& actor_range_m)
    : radar_(radar),
      beams_(beams),
      actor_range_m_(actor_range_m),
      angle_error_rad_(angle_error_rad),
      channels_(radar.channels()),
      samples_(radar.samples_per_chirp),
      size_(static_cast<std::size_t>(channels_) * (channels_ + 1) / 2),
      bin_m_(radar.range_bin_m()) {
  for (int k = 0; k < channels_; ++k) {
    element_phase_.push_back(2 * M_PI / radar.wavelength_m() * radar.virtual_element_m(k).y());
  }
}

double EchoCollector::addedRange_m(const PerInteraction<int>& actors) const {
  double sum = 0;
  if (actor_range_m_.empty()) return sum;
  for (int a : actors) sum += actor_range_m_[errorOf(a, actor_range_m_.size())];
  return sum;
}

const PerInteraction<int>& actorsOf(const PathRecord& record) {
  static const PerInteraction<int> lacking{-1};  // reflects off no actor
  return record.actors.empty() && record.bounces > 0 ? lacking : record.actors;
}

EchoGroup& EchoCollector::group(const PathRecord& record) {
  const PerInteraction<int>& actors = actorsOf(record);
  for (EchoGroup* g : open_) {
    if (g->actors == actors) return *g;
  }
  auto g = std::make_shared<EchoGroup>();
  g->actors = actors;
  g->added_range_m = addedRange_m(actors);
  open_.push_back(g.get());
  groups_.push_back(std::move(g));
  return *open_.back();
}

void EchoCollector::outer(const std::complex<double>* c, double cosine,
                          std::vector<std::complex<float>>& packed) const {
  packed.resize(size_);
  if (cosine == 0) {  // an error of the direction changes nothing
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
      // Expectation of exp(j(s_k - s_l)e) over a normal error e of the direction.
      const double apart = element_phase_[k] - element_phase_[l], x = spread * apart * apart;
      const double known = x < 0.01 ? 1 - x + 0.5 * x * x : std::exp(-x);  // equal in single precision
      packed[i++] = std::complex<float>(c[k] * std::conj(c[l]) * known);
    }
  }
}

namespace {

/// Fields of all bins of a group while its paths are added. The memory is reused from group to group and is zero
/// between groups.
struct OpenFields {
  std::vector<std::complex<float>> sums;
  std::vector<float> cosine, mean, squares;
  std::size_t size = 0, of_bin = 0;
  int first = 0, last = -1;

  void open(std::size_t packed_size, int bins) {
    size = packed_size;
    of_bin = Fields::kOfCell * size;
    if (sums.size() != of_bin * static_cast<std::size_t>(bins)) sums.assign(of_bin * static_cast<std::size_t>(bins), 0);
    for (std::vector<float>* v : {&cosine, &mean, &squares}) v->resize(static_cast<std::size_t>(bins));
    first = bins;
    last = -1;
  }
  /// power: of the path, mean over the channels.
  void add(int bin, const std::complex<float>* packed, const std::array<float, Fields::kOfCell>& factors,
           double mean_cosine, float power) {
    first = std::min(first, bin);
    last = std::max(last, bin);
    const auto at = static_cast<std::size_t>(bin);
    addMultiples(packed, size, factors.data(), factors.size(), sums.data() + at * of_bin);
    cosine[at] += factors[0] * static_cast<float>(mean_cosine) * packed[0].real();
    const float own = factors[0] * power;
    mean[at] += own;
    squares[at] += own * own;
  }
  /// Adds to the first fields of a bin that has a path's power already.
  void addShape(int bin, const std::complex<float>* packed, std::initializer_list<float> factors) {
    addMultiples(packed, size, factors.begin(), factors.size(), sums.data() + static_cast<std::size_t>(bin) * of_bin);
  }
  void close(Fields& to) {
    if (last < first) return;
    const auto from = sums.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(first) * of_bin),
               end = sums.begin() + static_cast<std::ptrdiff_t>(static_cast<std::size_t>(last + 1) * of_bin);
    to.first = first;
    to.cells = last + 1 - first;
    to.packed.assign(from, end);
    const auto hand = [&](std::vector<float>& own, std::vector<float>& other) {
      other.assign(own.begin() + first, own.begin() + last + 1);
      std::fill(own.begin() + first, own.begin() + last + 1, 0.0f);
    };
    hand(cosine, to.cosine);
    hand(mean, to.mean);
    hand(squares, to.squares);
    std::fill(from, end, 0.0f);
  }
};

thread_local OpenFields open_fields;

}  // namespace

std::shared_ptr<const EchoGroup> EchoCollector::addTones(const std::vector<const PathRecord*>& records,
                                                         double strongest) {
  open_.clear();
  EchoGroup& g = group(*records.front());
  open_fields.open(size_, samples_);
  for (const PathRecord* r : records) addTone(*r, r->amplitude * r->amplitude / strongest, g);
  open_fields.close(g.bins);
  open_.clear();
  return groups_.back();
}

void EchoCollector::addApart(const PathRecord& record, int reach, bool strong, EchoGroup& group) {
  const double cosine = pathCosine(record);
  const auto channels = static_cast<std::size_t>(channels_);
  thread_local std::vector<double> place;
  thread_local std::vector<std::complex<double>> response, slope, both;
  thread_local std::vector<std::complex<float>> power, curvature, shift;
  for (auto* v : {&response, &slope, &both}) v->resize(channels);
  place.resize(channels);
  for (std::size_t k = 0; k < channels; ++k) place[k] = (0.5 * record.length_m[k] + group.added_range_m) / bin_m_;
  const auto respond = [&](double bin, std::size_t k) {
    const auto [w, per_bin] = kHann.at(bin - place[k]);
    return std::make_pair(w, -per_bin / bin_m_);
  };
  const auto [low, high] = std::minmax_element(place.begin(), place.end());
  const int first = static_cast<int>(std::lround(*low)) - reach, last = static_cast<int>(std::lround(*high)) + reach;
  for (int r = first; r <= std::min(last, first + samples_ - 1); ++r) {
    if (!strong && (r < 0 || r > samples_ - 1)) continue;
    double mean = 0;
    for (std::size_t k = 0; k < channels; ++k) {
      const auto [w, per_m] = respond(r, k);
      response[k] = record.c[k] * w;
      slope[k] = record.c[k] * per_m;
      both[k] = response[k] + slope[k];
      mean += std::norm(response[k]) / channels_;
    }
    outer(response.data(), cosine, power);
    outer(slope.data(), cosine, curvature);
    outer(both.data(), cosine, shift);  // (a + b)(a + b)^H - a a^H - b b^H = a b^H + b a^H
    for (std::size_t i = 0; i < shift.size(); ++i) shift[i] -= power[i] + curvature[i];
    const int bin = (r % samples_ + samples_) % samples_;
    open_fields.add(bin, power.data(), {1, 0, 0}, cosine, static_cast<float>(mean));
    open_fields.add(bin, shift.data(), {0, 1, 0}, 0, 0);
    open_fields.add(bin, curvature.data(), {0, 0, 1}, 0, 0);
  }
  // Beams: formed of channels that each have their own place.
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const EchoBeam& beam = beams_[b];
    if (*high < beam.first_bin - kLobe_bins || *low > beam.first_bin + channels_ - 1 + kLobe_bins) continue;
    for (std::size_t i = 0; i < channels; ++i) {
      response[i] = slope[i] = 0;
      for (std::size_t k = 0; k < channels; ++k) {
        const auto [w, per_m] = respond(beam.first_bin + static_cast<double>(i), k);
        const std::complex<double> formed = std::conj(beam.weights[static_cast<Eigen::Index>(k)]) * record.c[k];
        response[i] += formed * w;
        slope[i] += formed * per_m;
      }
    }
    addBeam(static_cast<int>(b), response, slope, group.beams);
  }
}

void EchoCollector::addBeam(int beam, const std::vector<std::complex<double>>& response,
                            const std::vector<std::complex<double>>& slope, EchoGroup::Fields& beams) const {
  std::complex<float>* to = cover(beams, beam, size_);
  const auto add = [&](const auto& value) {
    for (std::size_t i = 0; i < response.size(); ++i) {
      for (std::size_t j = 0; j <= i; ++j) *to++ += std::complex<float>(value(i, j));
    }
  };
  add([&](std::size_t i, std::size_t j) { return response[i] * std::conj(response[j]); });
  add([&](std::size_t i, std::size_t j) {
    return response[i] * std::conj(slope[j]) + slope[i] * std::conj(response[j]);
  });
  add([&](std::size_t i, std::size_t j) { return slope[i] * std::conj(slope[j]); });
  double own = 0;
  for (const std::complex<double>& v : response) own += std::norm(v) / channels_;
  const auto at = static_cast<std::size_t>(beam - beams.first);
  beams.mean[at] += static_cast<float>(own);
  beams.squares[at] += static_cast<float>(own * own);
}

void EchoCollector::addTone(const PathRecord& record, double share, EchoGroup& group) {
  const bool weak = share < kWeakShare;
  const double cosine = pathCosine(record), place = (0.5 * meanLength_m(record) + group.added_range_m) / bin_m_;
  const bool strong = share >= kStrongShare;
  const int reach = weak ? kLobe_bins : strong ? std::min(kFarSkirt_bins, samples_ / 2 - 1) : kSkirt_bins;
  thread_local std::vector<std::complex<double>> c_apart, both;  // channels times their ranges beside the mean, in bins
  double farthest = 0;
  if (!weak) {
    c_apart.resize(record.c.size());
    for (std::size_t k = 0; k < c_apart.size(); ++k) {
      const double apart = (0.5 * record.length_m[k] + group.added_range_m) / bin_m_ - place;
      c_apart[k] = record.c[k] * apart;
      farthest = std::max(farthest, std::abs(apart));
    }
    if (farthest > kNear_bins) {
      addApart(record, reach, strong, group);
      return;
    }
  }
  const int middle = static_cast<int>(std::lround(place));
  if (middle + reach < 0 || middle - reach > samples_ - 1) return;
  thread_local std::vector<std::complex<float>> packed, squares, products;
  outer(record.c.data(), weak ? 0 : cosine, packed);  // a weak path's own angle error is negligible beside the others'
  if (!weak) {
    both.resize(record.c.size());
    for (std::size_t k = 0; k < both.size(); ++k) both[k] = record.c[k] + c_apart[k];
    outer(c_apart.data(), cosine, squares);
    outer(both.data(), cosine, products);  // (a + b)(a + b)^H - a a^H - b b^H = a b^H + b a^H
    for (std::size_t i = 0; i < size_; ++i) products[i] -= packed[i] + squares[i];
  }
  // Spectra are periodic: the skirt of an echo near the first bin continues in the last ones.
  double power = 0;
  for (const std::complex<double>& c : record.c) power += std::norm(c) / channels_;
  const bool around = strong && (middle - reach < 0 || middle + reach > samples_ - 1);
  const int low = around ? 0 : std::max(0, middle - reach),
            high = around ? samples_ - 1 : std::min(samples_ - 1, middle + reach);
  for (int r = middle - reach; r <= middle + reach; ++r) {
    if (!around && (r < low || r > high)) continue;
    const int bin = (r + samples_) % samples_;
    const auto [w, per_bin] = kHann.at(r - place);
    const double slope = -per_bin / bin_m_;
    const auto f = [](double v) { return static_cast<float>(v); };
    open_fields.add(bin, packed.data(), {f(w * w), f(2 * w * slope), f(slope * slope)}, cosine, f(power));
    if (weak) continue;
    // A channel that lies `apart` farther answers with w - per_bin apart, and so it is when all are shifted.
    open_fields.addShape(bin, products.data(), {f(-w * per_bin), f(-slope * per_bin)});
    open_fields.addShape(bin, squares.data(), {f(per_bin * per_bin)});
  }
  if (weak) {
    addToBeams(record.c.data(), place, kOffBeamWeak, group.beams);
  } else {
    addToBeams(record.c.data(), c_apart.data(), place, group.beams);
  }
}

void EchoCollector::add(const PathRecord& record, const Eigen::MatrixXcd& y, const Eigen::MatrixXcd& slope) {
  EchoGroup& g = group(record);
  const double cosine = pathCosine(record);
  const Eigen::VectorXd level = y.colwise().squaredNorm().transpose();
  const double least = kLeastResponse * level.maxCoeff();
  if (!(least > 0)) return;
  int first = 0, last = samples_ - 1;
  while (level[first] < least) ++first;
  while (level[last] < least) --last;
  // Responses and their derivatives are taken together, so that the covariance stays definite when it is shifted.
  std::vector<std::complex<float>> packed;
  const auto addProducts = [&](Fields& f, int at, const Eigen::VectorXcd& c, const Eigen::VectorXcd& d, double turns) {
    std::complex<float>*power = cover(f, at, size_), *shift = power + size_, *curvature = shift + size_;
    outer(c.data(), turns, packed);
    accumulate(1, packed, power);
    const auto i = static_cast<std::size_t>(at - f.first);
    f.cosine[i] += static_cast<float>(turns) * packed[0].real();
    const auto own = static_cast<float>(c.squaredNorm() / channels_);
    f.mean[i] += own;
    f.squares[i] += own * own;
    accumulate(-1, packed, shift);
    outer(d.data(), turns, packed);
    accumulate(-1, packed, shift);
    accumulate(1, packed, curvature);
    const Eigen::VectorXcd both = c + d;  // (c + d)(c + d)^H - c c^H - d d^H = c d^H + d c^H
    outer(both.data(), turns, packed);
    accumulate(1, packed, shift);
  };
  for (int r = first; r <= last; ++r) {
    if (level[r] >= least) addProducts(g.bins, r, y.col(r), slope.col(r), cosine);
  }
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const Eigen::VectorXcd formed = formBeam(beams_[b], y);
    if (formed.squaredNorm() >= least) {
      addProducts(g.beams, static_cast<int>(b), formed, formBeam(beams_[b], slope), 0);
    }
  }
}

void EchoCollector::addToBeams(const std::complex<double>* c, double place, double off, Fields& beams) const {
  std::array<double, kMostBeamBins> w, slope;
  double all = 0;
  for (int k = 0; k < channels_; ++k) all += std::norm(c[k]);
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const EchoBeam& beam = beams_[b];
    const double middle = place - beam.first_bin;
    if (middle < -kLobe_bins || middle > channels_ - 1 + kLobe_bins) continue;
    std::complex<double> formed = 0;
    for (int k = 0; k < channels_; ++k) formed += std::conj(beam.weights[k]) * c[k];
    const double level = std::norm(formed);
    if (level < off * all) continue;
    for (int i = 0; i < channels_; ++i) {
      const auto [response, per_bin] = kHann.at(i - middle);
      w[static_cast<std::size_t>(i)] = response;
      slope[static_cast<std::size_t>(i)] = -per_bin / bin_m_;
    }
    std::complex<float>* to = cover(beams, static_cast<int>(b), size_);
    const auto add = [&](auto value) {
      for (int i = 0; i < channels_; ++i) {
        for (int j = 0; j <= i; ++j) *to++ += static_cast<float>(level * value(i, j));
      }
    };
    add([&](int i, int j) { return w[i] * w[j]; });
    add([&](int i, int j) { return w[i] * slope[j] + slope[i] * w[j]; });
    add([&](int i, int j) { return slope[i] * slope[j]; });
    double own = 0;
    for (int i = 0; i < channels_; ++i) own += level * w[i] * w[i] / channels_;
    const std::size_t at = static_cast<std::size_t>(static_cast<int>(b) - beams.first);
    beams.mean[at] += static_cast<float>(own);
    beams.squares[at] += static_cast<float>(own * own);
  }
}

void EchoCollector::addToBeams(const std::complex<double>* c, const std::complex<double>* c_apart, double place,
                               Fields& beams) const {
  thread_local std::vector<std::complex<double>> responses, slopes;
  responses.resize(static_cast<std::size_t>(channels_));
  slopes.resize(responses.size());
  double all = 0;
  for (int k = 0; k < channels_; ++k) all += std::norm(c[k]);
  for (std::size_t b = 0; b < beams_.size(); ++b) {
    const EchoBeam& beam = beams_[b];
    const double middle = place - beam.first_bin;
    if (middle < -kLobe_bins || middle > channels_ - 1 + kLobe_bins) continue;
    std::complex<double> formed = 0, formed_apart = 0;
    for (int k = 0; k < channels_; ++k) {
      formed += std::conj(beam.weights[k]) * c[k];
      formed_apart += std::conj(beam.weights[k]) * c_apart[k];
    }
    if (std::norm(formed) + std::norm(formed_apart) < kOffBeam * all) continue;
    for (std::size_t i = 0; i < responses.size(); ++i) {
      const auto [response, per_bin] = kHann.at(static_cast<double>(i) - middle);
      responses[i] = formed * response - formed_apart * per_bin;
      slopes[i] = -formed * per_bin / bin_m_;
    }
    addBeam(static_cast<int>(b), responses, slopes, beams);
  }
}

std::vector<std::shared_ptr<const EchoGroup>> EchoCollector::take() {
  open_.clear();
  return std::exchange(groups_, {});
}

}  // namespace mmradartwin::diagnosis::echoes
