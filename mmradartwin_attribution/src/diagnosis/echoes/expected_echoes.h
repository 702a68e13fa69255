#pragma once

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/echoes/echo_field.h"
#include "diagnosis/echoes/path_matching.h"
#include "diagnosis/echoes/receiver_mixture.h"
#include "diagnosis/echoes/traced_paths.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::echoes {

/// Accuracy of poses and of single paths; standard deviations.
struct PoseAccuracy {
  explicit PoseAccuracy(const StatedAccuracy& stated = {})
      : position_m(stated.pose_m),
        heading_rad(stated.heading_deg * M_PI / 180),
        path_angle_rad(stated.path_angle_deg * M_PI / 180),
        path_range_m(stated.path_range_m) {}

  double position_m, heading_rad;
  double path_angle_rad;  ///< direction of a single path
  double path_range_m;    ///< one-way range of a single path
};

/// Expected channels of a session for any list of mechanisms: paths (TracedPaths), received and collected into groups
/// of echoes. Mechanisms that only weight or receive paths cause no tracing.
class ExpectedEchoes {
 public:
  /// Keeps references to base and data.
  ExpectedEchoes(const Twin& base, const ChannelData& data, const PoseAccuracy& accuracy);

  /// Echoes of these poses (indices), in that order; actor_range_m as for EchoCollector. Throws InputError where a
  /// mechanism names something that the scene lacks.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                 const std::vector<double>& actor_range_m);
  /// Echoes of all poses.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms,
                                 const std::vector<double>& actor_range_m = {});
  /// Echoes a small step away from `from`, formed of the paths that both have. Paths that appear or vanish within the
  /// step do not determine a slope. Neither do pose-sensitive paths, which are left out where the geometry differs.
  std::vector<PoseEchoes> echoesNear(const std::vector<NamedParameters>& mechanisms,
                                     const std::vector<NamedParameters>& from, const std::vector<int>& poses,
                                     const std::vector<double>& actor_range_m);
  /// Shifts of the echoes that `mechanisms` and `from` have in common, without scatter points.
  std::vector<PathShift> pathShifts(const std::vector<NamedParameters>& mechanisms,
                                    const std::vector<NamedParameters>& from, const std::vector<int>& poses);
  /// Mean of pathShifts() by actor and by pose.
  EchoShift shift(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& from,
                  const std::vector<int>& poses, int actors);
  /// Sets the mechanisms that hypotheses are compared with. Paths of other mechanisms are forgotten, which bounds the
  /// memory, and the pose-sensitive paths of these are found.
  void setBaseline(const std::vector<NamedParameters>& mechanisms) { paths_.setBaseline(mechanisms); }
  /// Points beams at the expected echoes of the mechanisms, in the data given to the constructor.
  void pointBeams(ChannelData& data, const std::vector<NamedParameters>& mechanisms, int first_bin);
  /// True where the mechanism edits the scene or moves the radar, so that all paths have to be traced again.
  bool altersGeometry(const NamedParameters& mechanism) { return paths_.altersGeometry(mechanism); }
  const Twin& base() const { return base_; }

 private:
  using Paths = TracedPaths::Paths;
  /// Paths of one mechanism and, for a small step, those at its start.
  struct Part {
    const TracedPaths::ByPose* there;
    const TracedPaths::ByPose* here = nullptr;
  };
  /// Everything that determines echoes: paths, and what all poses share.
  struct Collection {
    const std::vector<Part>& parts;
    const TracedPaths::ByPose* pose_sensitive;  ///< null where they are left out
    const std::vector<double>& actor_range_m;
    std::shared_ptr<const Twin> twin = {};
    std::shared_ptr<const Twin> without_mixing =
        {};                      ///< without mechanisms that mix ranges; null where nothing mixes them
    std::size_t mixing_key = 0;  ///< identifies a receiver that mixes ranges
    std::size_t signature = 0;   ///< of weights and actor_range_m
  };
  /// Group of echoes that was collected earlier.
  struct KeptGroup {
    std::size_t signature = 0;
    std::shared_ptr<const EchoGroup> group;
  };
  /// Echoes of a pose that were collected earlier. Holds their paths, so that no other paths take their address.
  struct KeptPose {
    std::size_t signature = 0;
    std::vector<std::shared_ptr<const Paths>> paths;
    PoseEchoes echoes;
  };
  /// True where a mechanism's receiver turns a path into more than one tone in all channels (an image, a harmonic).
  bool mixesRanges(const NamedParameters& mechanism);
  std::vector<PoseEchoes> collect(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                  Collection collection);
  PoseEchoes collectAt(const Collection& collection, std::size_t pose);
  /// Adds records as tones, grouped by actors. An unchanged group is not collected again.
  void addGroups(std::size_t pose, const std::vector<PathRecord>& records, double strongest, EchoCollector& to);

  const Twin& base_;
  const ChannelData& data_;
  PoseAccuracy accuracy_;
  TracedPaths paths_;
  std::map<std::string, bool> mixes_ranges_;  // by mechanism name
  // [poses] Two are kept: the one that was reused last, and the newest.
  std::vector<std::map<PerInteraction<int>, std::array<KeptGroup, 2>>> kept_groups_;
  std::vector<std::array<KeptPose, 2>> kept_poses_;
  std::vector<ReceiverMixture::Cache> mixed_;
};

}  // namespace mmradartwin::diagnosis::echoes
