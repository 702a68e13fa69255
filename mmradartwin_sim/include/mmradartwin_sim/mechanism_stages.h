#pragma once

#include <Eigen/Geometry>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/material.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/pose_context.h"
#include "mmradartwin_sim/scene.h"

/// The steps of a simulation in which mechanisms act, in the order in which they run. A mechanism derives from
/// Mechanism and from each stage that it acts in:
///
///   class Curtain : public Mechanism, public WeightStage { ... void reweight(...) const override; };
///
/// A twin sorts its mechanisms by stage once, when it is made; a stage without mechanisms costs nothing. All stages are
/// const and may be called for several poses at once.
namespace mmradartwin {

// Scene and radar.

/// Edits the scene once, on loading.
class SceneStage {
 public:
  virtual void editScene(Scene& scene) const = 0;

 protected:
  ~SceneStage() = default;
};

/// Puts the radar elsewhere than its reported pose says.
class MountingStage {
 public:
  virtual Eigen::Isometry3d pose(const Eigen::Isometry3d& T_map_radar) const { return T_map_radar; }
  /// How much later than the truth poses are stamped, s: acts before all pose(), where the radar moves.
  virtual double poseLag_s() const { return 0; }

 protected:
  ~MountingStage() = default;
};

// Propagation.

/// Adds paths.
class PathStage {
 public:
  virtual void addPaths(const PoseContext& context, std::vector<PathRecord>& records) const = 0;
  /// True where addPaths() adds, with PoseContext::change, those paths alone that SceneChange::touches(). Else all
  /// paths of the mechanism are found again when an actor moves.
  virtual bool tracesChanges() const { return false; }
  /// Mechanisms whose records addPaths() looks at: where a mechanism is traced alone, it is traced beside these.
  virtual std::vector<std::string> looksAtPathsOf() const { return {}; }
  /// Gives paths that it found, before any weight, the levels that they have with the materials of context.scene.
  /// before: what each actor was made of when they were found; the geometry is the same. False where levels do not
  /// follow from the paths: they have to be found again.
  virtual bool changeMaterials(const PoseContext&, const std::vector<Material>& /*before*/,
                               std::vector<PathRecord>&) const {
    return false;
  }

 protected:
  ~PathStage() = default;
};

/// Changes the level, phase, direction or length of every path of every mechanism.
class WeightStage {
 public:
  virtual void reweight(const PoseContext& context, PathRecord& record) const = 0;
  /// Length that reweight() adds to every path, m: a delay inside the radar, which a wave that meets the radar twice
  /// passes once.
  virtual double delay_m() const { return 0; }

 protected:
  ~WeightStage() = default;
};

/// Adds to a path a further one that it brings along.
class ReplicaStage {
 public:
  /// Turns a path, as all weights leave it, into the further one; false where it brings none.
  virtual bool replicate(const PoseContext& context, PathRecord& record) const = 0;

 protected:
  ~ReplicaStage() = default;
};

// Receiver.

/// Filters the tone of every path: acts exactly, on the received grid.
class ToneStage {
 public:
  /// Gain of the receiver on the tone of a path of this length.
  virtual std::complex<double> toneGain(const PoseContext& context, double length_m) const = 0;

 protected:
  ~ToneStage() = default;
};

/// Changes the propagated grid by looking at its paths, before ReceiveStage.
class DistortionStage {
 public:
  /// The paths make up the grid, as the receiver's filters leave them.
  virtual void distort(const PoseContext& context, const std::vector<PathRecord>& paths, ComplexGrid& x) const = 0;

 protected:
  ~DistortionStage() = default;
};

/// Changes the propagated grid, which is more than its records then.
class ReceiveStage {
 public:
  virtual void receive(const PoseContext& context, ComplexGrid& x) const = 0;

 protected:
  ~ReceiveStage() = default;
};

// Frames, run for every chirp by Twin::simulateFrames() alone: the grid of a pose is what stays the same.

/// One chirp of one frame of a pose, for what differs from chirp to chirp (docs/reference/contracts.md section 3:
/// chirps come as loop * slots + slot).
struct ChirpContext {
  const PoseContext& pose;
  std::int64_t stamp_ns = 0;  ///< start of the pose's first frame
  int frame = 0, chirp = 0, slot = 0;
  double time_s = 0;             ///< centre of the chirp's ADC window after stamp_ns
  std::uint64_t draw = 0;        ///< key of this chirp's random numbers: seed, stamp, frame and chirp make it
  std::uint64_t frame_draw = 0;  ///< the same for all chirps of a frame
};

/// Adds echoes that are there for one chirp only; weights, filters and receiver act on them as on any path.
class ChirpPathStage {
 public:
  virtual void addChirpPaths(const ChirpContext& chirp, std::vector<PathRecord>& records) const = 0;

 protected:
  ~ChirpPathStage() = default;
};

/// Changes one chirp before ReceiveStage.
class ModulationStage {
 public:
  /// x [R][N]; delayed [R][N] is the same with every path weighted by its delay in s.
  virtual void modulateChirp(const ChirpContext& chirp, const ComplexGrid& delayed, ComplexGrid& x) const = 0;

 protected:
  ~ModulationStage() = default;
};

/// Changes one chirp after ReceiveStage.
class ChirpStage {
 public:
  /// x [R][N] in units of path amplitude.
  virtual void changeChirp(const ChirpContext& chirp, ComplexGrid& x) const = 0;

 protected:
  ~ChirpStage() = default;
};

/// Changes one chirp before it is rounded to 16 bit and held within full scale.
class DigitiseStage {
 public:
  /// x [R][N] in units of full scale.
  virtual void digitise(const ChirpContext& chirp, ComplexGrid& x) const = 0;
  /// Share of I and Q values that lie beyond full scale; a session's gain is chosen for it where it is not 0.
  virtual double clippedFraction() const { return 0; }

 protected:
  ~DigitiseStage() = default;
};

/// The bytes of one pose on their way from the ADC: frames back to back in the radar's capture layout.
struct PayloadContext {
  const RadarConfig& radar;
  std::string pose;  ///< its name, "" where it has none
  std::uint64_t draw = 0;
};

/// Changes the bytes of a pose on their way from the ADC.
class TransportStage {
 public:
  /// All frames of a pose as bytes. They may be shortened by up to surplusBytes(): so many more are made.
  virtual void transport(const PayloadContext& context, std::vector<std::uint8_t>& payload) const = 0;
  virtual std::size_t surplusBytes() const { return 0; }
  /// Name of the one pose that the mechanism concerns, "" for all. A session without it is refused.
  virtual std::string onlyPose() const { return {}; }

 protected:
  ~TransportStage() = default;
};

}  // namespace mmradartwin
