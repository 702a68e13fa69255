#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::echoes {

/// Text that is equal for lists of mechanisms which trace the same paths.
std::string traceKeyOf(const std::vector<NamedParameters>& mechanisms);

/// Paths of a session's poses, traced once per mechanism and geometry. *Geometry* is the list of mechanisms that edit
/// the scene or move the radar. Paths are kept. A geometry that differs from a known one by its last edit is traced
/// again only where the edit may matter.
class TracedPaths {
 public:
  using Paths = std::vector<PathRecord>;
  /// [poses] null where not traced. Lists that an edit does not change are shared.
  using ByPose = std::vector<std::shared_ptr<const Paths>>;

  /// Keeps references to base and data. position_error_m: standard deviation of a pose's position.
  TracedPaths(const Twin& base, const ChannelData& data, double position_error_m);

  /// Mechanisms of the list that edit the scene or move the radar, in the order in which they are traced.
  std::vector<NamedParameters> geometryOf(const std::vector<NamedParameters>& mechanisms);
  bool altersGeometry(const NamedParameters& mechanism);
  /// Paths of one of the mechanisms at these poses, in a geometry. Throws InputError where a mechanism names something
  /// that the scene lacks.
  const ByPose& of(const std::vector<NamedParameters>& geometry, const NamedParameters& mechanism,
                   const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses);
  /// Paths that appear, vanish or change within the accuracy of the poses, with the uncertain part of their amplitude.
  const ByPose& poseSensitive(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses);
  /// The base twin with these mechanisms; the latest twins are kept.
  std::shared_ptr<const Twin> twinOf(const std::vector<NamedParameters>& mechanisms);
  /// Forgets the paths of all other mechanisms, and finds the pose-sensitive paths of these.
  void setBaseline(const std::vector<NamedParameters>& mechanisms);
  /// Makes the next setBaseline() find pose-sensitive paths again.
  void clearBaseline() { baseline_.clear(); }
  bool hasBaseline() const { return !baseline_.empty(); }
  /// Counts a call and forgets the paths that were unused for longest, which bounds the memory.
  void beginCall();
  std::size_t call() const { return call_; }
  std::vector<int> everyPose() const;

 private:
  enum class Geometry { kSame, kMoreScreens, kOther };
  /// Effect of a mechanism on the scene.
  struct Edit {
    Geometry geometry = Geometry::kSame;
    std::optional<Twin::PlacedActor> placed = {};
    /// True where it only adds something to a scene whose paths are known without it.
    bool addsToOthers() const { return geometry == Geometry::kMoreScreens || placed.has_value(); }
  };
  struct Entry {
    ByPose paths;
    std::size_t used = 0;  ///< last call that used it
  };
  /// Paths in the geometry without its last edit.
  struct Predecessor {
    Edit edit;  ///< the last one; kSame where there is none
    const ByPose* paths = nullptr;
    std::optional<SceneChange> change;  ///< made by the edit
  };
  /// One mechanism to be traced in a geometry.
  struct Task {
    std::shared_ptr<const Twin> twin;
    std::size_t mechanism;  ///< its index in the twin
    Predecessor before;
    bool opens;  ///< an edit removes something that occludes in the base scene
  };
  const Edit& editOf(const NamedParameters& mechanism);
  /// The mechanisms that alter no geometry, followed by the edits.
  std::vector<NamedParameters> withEdits(const std::vector<NamedParameters>& mechanisms,
                                         const std::vector<NamedParameters>& edits);
  Predecessor predecessorOf(const std::vector<NamedParameters>& geometry, const NamedParameters& mechanism,
                            const std::vector<NamedParameters>& mechanisms, const std::vector<int>& missing,
                            const Twin& twin);
  std::shared_ptr<const Paths> pathsAt(const Task& task, std::size_t pose) const;
  std::shared_ptr<const Paths> poseSensitiveAt(const Twin& twin, std::size_t pose) const;

  const Twin& base_;
  const ChannelData& data_;
  double position_error_m_;
  std::size_t call_ = 0;
  std::map<std::string, Entry> known_;                                      // by geometry and mechanism
  std::map<std::string, Entry> pose_sensitive_;                             // by what moves actors or the radar
  std::map<std::string, Edit> edits_;                                       // by mechanism
  std::vector<std::pair<std::string, std::shared_ptr<const Twin>>> twins_;  // last used first
  std::vector<std::string> baseline_;                                       // keys into known_
};

}  // namespace mmradartwin::diagnosis::echoes
