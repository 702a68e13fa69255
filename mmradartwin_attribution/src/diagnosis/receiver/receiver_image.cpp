#include "diagnosis/receiver/receiver_image.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <complex>
#include <numeric>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/range_angle.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr double kDbPerNeper = 8.685889638065035;
constexpr Eigen::Index kFirst = 2;  ///< first bin: leakage and offset lie below, and their images at the end
constexpr int kIterations = 6;      ///< alternations between the image and the power beside it

}  // namespace

bool measureImage(const ChannelData& data, Finding& finding) {
  const std::size_t locations = data.locations.size();
  if (locations < 3) return false;
  std::vector<std::complex<double>> shared;
  std::vector<double> host;
  std::complex<double> beta = 0;
  double hosts = 0;
  // Cells are weighted by the power beside the image. Weights by the total power would favour cells in which echoes of
  // the room weaken the image.
  for (int i = 0; i < kIterations; ++i) {
    shared.assign(locations, 0.0);
    host.assign(locations, 0.0);
    for (const PoseChannels& p : data.poses) {
      const std::size_t l = static_cast<std::size_t>(p.location);
      for (Eigen::Index k = kFirst; k <= p.range_spectra.cols() - kFirst; ++k) {
        const Eigen::VectorXcd there = p.range_spectra.col(p.range_spectra.cols() - k).conjugate();
        const double beside = (p.range_spectra.col(k) - beta * there).squaredNorm();
        if (!(beside > 0) || there.squaredNorm() < bounds::kLeastHostOverImage * beside) continue;
        shared[l] += there.dot(p.range_spectra.col(k)) / beside;
        host[l] += there.squaredNorm() / beside;
      }
    }
    hosts = std::accumulate(host.begin(), host.end(), 0.0);
    if (!(hosts > 0)) return false;
    beta = std::accumulate(shared.begin(), shared.end(), std::complex<double>()) / hosts;
  }
  double scatter = 0;
  for (std::size_t l = 0; l < locations; ++l) {
    scatter += std::pow(std::real((shared[l] - beta * host[l]) * std::conj(beta)) / std::norm(beta) / hosts, 2);
  }
  const double n = static_cast<double>(locations);
  const double width = boost::math::quantile(boost::math::students_t(n - 1), 0.975);
  const double half_db = width * std::max(bounds::kImageError_db, kDbPerNeper * std::sqrt(scatter * n / (n - 1)));
  const double image_db = kDbPerNeper * std::log(std::abs(beta));
  finding.mechanism->values.set("image_db", image_db);
  finding.mechanism->values.set("phase_deg", std::arg(beta) * 180 / M_PI);
  for (FindingParameter& p : finding.parameters) {
    if (p.name != "image_db") continue;
    p.value = image_db;
    p.ci95 = {{image_db - half_db, image_db + half_db}};
  }
  return true;
}

void subtractImage(const NamedParameters& m, ChannelData& data) {
  const std::complex<double> beta =
      std::polar(std::pow(10.0, m.values.number("image_db") / 20), m.values.number("phase_deg") * M_PI / 180);
  const SignalChain chain(data.radar);
  for (PoseChannels& p : data.poses) {
    p.grid.x -= beta * p.grid.x.conjugate().eval();
    transformGrid(chain, p);
  }
}

}  // namespace mmradartwin::diagnosis::receiver
