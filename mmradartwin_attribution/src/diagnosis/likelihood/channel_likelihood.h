#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/likelihood/expected_echoes.h"
#include "diagnosis/numbers/packed_hermitian.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

/// What no cause is: fitted in every hypothesis alike. Powers as natural logarithms.
struct SessionLatents {
  double log_gain = 0;                  ///< of measured power over the twin's
  double log_floor = 0;                 ///< clutter's power in a cell over PoseChannels::clutter
  std::array<double, 6> floor_shape{};  ///< departs from that at ranges, even in their logarithm; linear between
  double log_relative = -8;             ///< what differs from channel to channel of an echo, of its power
  double log_graze = 0;                 ///< factor of PoseEchoes::grazing
  double log_range = 0;                 ///< factor of the variance of a path's own range
  std::vector<double> actor_gain;       ///< as errorOf() has it: natural logarithm of power, per interaction
  std::vector<double> actor_range_m;    ///< the same: added one-way range, per interaction
  std::vector<double> yaw_rad;          ///< [poses] error of the heading

  /// Numbers that all poses share, in the order of scores.
  double& global(int j);
  double global(int j) const { return const_cast<SessionLatents*>(this)->global(j); }
  int globals() const { return 5 + static_cast<int>(floor_shape.size() + actor_gain.size() + actor_range_m.size()); }
};

/// Standard deviations that the latent errors are given.
struct LatentSpread {
  double actor_gain = 1.5 / 4.343;  ///< 1.5 dB of power
  double actor_range_m = 0.02;
};
/// Four times what a scene's actors err by: of some twenty none is farther away.
constexpr double kMostRangeError_m = 0.08;

/// Expected covariance of the channels in all bins of a pose, packed as BinCovariance.
using PoseCovariance = std::vector<std::complex<float>>;
using SessionCovariance = std::vector<PoseCovariance>;

/// Derivatives of the log-likelihood at one place: by location, so that their scatter shows what the model omits.
struct Scores {
  double log_likelihood = 0;     ///< with the priors of the latents
  Eigen::MatrixXd by_location;   ///< [locations][directions] scores; the heading of each pose eliminated
  Eigen::MatrixXd information;   ///< [directions][directions], priors included; the same
  Eigen::VectorXd total;         ///< [directions] scores, priors included
  Eigen::VectorXd prior;         ///< [globals] precision of what the latents of actors are known by beforehand
  std::vector<double> yaw_step;  ///< [poses] best change of the heading, all else as it is
  Eigen::MatrixXd yaw_coupling;  ///< [poses][directions] of that change by a change of the directions
};

/// One cell's whitened directions of the nuisance and the data in the same numbers: the likelihood's derivatives are
/// then products, and a further direction costs nothing but its own.
struct BinBasis {
  int cell = 0;
  InverseFactor factor;
  std::vector<int> active;   ///< directions that do something here; the heading is the last of all
  Eigen::MatrixXf whitened;  ///< [M^2][active]; kept in single precision: half of a long session's memory
  Eigen::VectorXd data, traces;
};
struct PoseBasis {
  double log_likelihood = 0;
  Eigen::VectorXd score;        ///< [globals + 1]
  Eigen::MatrixXd information;  ///< [globals + 1][globals + 1], the heading last
  std::vector<BinBasis> bins;
};
struct Basis {
  SessionLatents nuisance;
  std::vector<PoseBasis> poses;
};

/// Likelihood of a session's channels under expected echoes. Every bin's channels are complex t-distributed (4 degrees
/// of freedom in their complex form) about zero, with the covariance
///   gain * (echoes + grazing echoes + range errors + relative) + clutter + noise,
/// and so are every beam's bins (EchoBeam). Cells are the bins and, after them, the beams. Neighbouring bins overlap
/// through the window and beams are formed of them, so that each counts half (composite likelihood).
class ChannelLikelihood {
 public:
  /// Keeps a reference. actors: Scene::actors' number.
  ChannelLikelihood(const ChannelData& data, int actors, const PoseAccuracy& accuracy, const LatentSpread& spread = {});

