#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <complex>
#include <optional>
#include <utility>
#include <vector>

#include "diagnosis/catalogue/stated_bounds.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/echo_field.h"
#include "diagnosis/echoes/expected_echoes.h"
#include "diagnosis/likelihood/echo_level.h"
#include "diagnosis/likelihood/session_latents.h"
#include "diagnosis/numbers/packed_hermitian.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::likelihood {

/// Expected covariance of the channels in all bins of a pose, packed as BinCovariance.
using PoseCovariance = std::vector<std::complex<float>>;
using SessionCovariance = std::vector<PoseCovariance>;

/// Derivatives of the log-likelihood along a set of directions (globals, then changes of covariance). They are kept by
/// location: their scatter over locations shows what the model omits. Each pose's heading is eliminated.
struct Scores {
  double log_likelihood = 0;     ///< with the priors of the latents
  Eigen::MatrixXd by_location;   ///< [locations][directions] scores
  Eigen::MatrixXd information;   ///< [directions][directions] Fisher information, priors included
  Eigen::VectorXd total;         ///< [directions] scores, priors included
  Eigen::VectorXd prior;         ///< [globals] prior precision of the actors' errors, 0 elsewhere
  std::vector<double> yaw_step;  ///< [poses] Newton step of the heading with everything else fixed
  Eigen::MatrixXd yaw_coupling;  ///< [poses][directions] decrease of the best heading per step of a direction
};

/// Whitened directions of one cell and its data as M^2 real numbers each (InverseFactor::whiten()). Derivatives of the
/// likelihood are then dot products, and a further direction costs only its own products. A last number stands for the
/// level of the cell's echo (CellLikelihood::level()): it acts in products of directions alone.
struct BinBasis {
  int cell = 0;
  InverseFactor factor;
  std::vector<int> active;   ///< globals that act in this cell; index `globals` stands for the heading
  Eigen::MatrixXf whitened;  ///< [M^2 + 1][active]; single precision halves a long session's memory
  Eigen::VectorXd data;      ///< [M^2 + 1] CellLikelihood::score(), then 0
  Eigen::VectorXd level;     ///< [M^2] CellLikelihood::level()
  Eigen::VectorXd traces;    ///< [active] trace of each whitened direction
};

/// Scores and information of one pose along the globals and its heading.
struct PoseBasis {
  double log_likelihood = 0;
  Eigen::VectorXd score;        ///< [globals + 1]
  Eigen::MatrixXd information;  ///< [globals + 1][globals + 1], the heading last
  std::vector<BinBasis> bins;   ///< empty where no further directions are needed
  /// [errors, see errorOf()] number of cells, times their weight, in which the actor's echo has not its level.
  Eigen::VectorXd astray;
};

/// Derivatives of all poses at one set of latents.
struct Basis {
  SessionLatents latents;
  std::vector<PoseBasis> poses;
};

/// Likelihood of a session's channels under expected echoes. The channels of a range bin have the covariance
///   gain * (echoes + pose-sensitive echoes + range errors + relative) + clutter + noise
/// about zero. They are complex t-distributed (4 complex degrees of freedom), but for the cell's strongest echo, whose
/// level is known (CellLikelihood).
/// The bins of a beam (EchoBeam) are distributed in the same way. A *cell* is a range bin or a beam; beams come after
/// the bins. Neighbouring bins overlap through the window, and beams are formed of bins: each cell has the weight 1/2
/// (composite likelihood).
class ChannelLikelihood {
 public:
  /// Keeps a reference to data. actors: size of Scene::actors.
  ChannelLikelihood(const ChannelData& data, int actors, const PoseAccuracy& accuracy,
                    const LatentSpread& spread = LatentSpread());

