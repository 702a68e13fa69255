#include "diagnosis/receiver/receiver_image.h"

#include <algorithm>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <complex>
#include <vector>

#include "diagnosis/catalogue/bounds.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/units.h"

namespace mmradartwin::diagnosis::receiver {
namespace {

constexpr Eigen::Index kFirst = 2;  ///< first bin: leakage and offset lie below, and their images at the end
constexpr int kIterations = 6;      ///< alternations between the image and the power beside it

double levelOf_db(std::complex<double> beta) { return kNeperOfAmplitude_db * std::log(std::abs(beta)); }

/// Least standard error of an image of that size.
double leastError(std::complex<double> beta) { return std::abs(beta) * bounds::kImageError_db / kNeperOfAmplitude_db; }

/// True where the receivers' images differ by more than chance and what a level is known by: the F test of means whose
/// variances follow from as many locations.
bool doDiffer(const Eigen::VectorXcd& beta, std::complex<double> common, const Eigen::VectorXd& variance,
              std::size_t locations) {
  const double free = 2 * static_cast<double>(beta.size() - 1);
  if (free <= 0) return false;
  double apart = 0;
  for (Eigen::Index r = 0; r < beta.size(); ++r) {
    apart += 2 * std::norm(beta[r] - common) / std::max(variance[r], 2 * std::pow(leastError(beta[r]), 2));
  }
  const boost::math::fisher_f distribution(free, 2 * static_cast<double>(locations - 1));
  return boost::math::cdf(boost::math::complement(distribution, apart / free)) < bounds::kReceiversDiffer;
}

}  // namespace

std::optional<MeasuredImage> readImage(const ChannelData& data) {
  const auto locations = static_cast<Eigen::Index>(data.locations.size());
  if (locations < 3) return std::nullopt;
  const Eigen::Index receivers = data.radar.receivers();
  Eigen::MatrixXcd shared;  // [locations][receivers]
  Eigen::MatrixXd host;
  MeasuredImage image;
  image.beta.setZero(receivers);
  // Cells are weighted by the power beside the image. Weights by the total power would favour cells in which echoes of
  // the room weaken the image.
  for (int i = 0; i < kIterations; ++i) {
    shared.setZero(locations, receivers);
    host.setZero(locations, receivers);
    for (const PoseChannels& p : data.poses) {
      for (Eigen::Index k = kFirst; k <= p.range_spectra.cols() - kFirst; ++k) {
        const auto here = p.range_spectra.col(k);
        const Eigen::VectorXcd there = p.range_spectra.col(p.range_spectra.cols() - k).conjugate();
        double beside = 0;
        for (Eigen::Index c = 0; c < there.size(); ++c) {
          beside += std::norm(here[c] - image.beta[c % receivers] * there[c]);
        }
        if (!(beside > 0) || there.squaredNorm() < bounds::kLeastHostOverImage * beside) continue;
        for (Eigen::Index c = 0; c < there.size(); ++c) {
          shared(p.location, c % receivers) += std::conj(there[c]) * here[c] / beside;
          host(p.location, c % receivers) += std::norm(there[c]) / beside;
        }
      }
    }
    if (!(host.colwise().sum().minCoeff() > 0)) return std::nullopt;
    for (Eigen::Index r = 0; r < receivers; ++r) image.beta[r] = shared.col(r).sum() / host.col(r).sum();
  }
  image.common = shared.sum() / host.sum();
  const double n = static_cast<double>(locations), unbiased = n / (n - 1);
  const auto errorAlong = [&](const Eigen::VectorXcd& s, const Eigen::VectorXd& h, std::complex<double> beta) {
    double scatter = 0;
    for (Eigen::Index l = 0; l < locations; ++l) {
      scatter += std::pow(std::real((s[l] - beta * h[l]) * std::conj(beta)) / std::abs(beta) / h.sum(), 2);
    }
    return std::max(leastError(beta), std::sqrt(unbiased * scatter));
  };
  Eigen::VectorXd variance(receivers);
  image.error.resize(receivers);
  for (Eigen::Index r = 0; r < receivers; ++r) {
    image.error[r] = errorAlong(shared.col(r), host.col(r), image.beta[r]);
    const Eigen::VectorXcd rest = shared.col(r) - image.beta[r] * host.col(r).cast<std::complex<double>>();
    variance[r] = unbiased * rest.squaredNorm() / std::pow(host.col(r).sum(), 2);
  }
  image.common_error = errorAlong(shared.rowwise().sum(), host.rowwise().sum(), image.common);
  image.differ = doDiffer(image.beta, image.common, variance, data.locations.size());
  return image;
}

bool measureImage(const ChannelData& data, Finding& finding) {
  const std::optional<MeasuredImage> image = readImage(data);
  if (!image) return false;
  const double width =
      boost::math::quantile(boost::math::students_t(static_cast<double>(data.locations.size()) - 1), 0.975);
  FindingParameter level{"image_db", "dB", levelOf_db(image->common), {}};
  const auto addInterval = [&](FindingParameter& p, double value, double half) {
    p.ci95.push_back({value - half, value + half});
  };
  const auto replace = [&finding](FindingParameter parameter) {
    finding.mechanism->values.set(parameter.name, parameter.value);
    std::vector<FindingParameter>& all = finding.parameters;
    all.erase(std::remove_if(all.begin(), all.end(), [&](const auto& p) { return p.name == parameter.name; }),
              all.end());
    all.push_back(std::move(parameter));
  };
  if (!image->differ) {
    addInterval(level, levelOf_db(image->common),
                width * kNeperOfAmplitude_db * image->common_error / std::abs(image->common));
    replace(std::move(level));
    finding.mechanism->values.set("phase_deg", std::arg(image->common) / kDegree);
    return true;
  }
  std::vector<double> level_db, phase_deg;
  FindingParameter phase{"phase_deg", "deg", 0.0, {}};
  for (Eigen::Index r = 0; r < image->beta.size(); ++r) {
    const double share = width * image->error[r] / std::abs(image->beta[r]);
    level_db.push_back(levelOf_db(image->beta[r]));
    phase_deg.push_back(std::arg(image->beta[r]) / kDegree);
    addInterval(level, level_db.back(), kNeperOfAmplitude_db * share);
    addInterval(phase, phase_deg.back(), 1 / kDegree * share);
  }
  level.value = level_db;
  phase.value = phase_deg;
  replace(std::move(level));
  replace(std::move(phase));
  return true;
}

void subtractImage(const NamedParameters& m, ChannelData& data) {
  const Eigen::Index receivers = data.radar.receivers();
  const auto of = [&](const char* key, Eigen::Index receiver) {
    const auto* list = std::get_if<std::vector<double>>(&m.values.all().at(key));
    return list != nullptr ? list->at(static_cast<std::size_t>(receiver)) : m.values.number(key);
  };
  Eigen::VectorXcd beta(receivers);
  for (Eigen::Index r = 0; r < receivers; ++r) {
    beta[r] = std::polar(std::pow(10.0, of("image_db", r) / 20), of("phase_deg", r) * kDegree);
  }
  const SignalChain chain(data.radar);
  for (PoseChannels& p : data.poses) {
    for (Eigen::Index k = 0; k < p.grid.x.rows(); ++k) {
      p.grid.x.row(k) -= beta[k % receivers] * p.grid.x.row(k).conjugate().eval();
    }
    transformGrid(chain, p);
  }
}

}  // namespace mmradartwin::diagnosis::receiver
