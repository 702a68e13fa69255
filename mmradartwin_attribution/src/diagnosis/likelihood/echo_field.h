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

namespace mmradartwin::diagnosis::likelihood {

/// Echoes that meet the same actors, summed as powers: the phase between separate paths carries nothing (DESIGN
/// section 4), so that the channels of a range bin have the covariance sum |W|^2 c c^H over paths.
struct EchoGroup {
  /// Of one bin or beam, packed as BinCovariance.
  struct Cell {
    const std::complex<float>* power;  ///< |W|^2 c c^H
    const std::complex<float>* shift;  ///< its derivative by the one-way range, per metre
    const std::complex<float>*
        curvature;  ///< W'^2 c c^H per m^2: half the second derivative, and what a random range adds
    double cosine;  ///< |W|^2 cos(azimuth) |c_0|^2: what a turn of the radar acts on; 0 of beams
  };
  /// Cells from `first` on. Those of a cell are read together and stand one behind the other.
  struct Fields {
    static constexpr std::size_t kOfCell = 3;  ///< power, shift and bend
    int first = 0, cells = 0;
    std::vector<std::complex<float>> packed;  ///< [cell][kOfCell][size]
    std::vector<float> cosine;                ///< [cell]
    /// size: of a packed matrix. None outside.
    std::optional<Cell> at(int cell, std::size_t size) const {
      if (cell < first || cell >= first + cells) return std::nullopt;
      const auto i = static_cast<std::size_t>(cell - first);
      const std::complex<float>* own = packed.data() + i * kOfCell * size;
      return Cell{own, own + size, own + 2 * size, cosine[i]};
    }
  };
  PerInteraction<int> actors;  ///< one per interaction, in order; empty where a path meets none
  double added_range_m = 0;    ///< one-way, that the actors' known errors have put into the fields
  Fields bins;                 ///< channels by range bin
  Fields beams;                ///< bins by beam: |b^H c|^2 W W^T with W over the beam's bins, and so on
};

/// The expected channels of one pose. Groups do not change once collected: states of the fit share them.
struct PoseEchoes {
  std::vector<std::shared_ptr<const EchoGroup>> groups;
  /// The same of paths that come, go or change within the accuracy of the pose: as much of their power as is uncertain.
  std::vector<std::shared_ptr<const EchoGroup>> grazing;
  std::size_t all() const { return groups.size() + grazing.size(); }
  /// Those of grazing come last.
  const EchoGroup& at(std::size_t i) const { return i < groups.size() ? *groups[i] : *grazing[i - groups.size()]; }
  bool grazes(std::size_t i) const { return i >= groups.size(); }
};

/// Place of an actor's errors among `errors` of them: all that the scene lacks (actor -1, or one that a mechanism adds)
/// shares the last.
inline std::size_t errorOf(int actor, std::size_t errors) {
  return actor < 0 ? errors - 1 : std::min(static_cast<std::size_t>(actor), errors - 1);
}

/// What a path's group goes by: its actors, -1 where it bounces off none.
const PerInteraction<int>& actorsOf(const PathRecord& record);

/// Collects paths into groups.
class EchoCollector {
 public:
  /// Keeps references. beams: of the pose that the paths are collected for. actor_range_m: one-way range that each
  /// interaction with an actor adds, as errorOf() has it, or empty; what Nuisance::actor_range_m says beyond it is
  /// taken to first order, good to some 2 cm.
  EchoCollector(const RadarConfig& radar, double angle_error_rad, const std::vector<EchoBeam>& beams,
                const std::vector<double>& actor_range_m);
  /// Paths that meet the same actors, as their tones stand on the channels; of a weak one only the main lobe counts.
  /// strongest: power of the pose's strongest path. The group is the last one.
  std::shared_ptr<const EchoGroup> addTones(const std::vector<const PathRecord*>& records, double strongest);
  /// A path whose response the receiver has changed: y [M][N] instead of the tone, its actors' added range already in
  /// it, and its derivative by the one-way range, per metre. Actors and direction are the record's.
  void add(const PathRecord& record, const Eigen::MatrixXcd& y, const Eigen::MatrixXcd& slope);
  /// A group that was collected before for this pose, instead of its paths.
  void add(std::shared_ptr<const EchoGroup> group) { groups_.push_back(std::move(group)); }
  /// The group of the last path, to which no more is added.
  std::shared_ptr<const EchoGroup> finishGroup() {
    open_.clear();
    return groups_.back();
  }
  /// One-way range that the interactions add.
  double addedRange_m(const PerInteraction<int>& actors) const;
  std::vector<std::shared_ptr<const EchoGroup>> take();

 private:
  EchoGroup& group(const PathRecord& record);
  void addTone(const PathRecord& record, double share, EchoGroup& group);
  void outer(const std::complex<double>* c, double cosine, std::vector<std::complex<float>>& packed) const;

  /// Adds |b^H c|^2 times outer products of the responses over a beam's bins. A beam that takes less than `off` of the
  /// path's power is passed over.
  void addToBeams(const std::complex<double>* c, double place, double off, EchoGroup::Fields& beams) const;

  const RadarConfig& radar_;
  const std::vector<EchoBeam>& beams_;
  const std::vector<double>& actor_range_m_;
  double angle_error_rad_;
  int channels_, samples_;
  std::size_t size_;
  double bin_m_;
  std::vector<double> element_phase_;  ///< 2 pi y_k / lambda of the virtual elements
  std::vector<std::shared_ptr<const EchoGroup>> groups_;
  std::vector<EchoGroup*> open_;  ///< of groups_, those that are collected here
};

/// Changes a signature of paths by all of a record that collected echoes follow from, but its actors.
void addToSignature(const PathRecord& record, std::size_t& signature);

/// Hann's response at `offset` bins from a tone, 1 at 0: sinc(d)/(1 - d^2), the limit for many samples (error below
/// 1e-3 within three bins of 64).
double hannResponse(double offset);

}  // namespace mmradartwin::diagnosis::likelihood
