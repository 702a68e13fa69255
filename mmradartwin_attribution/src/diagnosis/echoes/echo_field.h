#pragma once

#include <algorithm>
#include <complex>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_sim/path_record.h"

namespace mmradartwin::diagnosis::echoes {

/// Echoes that meet the same actors, summed as powers. The phase between separate paths cannot be predicted, so that
/// the channels of a range bin have the covariance sum |W|^2 c c^H over paths; W is the window's response in the bin.
struct EchoGroup {
  /// Fields of one bin or beam, packed as BinCovariance.
  struct Cell {
    const std::complex<float>* power;  ///< |W|^2 c c^H
    const std::complex<float>* shift;  ///< derivative of power by the one-way range, per metre
    /// W'^2 c c^H per m^2. Times the variance of a random one-way range it is the added covariance.
    const std::complex<float>* curvature;
    double cosine;   ///< sum |W|^2 cos(azimuth) |c_0|^2, which a turn of the radar changes; 0 for beams
    double mean;     ///< power, mean over the channels
    double squares;  ///< sum over paths of the square of each one's mean power
  };
  /// Fields of the cells from `first` on. Fields of one cell are read together and are contiguous.
  struct Fields {
    static constexpr std::size_t kOfCell = 3;  ///< power, shift and curvature
    int first = 0, cells = 0;
    std::vector<std::complex<float>> packed;  ///< [cell][kOfCell][size]
    std::vector<float> cosine;                ///< [cell]
    std::vector<float> mean, squares;         ///< [cell] see Cell
    /// Fields of a cell; nothing outside. size: of a packed matrix.
    std::optional<Cell> at(int cell, std::size_t size) const {
      if (cell < first || cell >= first + cells) return std::nullopt;
      const auto i = static_cast<std::size_t>(cell - first);
      const std::complex<float>* own = packed.data() + i * kOfCell * size;
      return Cell{own, own + size, own + 2 * size, cosine[i], mean[i], squares[i]};
    }
  };
  PerInteraction<int> actors;  ///< one per interaction, in order; empty where a path meets none
  double added_range_m = 0;    ///< one-way range of the actors' known errors that the fields include
  Fields bins;                 ///< covariance of the channels, by range bin
  Fields beams;                ///< covariance of a beam's bins, by beam: |b^H c|^2 W W^T with W over these bins
};

/// Change of the sine of a group's mean direction in a cell by an error of the heading.
inline double turnOf(double yaw_rad, const EchoGroup::Cell& cell) {
  if (yaw_rad == 0 || cell.cosine == 0 || !(cell.power[0].real() > 0)) return 0;
  return yaw_rad * cell.cosine / cell.power[0].real();
}

/// Expected channels of one pose. Groups do not change once collected: states of a fit share them.
struct PoseEchoes {
  std::vector<std::shared_ptr<const EchoGroup>> groups;
  /// Paths that appear, vanish or change within the accuracy of the pose, with the uncertain part of their power.
  std::vector<std::shared_ptr<const EchoGroup>> pose_sensitive;
  std::size_t all() const { return groups.size() + pose_sensitive.size(); }
  /// Group i of all, pose-sensitive ones last.
  const EchoGroup& at(std::size_t i) const {
    return i < groups.size() ? *groups[i] : *pose_sensitive[i - groups.size()];
  }
  bool isPoseSensitive(std::size_t i) const { return i >= groups.size(); }
};

/// Index of an actor's errors among `errors` of them. Everything outside the scene (actor -1, or one that a mechanism
/// adds) shares the last one.
inline std::size_t errorOf(int actor, std::size_t errors) {
  return actor < 0 ? errors - 1 : std::min(static_cast<std::size_t>(actor), errors - 1);
}

/// Actors by which a path is grouped; -1 for a reflection off something that is no actor.
const PerInteraction<int>& actorsOf(const PathRecord& record);

/// Collects the paths of one pose into groups.
class EchoCollector {
 public:
  /// Keeps references. beams: of the pose. actor_range_m: [errors, see errorOf()] one-way range that each interaction
  /// with an actor adds, or empty. Deviations of SessionLatents::actor_range_m from it act to first order, valid to
  /// some 2 cm.
  EchoCollector(const RadarConfig& radar, double angle_error_rad, const std::vector<EchoBeam>& beams,
                const std::vector<double>& actor_range_m);
  /// Adds a group of paths that meet the same actors, as pure tones. A weak path has only its main lobe. strongest:
  /// power of the pose's strongest path. Returns the group.
  std::shared_ptr<const EchoGroup> addTones(const std::vector<const PathRecord*>& records, double strongest);
  /// Adds a path whose response the receiver has changed. y: spectra [M][N] instead of a tone, with the actors' added
  /// range. slope: their derivative by the one-way range, per metre. Actors and direction are the record's.
  void add(const PathRecord& record, const Eigen::MatrixXcd& y, const Eigen::MatrixXcd& slope);
  /// Adds a group that was collected earlier for this pose.
  void add(std::shared_ptr<const EchoGroup> group) { groups_.push_back(std::move(group)); }
  /// Closes the group of the last path and returns it.
  std::shared_ptr<const EchoGroup> finishGroup() {
    open_.clear();
    return groups_.back();
  }
  /// One-way range that the errors of these actors add.
  double addedRange_m(const PerInteraction<int>& actors) const;
  /// Returns all groups and leaves the collector empty.
  std::vector<std::shared_ptr<const EchoGroup>> take();

 private:
  EchoGroup& group(const PathRecord& record);
  void addTone(const PathRecord& record, double share, EchoGroup& group);
  /// The same where channels' ranges lie far apart. reach: bins to either side. strong: also around the spectrum's
  /// ends.
  void addApart(const PathRecord& record, int reach, bool strong, EchoGroup& group);
  /// response, slope: [bins of the beam] of the formed channels, and their derivative by the range.
  void addBeam(int beam, const std::vector<std::complex<double>>& response,
               const std::vector<std::complex<double>>& slope, EchoGroup::Fields& beams) const;
  void outer(const std::complex<double>* c, double cosine, std::vector<std::complex<float>>& packed) const;

  /// Adds |b^H c|^2 times outer products of the responses over each beam's bins. Skips a beam that receives less than
  /// the share `off` of the path's power.
  void addToBeams(const std::complex<double>* c, double place, double off, EchoGroup::Fields& beams) const;
  /// The same of channels that lie a little beside `place`. c_apart: [channels] c times that distance in bins.
  void addToBeams(const std::complex<double>* c, const std::complex<double>* c_apart, double place,
                  EchoGroup::Fields& beams) const;

  const RadarConfig& radar_;
  const std::vector<EchoBeam>& beams_;
  const std::vector<double>& actor_range_m_;
  double angle_error_rad_;
  int channels_, samples_;
  std::size_t size_;
  double bin_m_;
  std::vector<double> element_phase_;  ///< 2 pi y_k / lambda of the virtual elements
  std::vector<std::shared_ptr<const EchoGroup>> groups_;
  std::vector<EchoGroup*> open_;  ///< groups of groups_ that still receive paths
};

/// Hashes into `signature` everything of a record that determines its echo group, except its actors.
void addToSignature(const PathRecord& record, std::size_t& signature);

/// Response of a Hann window at `offset` bins from a tone, 1 at 0: sinc(d)/(1 - d^2), the limit for many samples (error
/// below 1e-3 within three bins of 64 samples).
double hannResponse(double offset);

}  // namespace mmradartwin::diagnosis::echoes
