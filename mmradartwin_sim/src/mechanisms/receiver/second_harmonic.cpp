#include <algorithm>
#include <cmath>
#include <numeric>

#include "mechanisms/base/built_in_mechanism.h"

namespace mmradartwin {
namespace {

const std::string kSecondHarmonic = "second_harmonic";

/// Square law ahead of the sampler's filter: echoes at the sums of beat frequencies, at twice the range for each echo
/// by itself. What lies beyond the sampling rate is filtered off. Of the paths, the strongest 60 take part.
class SecondHarmonic : public Mechanism, public DistortionStage {
 public:
  const std::string& name() const override { return kSecondHarmonic; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("level_db", "dB", -200, 0, "against the host, at the session's strongest host"), -200, -25)};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    level_ = std::pow(10.0, values.number("level_db") / 20);
  }
  int rank() const override { return -5; }
  bool needsStrongestAmplitude() const override { return true; }
  void distort(const PoseContext& context, const std::vector<PathRecord>& paths, ComplexGrid& x) const override {
    const double strongest = context.strongest_amplitude();
    if (!(strongest > 0) || paths.empty()) return;
    constexpr std::size_t kHosts = 60;
    std::vector<double> power(paths.size(), 0);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      for (const auto& c : paths[i].c) power[i] += std::norm(c);
    }
    std::vector<std::size_t> order(paths.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const std::size_t hosts = std::min(kHosts, order.size());
    std::partial_sort(
        order.begin(), order.begin() + static_cast<std::ptrdiff_t>(hosts), order.end(),
        [&power](std::size_t a, std::size_t b) { return power[a] != power[b] ? power[a] > power[b] : a < b; });
    // c^2 is the square at the window's centre, and lengths add as beat frequencies do.
    std::vector<PathRecord> products;
    for (std::size_t i = 0; i < hosts; ++i) {
      for (std::size_t j = i; j < hosts; ++j) {
        const PathRecord &a = paths[order[i]], &b = paths[order[j]];
        if (a.length_m[0] + b.length_m[0] > 0.95 * 2 * context.max_range_m) continue;
        PathRecord product;
        product.length_m.resize(a.c.size());
        product.c.resize(a.c.size());
        for (std::size_t k = 0; k < a.c.size(); ++k) {
          product.length_m[k] = a.length_m[k] + b.length_m[k];
          product.c[k] = (i == j ? 1.0 : 2.0) * level_ / strongest * a.c[k] * b.c[k];
        }
        products.push_back(std::move(product));
      }
    }
    accumulate(context.radar, products, x);
  }

 private:
  double level_ = 0;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(SecondHarmonic)

}  // namespace mmradartwin
