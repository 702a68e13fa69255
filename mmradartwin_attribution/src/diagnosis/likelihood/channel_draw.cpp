#include "diagnosis/likelihood/channel_draw.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <vector>

namespace mmradartwin::diagnosis::likelihood {

Eigen::MatrixXcd drawnChannels(const ChannelLikelihood& model, const PoseEchoes& echoes, const SessionLatents& latents,
                               int pose, std::mt19937& random) {
  std::normal_distribution<double> normal(0, 1);
  std::uniform_real_distribution<double> turn(0, 2 * M_PI);
  const int channels = model.data().radar.channels(), samples = model.data().radar.samples_per_chirp;
  Eigen::MatrixXcd drawn = Eigen::MatrixXcd::Zero(channels, samples);
  std::map<int, double> level;  // of each group's echo, about its mean
  std::vector<double> shares;
  for (const SpreadScale& scale : kSpreadScales) shares.push_back(scale.share);
  std::discrete_distribution<std::size_t> drawn_scale(shares.begin(), shares.end());
  for (const ChannelLikelihood::ExpectedBin& bin : model.expectedBins(echoes, latents, pose)) {
    Eigen::MatrixXcd rest = bin.covariance;
    if (bin.echo.power > 0) {
      const Eigen::Map<const Eigen::VectorXcd> s(bin.echo.direction.data(), channels);
      rest -= bin.echo.power * s * s.adjoint();
      const auto [known, fresh] = level.try_emplace(bin.group, 0);
      if (fresh) {
        const double variance = kSpreadScales[drawn_scale(random)].factor * std::exp(latents.log_spread);
        known->second = std::exp(0.5 * std::sqrt(std::min(variance, kMostSpread)) * normal(random));
      }
      drawn.col(bin.bin) += std::polar(std::sqrt(bin.echo.power) * known->second, turn(random)) * s;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> parts(rest);
    for (int k = 0; k < channels; ++k) {
      const double deviation = std::sqrt(std::max(0.0, parts.eigenvalues()[k]) / 2);
      const std::complex<double> amplitude(deviation * normal(random), deviation * normal(random));
      drawn.col(bin.bin) += amplitude * parts.eigenvectors().col(k);
    }
  }
  return drawn;
}

}  // namespace mmradartwin::diagnosis::likelihood
