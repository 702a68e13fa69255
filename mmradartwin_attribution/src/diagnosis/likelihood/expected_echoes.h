#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "diagnosis/catalogue/default_mechanism.h"
#include "diagnosis/channels/channel_data.h"
#include "diagnosis/likelihood/echo_field.h"
#include "diagnosis/likelihood/receiver_mixture.h"
#include "diagnosis/rooms.h"
#include "mmradartwin_sim/twin.h"

namespace mmradartwin::diagnosis::likelihood {

/// What is known of the accuracy of poses; standard deviations.
struct PoseAccuracy {
  double position_m = 0.004, heading_rad = 0.3 * M_PI / 180;
  double path_angle_rad = 0.2 * M_PI / 180;  ///< of one path on its own: facets are not exactly where the mesh says
  double path_range_m = 0.005;
};

/// How far a change of mechanisms moves one echo.
struct PathShift {
  std::size_t place;  ///< of its pose among the poses named
  const std::string* event;
  PerInteraction<int> facets, actors;
  double amplitude;
  double range_m, azimuth_rad;
};

/// How far it moves echoes on the whole.
struct EchoShift {
  std::vector<double> range_m;      ///< [actors] one-way, mean over echoes that meet this actor alone, by amplitude
  std::vector<double> azimuth_rad;  ///< [poses named] the same over a pose's echoes
};

/// The expected channels of a session for any list of mechanisms. Paths are traced once per mechanism and geometry;
/// what only weighs or receives traces nothing (DESIGN section 4).
class ExpectedEchoes {
 public:
  /// Keeps references to base and data.
  ExpectedEchoes(const Twin& base, const ChannelData& data, const PoseAccuracy& accuracy);

  /// Echoes of the poses named by index, in that order; actor_range_m as EchoCollector takes it. Throws InputError
  /// where the scene does not know what a mechanism names.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                 const std::vector<double>& actor_range_m);
  /// Of all poses.
  std::vector<PoseEchoes> echoes(const std::vector<NamedParameters>& mechanisms,
                                 const std::vector<double>& actor_range_m = {});
  /// The same a small step away from `from`, of the paths that both have: what comes or goes within the step says
  /// nothing about the slope, nor does what grazes, which is left out where the geometry is another.
  std::vector<PoseEchoes> echoesNear(const std::vector<NamedParameters>& mechanisms,
                                     const std::vector<NamedParameters>& from, const std::vector<int>& poses,
                                     const std::vector<double>& actor_range_m);
  /// What `mechanisms` do to the echoes that they share with `from`, those of scatter points left out.
  std::vector<PathShift> pathShifts(const std::vector<NamedParameters>& mechanisms,
                                    const std::vector<NamedParameters>& from, const std::vector<int>& poses);
  EchoShift shift(const std::vector<NamedParameters>& mechanisms, const std::vector<NamedParameters>& from,
                  const std::vector<int>& poses, int actors);
  /// What hypotheses are compared with from now on: paths of other mechanisms are forgotten (memory stays bounded so),
  /// and what grazes an edge within the pose's accuracy is found for these.
  void setBaseline(const std::vector<NamedParameters>& mechanisms);
  /// Points beams at what the mechanisms expect, in the data given to the constructor.
  void pointBeams(ChannelData& data, const std::vector<NamedParameters>& mechanisms, int first_bin);
  /// True where the mechanism edits the scene or moves the radar: trying it traces everything again.
  bool altersGeometry(const NamedParameters& mechanism);
  const Twin& base() const { return base_; }

 private:
  using Paths = std::vector<PathRecord>;
  /// By pose; null where not traced. What a change does not touch is shared with what stood before it.
  using Traced = std::vector<std::shared_ptr<const Paths>>;
  /// Paths of one mechanism, and, of a small step, those that it starts from.
  struct Part {
    const Traced* there;
    const Traced* here = nullptr;
  };
  /// Paths of one of the mechanisms.
  const Traced& traced(const std::vector<NamedParameters>& geometry, const NamedParameters& mechanism,
                       const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses);
  /// True where its receiver makes of a path more than its tone in all channels (an image, a harmonic).
  bool mixesRanges(const NamedParameters& mechanism);
  std::shared_ptr<const Twin> twinOf(const std::vector<NamedParameters>& mechanisms);
  std::vector<int> everyPose() const;
  /// Keeps memory bounded while one hypothesis' geometry is searched for.
  void forgetLongUnused();
  std::vector<NamedParameters> geometryOf(const std::vector<NamedParameters>& mechanisms);
  /// grazing: of these paths, by pose; none where it is null.
  std::vector<PoseEchoes> collect(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses,
                                  const std::vector<double>& actor_range_m, const std::vector<Part>& parts,
                                  const Traced* grazing);
  /// Adds records as their tones, those that meet the same actors together; what is the same as before is not collected
  /// again.
  void addGroups(std::size_t pose, const std::vector<PathRecord>& records, double strongest, EchoCollector& to);
  /// What of a geometry's paths is uncertain within the pose's accuracy.
  const Traced& grazing(const std::vector<NamedParameters>& mechanisms, const std::vector<int>& poses);
  std::shared_ptr<const Paths> grazeAt(const Twin& twin, std::size_t pose) const;

  const Twin& base_;
  const ChannelData& data_;
  PoseAccuracy accuracy_;
  struct Entry {
    Traced paths;
    std::size_t used = 0;  // when, in calls
  };
  std::map<std::string, Entry> cache_;
  std::size_t calls_ = 0;
  struct Kept {
    std::size_t signature = 0;
    std::shared_ptr<const EchoGroup> group;
  };
  /// [poses] by actors: one that was met again last, and the last one that was new.
  std::vector<std::map<PerInteraction<int>, std::array<Kept, 2>>> kept_;
  /// What was collected of the same paths, weighed alike: as kept_. Holds the paths, so that no others come to stand
  /// there.
  struct KeptPose {
    std::size_t signature = 0;
    std::vector<std::shared_ptr<const Paths>> paths;
    PoseEchoes echoes;
  };
  std::vector<std::array<KeptPose, 2>> kept_poses_;
  std::vector<ReceiverMixture::Cache> mixed_;  // by pose
  std::map<std::string, Entry> grazing_;       // by what moves actors or the radar
  std::vector<std::string> settled_;
  enum class Geometry { kSame, kMoreScreens, kOther };
  struct Edit {
    Geometry geometry = Geometry::kSame;
    std::optional<Twin::PlacedActor> placed = {};
  };
  /// True where it only puts something beside paths that are known without it.
  static bool addsToOthers(const Edit& edit);
  const Edit& editOf(const NamedParameters& mechanism);
  std::map<std::string, Edit> edits_;                                       // by mechanism text
  std::vector<std::pair<std::string, std::shared_ptr<const Twin>>> twins_;  // last used first
  std::map<std::string, bool> mixes_ranges_;                                // by mechanism name
};

}  // namespace mmradartwin::diagnosis::likelihood
