#include <cmath>
#include <cstring>

#include "../polarisation.h"
#include "builtin.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

const std::string kName = "diffuse";

/// SplitMix64: one step turns any number into an unrelated one.
std::uint64_t scramble(std::uint64_t x) {
  x += 0x9E3779B97F4A7C15ULL;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
  return x ^ (x >> 31);
}

double unitInterval(std::uint64_t h) { return static_cast<double>(h >> 11) * 0x1.0p-53; }

std::uint64_t hashText(const std::string& text) {
  std::uint64_t h = 1469598103934665603ULL;
  for (unsigned char c : text) h = (h ^ c) * 1099511628211ULL;
  return h;
}

/// Integral of ((1 + cos psi)/2)^alpha over the hemisphere, psi from the specular direction.
/// Source: Degli-Esposti et al. 2007, eq. 12 (F_alpha).
double directiveNorm(int alpha, double cos_theta) {
  const double sin2 = 1 - cos_theta * cos_theta;
  double sum = 0, binomial = 1;
  for (int k = 0; k <= alpha; ++k) {
    double inner = 1;
    if (k % 2 == 1) {
      double term = 1;
      inner = 0;
      for (int w = 0; w <= (k - 1) / 2; ++w) {
        inner += term;
        term *= sin2 * (2.0 * w + 1) / (2.0 * w + 2);  // binom(2w,w)/4^w
      }
      inner *= cos_theta;
    }
    sum += binomial * 2 * M_PI / (k + 1) * inner;
    binomial *= static_cast<double>(alpha - k) / (k + 1);
  }
  return sum / std::pow(2.0, alpha);
}

class Diffuse : public Mechanism {
 public:
  const std::string& name() const override { return kName; }

  std::vector<ParameterSpec> parameters() const override {
    ParameterSpec alpha = numberSpec("alpha", "1", 1, 100, 4, "width of the directive lobe");
    alpha.kind = ParameterKind::kInteger;
    return {numberSpec("spacing_m", "m", 0.005, 5, 0.1, "mean distance of scatter points"),
            textSpec("lobe", false, "lambertian", "lambertian or directive"), alpha};
  }

  void configure(const Parameters& values, const Scene&, const RadarConfig&) override {
    spacing_m_ = values.number("spacing_m");
    const std::string& lobe = values.text("lobe");
    if (lobe != "lambertian" && lobe != "directive") {
      throw InputError("mechanism diffuse: key lobe: '" + lobe + "' is unknown; allowed: lambertian, directive");
    }
    directive_ = lobe == "directive";
    alpha_ = static_cast<int>(values.number("alpha"));
  }

  void build(const Scene& scene, const RadarConfig& radar) override {
    points_.clear();
    for (const Actor& actor : scene.actors) {
      if (!actor.present || backscatterAmplitude(actor.material, 1, 1, radar.center_frequency_hz()) <= 0) continue;
      const std::uint64_t actor_hash = hashText(actor.name);
      for (std::size_t i = 0; i < actor.facets.size(); ++i) {
        const Facet& facet = scene.facets[actor.facets[i]];
        if (facet.reflects && facet.present) addPoints(facet, scramble(actor_hash + i));
      }
    }
  }

