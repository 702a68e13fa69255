#pragma once

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/likelihood/path_matching.h"
#include "diagnosis/likelihood/receiver_mixture.h"
#include "diagnosis/likelihood/traced_paths.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_dsp/stated_accuracy.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::likelihood {

/// Accuracy of poses and of single paths; standard deviations.
struct PoseAccuracy {
  explicit PoseAccuracy(const StatedAccuracy& stated = {})
      : position_m(stated.pose_m),
        heading_rad(stated.heading_deg * M_PI / 180),
        path_angle_rad(stated.path_angle_deg * M_PI / 180),
        path_range_m(stated.path_range_m) {}

  double position_m, heading_rad;
  double path_angle_rad;  ///< direction of one path on its own
  double path_range_m;    ///< one-way range of one path on its own
};

/// Expected channels of a session for any list of mechanisms: paths (TracedPaths), received and collected into groups
/// of echoes. Mechanisms that only weigh or receive paths trace nothing.
class ExpectedEchoes {
 public:
  /// Keeps references to base and data.
  ExpectedEchoes(const Twin& base, const ChannelData& data, const PoseAccuracy& accuracy);

  /// Echoes of the poses named by index, in that order; actor_range_m as EchoCollector takes it. Throws InputError
  /// where the scene does not know what a mechanism names.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                 const std::vector<double>& actor_range_m);
  /// Echoes of all poses.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms,
                                 const std::vector<double>& actor_range_m = {});
  /// Echoes a small step away from `from`, made of the paths that both have. Paths that come or go within the step say
  /// nothing about a slope, nor do grazing paths, which are left out where the geometry differs.
  std::vector<PoseEchoes> echoesNear(const std::vector<NamedParameters>& mechanisms,
                                     const std::vector<NamedParameters>& from, const std::vector<int>& poses,
                                     const std::vector<double>& actor_range_m);
  /// Shifts of the echoes that `mechanisms` and `from` have in common, scatter points left out.
  std::vector<PathShift> pathShifts(const std::vector<NamedParameters>& mechanisms,
                                    const std::vector<NamedParameters>& from, const std::vector<int>& poses);
  /// Mean of pathShifts() by actor and by pose.
  EchoShift shift(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& from,
                  const std::vector<int>& poses, int actors);
  /// Sets the mechanisms that hypotheses are compared with from now on. Paths of other mechanisms are forgotten, which
  /// bounds the memory, and the grazing paths of these are found.
  void setBaseline(const std::vector<NamedParameters>& mechanisms) { paths_.setBaseline(mechanisms); }
  /// Points beams at the echoes expected of the mechanisms, in the data given to the constructor.
  void pointBeams(ChannelData& data, const std::vector<NamedParameters>& mechanisms, int first_bin);
  /// True where the mechanism edits the scene or moves the radar: trying it traces everything again.
  bool altersGeometry(const NamedParameters& mechanism) { return paths_.altersGeometry(mechanism); }
  const Twin& base() const { return base_; }

 private:
  using Paths = TracedPaths::Paths;
  /// Paths of one mechanism and, for a small step, those that it starts from.
  struct Part {
    const TracedPaths::ByPose* there;
    const TracedPaths::ByPose* here = nullptr;
  };
  /// Everything that echoes follow from: paths, and what is made of them alike at all poses.
  struct Collection {
    const std::vector<Part>& parts;
    const TracedPaths::ByPose* pose_sensitive;  ///< null where they are left out
    const std::vector<double>& actor_range_m;
    std::shared_ptr<const Twin> twin = {};
    std::shared_ptr<const Twin> without_mixing = {};  ///< without what mixes ranges; null where nothing does
    std::size_t mixing_key = 0;                       ///< tells one receiver that mixes from another
    std::size_t signature = 0;                        ///< of weights and actor_range_m
  };
  /// Group of echoes that was collected before.
  struct KeptGroup {
    std::size_t signature = 0;
    std::shared_ptr<const EchoGroup> group;
  };
  /// Echoes of a pose that were collected before. Holds their paths, so that no others take their address.
  struct KeptPose {
    std::size_t signature = 0;
    std::vector<std::shared_ptr<const Paths>> paths;
    PoseEchoes echoes;
  };
  /// True where a mechanism's receiver makes of a path more than its tone in all channels (an image, a harmonic).
  bool mixesRanges(const NamedParameters& mechanism);
  std::vector<PoseEchoes> collect(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                  Collection collection);
  PoseEchoes collectAt(const Collection& collection, std::size_t pose);
  /// Adds records as tones, grouped by actors. A group that is the same as before is not collected again.
  void addGroups(std::size_t pose, const std::vector<PathRecord>& records, double strongest, EchoCollector& to);

  const Twin& base_;
  const ChannelData& data_;
  PoseAccuracy accuracy_;
  TracedPaths paths_;
  std::map<std::string, bool> mixes_ranges_;  // by mechanism name
  // By pose. Two are kept: the one that was met again last, and the last new one.
  std::vector<std::map<PerInteraction<int>, std::array<KeptGroup, 2>>> kept_groups_;
  std::vector<std::array<KeptPose, 2>> kept_poses_;
  std::vector<ReceiverMixture::Cache> mixed_;
};

}  // namespace mmradartwin::diagnosis::likelihood