  /// Latents from which fit() starts: levels from the data, errors zero.
  SessionLatents start(const std::vector<PoseEchoes>& echoes) const;
  /// Log-likelihood of all poses with the priors of the latents. by_pose: receives it by pose, without priors.
  double logLikelihood(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                       std::vector<double>* by_pose = nullptr) const;
  /// Log-likelihood of these poses, without priors; echoes[i] belongs to poses[i].
  std::vector<double> byPose(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                             const std::vector<int>& poses) const;
  /// Expected covariance of the echoes alone (no clutter, no noise), with gain, latents and range errors; echoes[i]
  /// belongs to poses[i].
  SessionCovariance covariance(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents,
                               const std::vector<int>& poses) const;
  /// Derivatives along the globals and headings. further: keeps what scores() needs for further directions.
  Basis basis(const std::vector<PoseEchoes>& echoes, const SessionLatents& latents, bool further = true) const;
  /// The same of one pose alone; the others' stay empty.
  Basis basisAt(int pose, const PoseEchoes& echoes, const SessionLatents& latents) const;
  /// Scores along the globals of SessionLatents and further directions, each a change of covariance() at these poses.
  /// Other poses do not count.
  Scores scores(const Basis& basis, const std::vector<SessionCovariance>& directions,
                const std::vector<int>& poses) const;
  /// The same with numbers at their limits left free.
  Scores freeScores(const Basis& basis, const std::vector<SessionCovariance>& directions,
                    const std::vector<int>& poses) const;
  /// Fisher scoring of the latents from their present values. Returns the log-likelihood.
  double fit(const std::vector<PoseEchoes>& echoes, SessionLatents& latents, int iterations) const;
  /// The same once more with the factor on uncertain paths back at 1, where a fit took it far away: what the twin lacks
  /// can hold it at hundreds, beside a higher maximum. Latents of a lower likelihood than `reached` are not taken.
  /// Returns the higher of both.
  double fitWithoutTrap(const std::vector<PoseEchoes>& echoes, SessionLatents& latents, double reached) const;
  struct Bounds {
    Eigen::VectorXd low, high;  ///< [globals] low <= 0 <= high
  };
  /// Latents that lie from `from` by a share of what `there` lies from `here`, within their limits.
  SessionLatents extrapolated(const SessionLatents& from, const SessionLatents& here, const SessionLatents& there,
                              double share) const;
  /// Least and largest change of the globals in one step.
  Bounds stepBounds(const SessionLatents& from) const;
  /// Latents after a share of a step of the globals, with each heading's best response to whole_step. Values and steps
  /// are limited.
  SessionLatents stepped(const SessionLatents& from, const Eigen::VectorXd& globals, const Scores& scores,
                         const Eigen::VectorXd& whole_step, double share) const;