  /// A start for fit(): levels from the data.
  SessionLatents start(const std::vector<PoseEchoes>& echoes) const;
  /// Log-likelihood with priors; by_pose without.
  double logLikelihood(const std::vector<PoseEchoes>& echoes, const SessionLatents& nuisance,
                       std::vector<double>* by_pose = nullptr) const;
  /// The same of the poses named alone, without priors; echoes[i] are those of poses[i].
  std::vector<double> byPose(const std::vector<PoseEchoes>& echoes, const SessionLatents& nuisance,
                             const std::vector<int>& poses) const;
  /// Expected covariance of the echoes alone, with their gain and latents and what they have of range errors;
  /// echoes[i] are those of poses[i].
  SessionCovariance covariance(const std::vector<PoseEchoes>& echoes, const SessionLatents& nuisance,
                               const std::vector<int>& poses) const;
  /// further: what scores() needs of directions beside the globals is kept, too.
  Basis basis(const std::vector<PoseEchoes>& echoes, const SessionLatents& nuisance, bool further = true) const;
  /// Scores by the globals of Nuisance and by more directions: changes of covariance(),
  /// [poses named]. Poses that are not named do not count.
  Scores scores(const Basis& basis, const std::vector<SessionCovariance>& directions,
                const std::vector<int>& poses) const;
  /// Improves nuisance by Fisher scoring from where it is; returns the log-likelihood.
  double fit(const std::vector<PoseEchoes>& echoes, SessionLatents& nuisance, int iterations) const;
  /// A step of the globals and what the headings do with it; held within sane bounds.
  SessionLatents stepped(const SessionLatents& from, const Eigen::VectorXd& globals, const Scores& scores,
                         const Eigen::VectorXd& whole_step, double share) const;

  /// Rank one sums for a point scatterer: see back_projection.h.
  struct Whitened {
    Eigen::MatrixXcd inverse;  ///< [M][M] Sigma^-1
    Eigen::VectorXcd solved;   ///< [M] Sigma^-1 y
    double weight;             ///< of the tail
  };
  Whitened whitened(const PoseEchoes& echoes, const SessionLatents& nuisance, int pose, int bin) const;
  /// Of all bins, those before firstBin() as that one.
  std::vector<Whitened> whitened(const PoseEchoes& echoes, const SessionLatents& nuisance, int pose) const;
  /// Nats that a cell gains by a point of this power and channel vector v; noise: v^H Sigma^-1 v, found: |v^H Sigma^-1
  /// y|^2.
  double gainOfPoint(const Whitened& cell, double power, double noise, double found) const;

  const ChannelData& data() const { return data_; }
  const LatentSpread& spread() const { return spread_; }
  int firstBin() const { return 2; }  ///< the radar's own near range is judged apart
  double weight() const { return 0.5; }

 private:
  int cells(int pose) const { return samples_ + static_cast<int>(data_.poses[pose].beams.size()); }
  bool isBeam(int cell) const { return cell >= samples_; }
  int binOf(int pose, int cell) const;
  /// Two neighbours of floor_shape that hold for a bin: the first one's index and the second one's share.
  std::pair<int, double> shapeAt(int bin) const;
  const std::complex<double>* dataOf(int pose, int cell) const;
  /// Power in a cell in which the average is uncertain by noise and by what moves.
  double noiseOf(int pose, int cell) const;
  /// Adds power that no two channels share, and that a beam's bins share as their window has it.
  void addApart(int cell, double power, PackedHermitian& to) const;
  /// Adds what is not shared between the channels of the echoes that a cell holds so far, or of a change of them.
  void addRelative(const SessionLatents& nuisance, int cell, PackedHermitian& to) const;
  double rangeVariance_m2(const SessionLatents& nuisance) const;
  /// Factor of a group's power, and one-way range that its actors add.
  struct GroupLevel {
    double gain, shift_m;
  };
  std::vector<GroupLevel> levels(const PoseEchoes& echoes, const SessionLatents& nuisance) const;
  PackedHermitian sigma(const PoseEchoes& echoes, const std::vector<GroupLevel>& levels, const SessionLatents& nuisance,
                        int pose, int cell) const;
  /// Clutter's covariance in a cell, times factor.
  void addClutter(const SessionLatents& nuisance, int pose, int cell, double factor, PackedHermitian& to) const;
  double prior(const SessionLatents& nuisance) const;
  double poseLikelihood(const PoseEchoes& echoes, const SessionLatents& nuisance, int pose) const;
  void addBasis(const PoseEchoes& echoes, const SessionLatents& nuisance, int pose, bool keep, PoseBasis& out) const;
  double informationOf(double product, double trace_a, double trace_b) const;

  const ChannelData& data_;
  int errors_;  ///< of actors, as errorOf() has them
  PoseAccuracy accuracy_;
  LatentSpread spread_;
  int channels_, samples_;
  std::size_t size_;
  PhasesApart apart_;
};

}  // namespace mmradartwin::diagnosis::likelihood
