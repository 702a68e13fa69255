#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_sim/twin.h"

namespace mmradartwin {

/// A twin some of whose actors move from frame to frame, as tf says (a person, a door, a robot). While the radar
/// stands, only what an actor's move may touch is found again, and the grid changes by the difference: the same as a
/// twin of a scene in which the actors stand there, to rounding (1e-9 of the grid; records in another order). Scatter
/// points and their phases belong to their facets, so echoes of a moving actor are coherent from frame to frame. Within
/// a frame actors stand. Not to be used from several threads at once.
class MovingTwin {
 public:
  /// A copy of the twin, with all that it was told of session and levels. Throws InputError for names that are no
  /// actors.
  MovingTwin(const Twin& twin, const std::vector<std::string>& actors);
  ~MovingTwin();
  MovingTwin(MovingTwin&&) noexcept;

  /// From the next simulate() on the actor stands where its mesh file's frame is at T_map_actor (Actor::T_map_mesh is
  /// where scene.yaml has it). What a mechanism edits about the actor moves with it. Throws InputError for an actor
  /// that is not among those that move, or a transform that is not finite.
  void place(const std::string& actor, const Eigen::Isometry3d& T_map_actor);
  /// True where place() said something since the last simulate().
  bool placed() const { return placed_; }

  /// As Twin::simulate() with the actors where they are; valid until the next call. Throws InputError for a pose that
  /// is NaN or inside an actor; the next call traces in full then.
  const Simulation& simulate(const Eigen::Isometry3d& T_map_radar, std::int64_t stamp_ns = 0);

  /// With the actors where the last simulate() had them.
  const Scene& scene() const { return twin_->tracedScene(); }

  struct Counts {
    std::uint64_t traced = 0;   ///< poses traced in full
    std::uint64_t updated = 0;  ///< where actors alone had moved
    std::uint64_t reused = 0;   ///< where nothing had
  };
  const Counts& counts() const { return counts_; }
  /// Paths found again at the last simulate().
  std::size_t found() const { return found_; }

 private:
  struct Mover {
    int actor;
    Eigen::Isometry3d moved = Eigen::Isometry3d::Identity();   ///< from where the twin has it to where it stands
    Eigen::Isometry3d wanted = Eigen::Isometry3d::Identity();  ///< the same from the next simulate() on
    Eigen::Isometry3d built = Eigen::Isometry3d::Identity();   ///< the same when the ray caster was made
  };
  /// Paths of one mechanism: a stretch of the records, and their sum as the receiver's filters leave it.
  struct Part {
    std::size_t begin = 0, end = 0;
    ComplexGrid sum;
  };
  SceneChange moveActors();
  void trace(const PoseContext& context, const SceneChange* change);
  void sumAll(const PoseContext& context);

  std::unique_ptr<Twin> twin_;
  Scene rest_;  ///< where the twin has its actors
  std::vector<Mover> movers_;
  std::vector<Part> parts_;  ///< one per mechanism that adds paths, in their order
  Simulation simulation_;
  Eigen::Isometry3d traced_at_ = Eigen::Isometry3d::Identity();  ///< where mechanisms put the radar then
  std::size_t echoes_ = 0;  ///< records that were traced; those behind them are relative to the strongest
  bool placed_ = false, valid_ = false;
  int updates_ = 0;  ///< since the grid was summed afresh
  std::size_t found_ = 0;
  Counts counts_;
};

}  // namespace mmradartwin