  /// One bin's covariance, inverted for tests of a further point scatterer (back_projection.h).
  struct Whitened {
    Eigen::MatrixXcd inverse;  ///< [M][M] Sigma^-1
    Eigen::VectorXcd solved;   ///< [M] Sigma^-1 y
    double weight;             ///< weight of the bin under the t distribution
  };
  Whitened whitened(const PoseEchoes& echoes, const SessionLatents& latents, int pose, int bin) const;
  /// All bins of a pose; bins before firstBin() are copies of it.
  std::vector<Whitened> whitened(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const;
  /// Nats that a bin gains by one more point scatterer of this power with channel vector v. noise: v^H Sigma^-1 v;
  /// found: |v^H Sigma^-1 y|^2.
  double gainOfPoint(const Whitened& cell, double power, double noise, double found) const;

  /// What is expected in a bin.
  struct ExpectedBin {
    int bin = 0, group = -1;      ///< group: of the strongest echo, -1 where there is none
    Eigen::MatrixXcd covariance;  ///< [M][M]
    CellEcho echo;
  };
  /// All bins of a pose from firstBin() on.
  std::vector<ExpectedBin> expectedBins(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const;

  /// Nats that a bin gains where its strongest echo is not there; beams do not count.
  struct MissingEcho {
    int group = -1;  ///< of the echo, -1 where the bin has none
    double nats = 0;
  };
  /// [bins] of a pose; bins before firstBin() have no echo.
  std::vector<MissingEcho> withoutStrongest(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const;

  const ChannelData& data() const { return data_; }
  const LatentSpread& spread() const { return spread_; }
  void setSpread(const LatentSpread& spread) { spread_ = spread; }
  int firstBin() const { return 2; }     ///< nearer bins hold the radar's own leakage and are judged separately
  double weight() const { return 0.5; }  ///< of a cell in the composite likelihood

 private:
  int cells(int pose) const { return samples_ + static_cast<int>(data_.poses[pose].beams.size()); }
  bool isBeam(int cell) const { return cell >= samples_; }
  int binOf(int pose, int cell) const;
  /// Nodes of floor_shape about a bin: the index of the first one and the weight of the second one.
  std::pair<int, double> shapeAt(int bin) const;
  /// Factor of the latents on the clutter of a bin.
  double clutterLevel(const SessionLatents& latents, int bin) const;
  const std::complex<double>* dataOf(int pose, int cell) const;
  /// Noise power of the average in a cell, with the unsteadiness of moving echoes.
  double noiseOf(int pose, int cell) const;
  /// Adds power that is independent between channels. In a beam, neighbouring bins share it through the window.
  void addApart(int cell, double power, PackedHermitian& to) const;
  /// Adds the independent share (log_relative) of the echoes in `to`, or of a change of them.
  void addRelative(const SessionLatents& latents, int cell, PackedHermitian& to) const;
  double rangeVariance_m2(const SessionLatents& latents) const;
  /// Factor on a group's power, and the one-way range that its actors add beyond the range of its fields.
  struct GroupLevel {
    double gain, shift_m;
  };
  /// Echoes of one pose under latents.
  struct PoseModel {
    const PoseEchoes& echoes;
    const SessionLatents& latents;
    int pose;
    std::vector<GroupLevel> levels;  ///< [groups, pose-sensitive ones last]
    std::vector<int> strongest;      ///< [cells] group with the strongest paths, -1 where there is none
    std::vector<double> cells;       ///< [groups] number of cells, times their weight, in which its echo stands out
  };
  PoseModel modelOf(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const;
  /// Finds the strongest group of each cell.
  void findStrongest(PoseModel& model) const;
  /// Mean power of clutter and noise over the channels of a cell.
  double floorOf(const PoseModel& model, int cell) const;
  /// Echo of a cell's strongest group; its power is 0 where there is none.
  CellEcho strongestEcho(const PoseModel& model, int cell) const;
  Whitened whitened(const PoseModel& model, int bin) const;
  /// Covariance of a cell.
  PackedHermitian sigma(const PoseModel& model, int cell) const;
  /// A group's fields in a cell; nothing where it has none.
  std::optional<EchoGroup::Cell> fieldsOf(const EchoGroup& group, int cell) const;
  /// Adds the covariance of clutter in a cell, times factor.
  void addClutter(const SessionLatents& latents, int pose, int cell, double factor, PackedHermitian& to) const;
  double prior(const SessionLatents& latents) const;
  double poseLikelihood(const PoseEchoes& echoes, const SessionLatents& latents, int pose) const;
  void addBasis(const PoseEchoes& echoes, const SessionLatents& latents, int pose, bool keep, PoseBasis& out) const;
  struct CellDirections;
  /// Adds a cell's changes by the actors' errors, the heading, pose-sensitive echoes and range errors. inverse: of the
  /// cell's covariance.
  void addEchoDirections(const PoseModel& model, int cell, const PackedHermitian& inverse, CellDirections& to) const;
  /// Adds a cell's changes by the floor, its shape, the gain and the independent share of channels.
  void addLevelDirections(const PoseModel& model, int cell, const PackedHermitian& covariance,
                          CellDirections& to) const;
  /// Writes a change of a cell's covariance as [M^2 + 1] numbers, see BinBasis.
  void whiten(const BinBasis& basis, const PackedHermitian& change, double* to) const;
  /// Whitens a cell's directions and adds their scores and information to the pose's.
  void addProducts(CellDirections& directions, BinBasis& basis, PoseBasis& out) const;
  struct PoseScores;
  /// further: the pose's changes of covariance along each further direction.
  PoseScores poseScores(const Basis& basis, std::size_t pose, const std::vector<const PoseCovariance*>& further) const;
  /// Adds the scores of one cell along further directions.
  void addFurther(const BinBasis& bin, const SessionLatents& latents, const std::vector<const PoseCovariance*>& further,
                  PoseScores& own) const;
  /// Adds a pose's scores with its heading eliminated.
  void addWithoutHeading(const PoseScores& pose_scores, const SessionLatents& latents, std::size_t pose,
                         Scores& scores) const;
  void addPriors(const SessionLatents& latents, Scores& scores) const;
  void holdAtLimits(const SessionLatents& latents, Scores& scores) const;

  const ChannelData& data_;
  int errors_;  ///< number of the actors' errors, see errorOf()
  PoseAccuracy accuracy_;
  LatentSpread spread_;
  int channels_, samples_;
  std::size_t size_;
  PhasesApart apart_;
};

}  // namespace mmradartwin::diagnosis::likelihood
