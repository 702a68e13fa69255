#include <algorithm>
#include <cmath>

#include "diagnosis/likelihood/channel_likelihood.h"

namespace mmradartwin::diagnosis::likelihood {

double ChannelLikelihood::floorOf(const PoseModel& model, int cell) const {
  const PoseChannels& p = data_.poses[model.pose];
  const int bin = binOf(model.pose, cell);
  const double clutter =
      isBeam(cell) ? p.beams[static_cast<std::size_t>(cell - samples_)].clutter : p.clutter.at(bin, size_)[0].real();
  return clutterLevel(model.latents, bin) * clutter + noiseOf(model.pose, cell);
}

void ChannelLikelihood::findStrongest(PoseModel& model) const {
  const std::size_t all = static_cast<std::size_t>(cells(model.pose));
  std::vector<double> mean(all), squares(all);
  model.strongest.assign(all, -1);
  model.cells.assign(model.echoes.all(), 0);
  for (std::size_t i = 0; i < model.echoes.groups.size(); ++i) {
    const EchoGroup& group = model.echoes.at(i);
    const double u = model.levels[i].gain;
    for (const EchoGroup::Fields* fields : {&group.bins, &group.beams}) {
      const int first = fields->first + (fields == &group.beams ? samples_ : 0);
      for (int k = 0; k < fields->cells; ++k) {
        const auto cell = static_cast<std::size_t>(first + k), at = static_cast<std::size_t>(k);
        mean[cell] += u * fields->mean[at];
        const double own = u * u * fields->squares[at];
        if (own <= squares[cell]) continue;
        squares[cell] = own;
        model.strongest[cell] = static_cast<int>(i);
      }
    }
  }
  for (int cell = firstBin(); cell < static_cast<int>(all); ++cell) {
    const auto at = static_cast<std::size_t>(cell);
    if (model.strongest[at] < 0) continue;
    const double total = mean[at] + floorOf(model, cell);
    model.cells[static_cast<std::size_t>(model.strongest[at])] += weight() * squares[at] / (total * total);
  }
}

CellEcho ChannelLikelihood::strongestEcho(const PoseModel& model, int cell) const {
  CellEcho echo;
  const int strongest = model.strongest[static_cast<std::size_t>(cell)];
  if (strongest < 0) return echo;
  const auto group = static_cast<std::size_t>(strongest);
  const auto fields = fieldsOf(model.echoes.at(group), cell);
  const auto [u, shift] = model.levels[group];
  PackedTurn turn;
  turn.set(apart_, turnOf(model.latents.yaw_rad[model.pose], *fields));
  PackedHermitian own(channels_);
  own.addTurned({fields->power, fields->shift, fields->curvature}, {u, u * shift, u * shift * shift}, turn);
  const double mean = own.trace() / channels_;
  if (!(mean > 0) || !(fields->mean > 0)) return echo;
  int column = 0;
  for (int k = 1; k < channels_; ++k) {
    const auto at = [&](int row) { return own.re[static_cast<std::size_t>(PackedHermitian::diagonal(row))]; };
    if (at(k) > at(column)) column = k;
  }
  double norm = 0;
  for (int k = 0; k < channels_; ++k) {
    const int row = std::max(k, column), other = std::min(k, column);
    const auto at = static_cast<std::size_t>(PackedHermitian::diagonal(row) - row + other);
    echo.direction[static_cast<std::size_t>(k)] = {own.re[at], k >= column ? own.im[at] : -own.im[at]};
    norm += std::norm(echo.direction[static_cast<std::size_t>(k)]);
  }
  const double to_unit = std::sqrt(channels_ / norm);
  for (int k = 0; k < channels_; ++k) echo.direction[static_cast<std::size_t>(k)] *= to_unit;
  echo.power = mean * std::sqrt(fields->squares) / fields->mean;
  echo.spread = std::exp(model.latents.log_spread) * std::max(1.0, model.cells[group]);
  return echo;
}

std::vector<ChannelLikelihood::ExpectedBin> ChannelLikelihood::expectedBins(const PoseEchoes& echoes,
                                                                            const SessionLatents& latents,
                                                                            int pose) const {
  std::vector<ExpectedBin> bins;
  const PoseModel model = modelOf(echoes, latents, pose);
  for (int bin = firstBin(); bin < samples_; ++bin) {
    bins.push_back(
        {bin, model.strongest[static_cast<std::size_t>(bin)], sigma(model, bin).full(), strongestEcho(model, bin)});
  }
  return bins;
}

std::vector<ChannelLikelihood::MissingEcho> ChannelLikelihood::withoutStrongest(const PoseEchoes& echoes,
                                                                                const SessionLatents& latents,
                                                                                int pose) const {
  std::vector<MissingEcho> bins(static_cast<std::size_t>(samples_));
  InverseFactor factor;
  std::array<std::complex<double>, kMaxChannels> z;
  const PoseModel model = modelOf(echoes, latents, pose);
  for (int bin = firstBin(); bin < samples_; ++bin) {
    const auto at = static_cast<std::size_t>(bin);
    if (model.strongest[at] < 0 || !factor.compute(sigma(model, bin))) continue;
    factor.apply(dataOf(pose, bin), z.data());
    const CellLikelihood with(factor, z.data(), strongestEcho(model, bin));
    bins[at] = {model.strongest[at], weight() * (with.withoutEcho() - with.logLikelihood())};
  }
  return bins;
}

}  // namespace mmradartwin::diagnosis::likelihood
