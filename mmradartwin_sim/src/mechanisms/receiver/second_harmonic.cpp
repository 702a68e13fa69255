#include <algorithm>
#include <cmath>
#include <numeric>

#include "mechanisms/base/built_in_mechanism.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kSecondHarmonic = "second_harmonic";

/// Echoes of echoes, with the product of two echoes' amplitudes. Kind harmonic: a square law ahead of the sampler's
/// filter gives the sums of beat frequencies; an echo by itself stands at 2 (R + bias), with twice its phase in every
/// channel. Kind bounce: the wave returns to the radar, whose body sends it out again; it arrives as its last path does
/// and passes the radar's delay once, at R + R' + bias, and an echo by itself also a third time, at 3 R + bias with the
/// square of the level. What lies beyond the sampling rate is filtered off. Of the paths, the strongest 60 take part.
class SecondHarmonic : public Mechanism, public DistortionStage {
 public:
  const std::string& name() const override { return kSecondHarmonic; }
  std::vector<ParameterSpec> parameters() const override {
    return {
        tried(numberSpec("level_db", "dB", -200, 0, "against the host, at the session's strongest host"), -200, -25),
        alsoAt(textSpec("kind", false, "harmonic", "harmonic: of a square law; bounce: between radar and scene"),
               "bounce")};
  }
  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    level_ = std::pow(10.0, values.number("level_db") / 20);
    const std::string& kind = values.text("kind");
    if (kind != "harmonic" && kind != "bounce") {
      throw InputError("mechanism second_harmonic: key kind: '" + kind + "' is unknown; allowed: harmonic, bounce");
    }
    bounces_ = kind == "bounce";
  }
  int rank() const override { return -5; }
  bool needsStrongestAmplitude() const override { return true; }
  void distort(const PoseContext& context, const std::vector<PathRecord>& paths, ComplexGrid& x) const override {
    const double strongest = context.strongest_amplitude();
    if (!(strongest > 0) || paths.empty()) return;
    const double level = level_ / strongest;
    std::vector<PathRecord> products;
    const auto add = [&](PathRecord product) {
      if (product.length_m[0] <= 0.95 * 2 * context.max_range_m) products.push_back(std::move(product));
    };
    const std::vector<const PathRecord*> hosts = strongestOf(paths);
    for (std::size_t i = 0; i < hosts.size(); ++i) {
      for (std::size_t j = i; j < hosts.size(); ++j) {
        const PathRecord &a = *hosts[i], &b = *hosts[j];
        if (!bounces_) {
          add(productOf(a, b, (i == j ? 1.0 : 2.0) * level));
          continue;
        }
        add(bounceOf(a, b, level, context.delay_m));
        if (i == j) {
          add(bounceOf(a, bounceOf(a, a, level, context.delay_m), level, context.delay_m));
        } else {
          add(bounceOf(b, a, level, context.delay_m));
        }
      }
    }
    accumulate(context.radar, products, x);
  }

 private:
  static std::vector<const PathRecord*> strongestOf(const std::vector<PathRecord>& paths) {
    constexpr std::size_t kHosts = 60;
    std::vector<double> power(paths.size(), 0);
    for (std::size_t i = 0; i < paths.size(); ++i) {
      for (const auto& c : paths[i].c) power[i] += std::norm(c);
    }
    std::vector<std::size_t> order(paths.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const std::size_t count = std::min(kHosts, order.size());
    std::partial_sort(
        order.begin(), order.begin() + static_cast<std::ptrdiff_t>(count), order.end(),
        [&power](std::size_t a, std::size_t b) { return power[a] != power[b] ? power[a] > power[b] : a < b; });
    std::vector<const PathRecord*> hosts;
    for (std::size_t i = 0; i < count; ++i) hosts.push_back(&paths[order[i]]);
    return hosts;
  }

  /// c^2 is the square at the window's centre, and lengths add as beat frequencies do.
  static PathRecord productOf(const PathRecord& a, const PathRecord& b, double factor) {
    PathRecord product;
    for (std::size_t k = 0; k < a.c.size(); ++k) {
      product.length_m.push_back(a.length_m[k] + b.length_m[k]);
      product.c.push_back(factor * a.c[k] * b.c[k]);
    }
    return product;
  }

  /// Path b after path a over the radar's body, which stands about its first element.
  static PathRecord bounceOf(const PathRecord& a, const PathRecord& b, double factor, double delay_m) {
    PathRecord bounce;
    for (std::size_t k = 0; k < b.c.size(); ++k) {
      bounce.length_m.push_back(a.length_m[0] - delay_m + b.length_m[k]);
      bounce.c.push_back(factor * a.c[0] * b.c[k]);
    }
    return bounce;
  }

  double level_ = 0;
  bool bounces_ = false;
};

}  // namespace

MMRADARTWIN_REGISTER_BUILT_IN_MECHANISM(SecondHarmonic)

}  // namespace mmradartwin