  void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const override {
    const ElementsInMap elements(context);
    const double spreading = context.radar.wavelength_m() / (4 * M_PI);
    const Eigen::Matrix3d to_radar = context.T_map_radar.linear().transpose();
    const double max2 = context.max_range_m * context.max_range_m;
    for (const Point& point : points_) {
      const Eigen::Vector3d way = point.position - elements.p;
      const double r2 = way.squaredNorm();
      if (r2 > max2 || r2 < 1e-6) continue;
      const double r = std::sqrt(r2);
      const Eigen::Vector3d direction_radar = to_radar * way / r;
      if (!context.inFieldOfView(direction_radar)) continue;
      const Facet& facet = context.scene.facets[point.facet];
      const Eigen::Vector3d in = way / r;
      const double cosine = std::min(1.0, std::abs(in.dot(facet.normal)));
      const Material& material = context.scene.actors[facet.actor].material;
      const double te = verticalField(elements.up, in).dot(transverse(in, facet.normal));
      double amplitude = spreading / r2 *
                         backscatterAmplitude(material, cosine, std::min(1.0, te * te), context.frequency_hz) *
                         std::sqrt(point.area_m2 / M_PI);
      if (directive_ && cosine > 0) {
        // Monostatic: the specular direction lies 2 theta away, (1 + cos 2 theta)/2 = cos^2 theta; Lambert's cos/pi is
        // replaced.
        amplitude *= std::sqrt(M_PI * std::pow(cosine * cosine, alpha_) / (directiveNorm(alpha_, cosine) * cosine));
      }
      if (!(amplitude > 0)) continue;
      const double gap = std::max(1e-3, 2 * facet.flatness_m / std::max(0.1, cosine));
      if (!context.rays.visible(elements.p, point.position, gap)) continue;
      PathRecord record;
      record.event = &kName;
      record.actors = {facet.actor};
      record.facets = {facet.id};
      record.vertices = {point.position};
      record.departure = record.arrival = direction_radar;
      record.bounces = 1;
      record.length_m = elements.lengthsVia(point.position);
      const double phase = 2 * M_PI * unitInterval(scramble(point.hash ^ scramble(context.seed)));
      setContribution(context.radar, std::polar(amplitude, phase), record);
      records.push_back(std::move(record));
    }
  }

 private:
  struct Point {
    Eigen::Vector3d position;
    int facet;
    double area_m2;
    std::uint64_t hash;
  };

  /// One point in each cell of a grid in the facet's own coordinates, anywhere in its cell; all from hashes of facet
  /// and cell, so that the points move with the facet and nothing else changes them.
  void addPoints(const Facet& facet, std::uint64_t facet_hash) {
    const int n1 = std::max(1, static_cast<int>(std::lround(facet.size1_m / spacing_m_)));
    const int n2 = std::max(1, static_cast<int>(std::lround(facet.size2_m / spacing_m_)));
    if (static_cast<double>(n1) * n2 > 4e6) {
      throw InputError("mechanism diffuse: key spacing_m: " + std::to_string(spacing_m_) +
                       " m gives millions of scatter points on one facet; choose a wider spacing");
    }
    const double d1 = facet.size1_m / n1, d2 = facet.size2_m / n2;
    const std::size_t first = points_.size();
    for (int i = 0; i < n1; ++i) {
      for (int j = 0; j < n2; ++j) {
        const std::uint64_t h =
            scramble(facet_hash ^ scramble((static_cast<std::uint64_t>(i) << 32) | static_cast<std::uint32_t>(j)));
        const Eigen::Vector3d q = facet.origin + (i + unitInterval(scramble(h + 1))) * d1 * facet.e1 +
                                  (j + unitInterval(scramble(h + 2))) * d2 * facet.e2;
        if (!facet.rectangle && !facet.contains(q)) continue;
        points_.push_back({q, facet.id, d1 * d2, h});
      }
    }
    if (points_.size() == first) {
      // Too slim for any cell's point: one stands for the whole.
      const Eigen::Vector3d middle = facet.origin + 0.5 * (facet.size1_m * facet.e1 + facet.size2_m * facet.e2);
      points_.push_back({facet.nearest(middle, 1e-3), facet.id, facet.area_m2, facet_hash});
      return;
    }
    const double scale = facet.area_m2 / (d1 * d2 * static_cast<double>(points_.size() - first));
    for (std::size_t i = first; i < points_.size(); ++i) points_[i].area_m2 *= scale;
  }

  double spacing_m_ = 0.1;
  bool directive_ = false;
  int alpha_ = 4;
  std::vector<Point> points_;
};

}  // namespace

std::unique_ptr<Mechanism> makeDiffuse() { return std::make_unique<Diffuse>(); }

}  // namespace mmradartwin
