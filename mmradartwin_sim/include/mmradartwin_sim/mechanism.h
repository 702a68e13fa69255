#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <boost/functional/hash.hpp>
#include <complex>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <unordered_set>
#include <variant>
#include <vector>

#include "mmradartwin_dsp/radar_config.h"
#include "mmradartwin_dsp/receive_grid.h"
#include "mmradartwin_sim/path_record.h"
#include "mmradartwin_sim/scene.h"

namespace mmradartwin {

enum class ParameterKind { kNumber, kInteger, kText, kNumbers, kTexts };

/// A parameter that a mechanism has. Ranges are checked before the mechanism sees a value.
struct ParameterSpec {
  std::string name;  ///< with its unit as in causes.md, e.g. yaw_deg
  std::string unit;  ///< "deg", "m", "dB", "1", "" for texts
  ParameterKind kind = ParameterKind::kNumber;
  double min = 0, max = 0;
  bool required = true;
  std::variant<double, std::string, std::vector<double>, std::vector<std::string>> default_value = 0.0;
  std::string meaning;  ///< one line
  /// For a diagnosis that tries the mechanism on data: the value at which it does nothing, and one at which it plainly
  /// does something. NaN where the parameter keeps its default in a trial. An integer or text is never tried.
  double neutral = std::numeric_limits<double>::quiet_NaN(), typical = std::numeric_limits<double>::quiet_NaN();
  bool weighs = false;  ///< acts in reweight() and later alone: scene and traced paths stay as they are
};

/// Checked values by name; every parameter of the mechanism is present unless it is optional without default.
class Parameters {
 public:
  using Value = std::variant<double, std::string, std::vector<double>, std::vector<std::string>>;
  void set(const std::string& name, Value value);
  bool has(const std::string& name) const;
  double number(const std::string& name) const;
  const std::string& text(const std::string& name) const;
  const std::vector<double>& numbers(const std::string& name) const;
  const std::vector<std::string>& texts(const std::string& name) const;
  const std::map<std::string, Value>& all() const { return values_; }

 private:
  std::map<std::string, Value> values_;
};

/// Base field of view of emission and arrival: |azimuth| < 90 deg, |elevation| <= 20 deg of a direction in radar_link.
bool inFieldOfView(const Eigen::Vector3d& direction_radar);

/// Actors that moved while the radar stood, and the space that they left and took: a path that neither meets nor
/// crosses any of it is as it was.
struct SceneChange {
  std::vector<int> actors;                  ///< Scene::actors index
  std::vector<Eigen::AlignedBox3d> bounds;  ///< map, with a margin; where they were and where they are

  /// Adds bounds with the margin that what touches an actor's faces needs.
  void addBounds(const Eigen::AlignedBox3d& box);
  bool moved(int actor) const { return std::find(actors.begin(), actors.end(), actor) != actors.end(); }
  /// True where the segment comes into one of the bounds.
  bool crosses(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;
  /// True where a path from the radar and back may be another after the change.
  bool touches(const Eigen::Vector3d& radar, const PathRecord& record) const;
};

/// Cells, as a radar resolves them, within which scatter points of one facet are one path with their power, at the
/// place and with the phase of the one that lies nearest to their mean: thousands of points become a hundred where the
/// phases between them say nothing.
struct CloudCells {
  using Cell = std::array<int, 4>;  ///< facet, range, sine, elevation
  using CellSet = std::unordered_set<Cell, boost::hash<Cell>>;

  Eigen::Isometry3d T_map_radar;  ///< about which the cells lie, wherever a mechanism moves the radar
  double range_m;                 ///< their size in slant range,
  double sine;                    ///< in the sine of the direction along the array
  double elevation_sine;          ///< and upwards
  /// Points that it tells apart share no cell; may be null.
  std::function<std::vector<char>(const std::vector<Eigen::Vector3d>& points)> sides = {};
  /// With PoseContext::change: filled with the cells that it touches, whose paths alone are added; may be null.
  CellSet* touched = nullptr;

  /// A point's place in units of the cells' size.
  Eigen::Array3d placeOf(const Eigen::Vector3d& point) const;
  Cell cellOf(int facet, const Eigen::Vector3d& point) const;
};

/// Everything a mechanism may look at for one pose.
struct PoseContext {
  const RadarConfig& radar;
  const Scene& scene;
  const RayCaster& rays;
  Eigen::Isometry3d T_map_radar;  ///< where the twin's radar is, after all pose() calls
  double frequency_hz;            ///< of the coefficients: the window's centre
  bool inFieldOfView(const Eigen::Vector3d& direction_radar) const;  ///< the free function
  double max_range_m;                                                ///< paths with length/2 beyond are left out
  std::uint64_t seed;  ///< of what is random by nature (phases of scatter points)
  /// Strongest A_p of the session's poses, for levels that are relative to it.
  std::function<double()> strongest_amplitude;
  /// |gain| of the receiver's filters at a path length: what a level stated after the IF filter has to make up for.
  std::function<double(double length_m)> receiver_gain;
  /// When the pose was taken: after the session's first pose, and its place among the session's poses in time order.
  /// Zero, and 0 of 1, where no session is known (Twin::setSession).
  double session_s = 0;
  int pose_index = 0, pose_count = 1;
  /// Where the pose's paths are known but for what a change touches; else null (Mechanism::tracesChanges).
  const SceneChange* change = nullptr;
  const CloudCells* cloud = nullptr;  ///< null: every scatter point is a path
  /// Paths that meet this actor (index in `scene`) are wanted alone; others that are added are thrown away. -1: all
  /// are.
  int only_actor = -1;
};

/// One chirp of one frame of a pose, for what differs from chirp to chirp (DESIGN section 3: chirps come as
/// loop * slots + slot).
struct ChirpContext {
  const PoseContext& pose;
  std::int64_t stamp_ns = 0;  ///< start of the pose's first frame
  int frame = 0, chirp = 0, slot = 0;
  double time_s = 0;             ///< centre of the chirp's ADC window after stamp_ns
  std::uint64_t draw = 0;        ///< key of this chirp's random numbers: seed, stamp, frame and chirp make it
  std::uint64_t frame_draw = 0;  ///< the same for all chirps of a frame
};

/// The bytes of one pose on their way from the ADC: frames back to back in the radar's capture layout.
struct PayloadContext {
  const RadarConfig& radar;
  std::string pose;  ///< its name, "" where it has none
  std::uint64_t draw = 0;
};

/// One unit of the physical model (DESIGN section 4). Implementations override the stages they act in; all stages are
/// const and may be called for several poses at once.
class Mechanism {
 public:
  virtual ~Mechanism() = default;
  virtual const std::string& name() const = 0;
  virtual std::vector<ParameterSpec> parameters() const = 0;
  /// Takes checked parameters; throws InputError where they do not fit the scene or radar (an unknown actor, say).
  virtual void configure(const Parameters& values, const Scene& scene, const RadarConfig& radar) = 0;

  /// True where a twin may have it several times, each for another thing in the room.
  virtual bool standsSeveralTimes() const { return false; }
  /// What the user should know about this scene with this mechanism, a line each; asked for after build().
  virtual std::vector<std::string> notes() const { return {}; }
  /// Where the order of two mechanisms in one stage matters, the lower rank acts first; the file's order never matters.
  virtual int rank() const { return 0; }
  /// Mechanisms whose records addPaths() looks at: where a mechanism is traced alone, it is traced beside these.
  virtual std::vector<std::string> looksAtPathsOf() const { return {}; }

  // Stages, in the order in which a simulation runs them.
  virtual void editScene(Scene&) const {}  ///< once, on loading
  /// Once, after all editScene(): precomputes what depends on the scene alone. The scene outlives the mechanism.
  virtual void build(const Scene&, const RadarConfig&) {}
  /// Some actors of build()'s scene stand elsewhere now; ids are the same.
  virtual void sceneChanged(const Scene& scene, const RadarConfig& radar, const SceneChange&) { build(scene, radar); }
  /// True where addPaths() adds, with PoseContext::change, those paths alone that SceneChange::touches(). Else all
  /// paths of the mechanism are found again when an actor moves.
  virtual bool tracesChanges() const { return false; }
  virtual Eigen::Isometry3d pose(const Eigen::Isometry3d& T_map_radar) const { return T_map_radar; }
  /// How much later than the truth poses are stamped, s: acts before all pose(), where the radar moves.
  virtual double poseLag_s() const { return 0; }
  virtual void addPaths(const PoseContext&, std::vector<PathRecord>&) const {}
  virtual void reweight(const PoseContext&, PathRecord&) const {}  ///< every path of every mechanism
  /// Turns a path, as all weights leave it, into the further one that it brings along; false where it brings none.
  virtual bool replicate(const PoseContext&, PathRecord&) const { return false; }
  virtual bool hasReplicas() const { return false; }
  /// Gain of the receiver on the tone of a path of this length: filters act here, exactly, on the received grid.
  virtual std::complex<double> toneGain(const PoseContext&, double /*length_m*/) const { return 1.0; }
  virtual bool hasToneGain() const { return false; }
  virtual void receive(const PoseContext&, ComplexGrid&) const {}  ///< on the propagated grid
  /// True where receive() does something: then the grid is more than its records.
  virtual bool hasReceiveStage() const { return false; }
  /// True where addPaths() or receive() wants strongest_amplitude().
  virtual bool needsStrongestAmplitude() const { return false; }
  /// Between propagation and receive(), with the paths (as the receiver's filters leave them) that make up the grid.
  virtual void distort(const PoseContext&, const std::vector<PathRecord>&, ComplexGrid&) const {}
  virtual bool hasDistortStage() const { return false; }

  // Stages of frames, run for every chirp by Twin::simulateFrames() alone: the grid of a pose is what stays the same.
  /// Echoes that are there for this chirp only; reweight(), filters and receive() act on them as on any path.
  virtual void addChirpPaths(const ChirpContext&, std::vector<PathRecord>&) const {}
  virtual bool hasChirpPaths() const { return false; }
  /// x [R][N] of one chirp before receive(). delayed [R][N] is the same with every path weighted by its delay in s.
  virtual void modulateChirp(const ChirpContext&, const ComplexGrid& /*delayed*/, ComplexGrid& /*x*/) const {}
  virtual bool hasModulation() const { return false; }
  /// x [R][N] of one chirp after receive(), in units of path amplitude.
  virtual void changeChirp(const ChirpContext&, ComplexGrid&) const {}
  virtual bool hasChirpStage() const { return false; }
  /// x [R][N] of one chirp in units of full scale, before it is rounded to 16 bit and held within full scale.
  virtual void digitise(const ChirpContext&, ComplexGrid&) const {}
  virtual bool hasDigitiseStage() const { return false; }
  /// Share of I and Q values that lie beyond full scale; a session's gain is chosen for it where it is not 0.
  virtual double clippedFraction() const { return 0; }
  /// All frames of a pose as bytes. They may be shortened by up to surplusBytes(): so many more are made.
  virtual void transport(const PayloadContext&, std::vector<std::uint8_t>&) const {}
  virtual bool hasTransportStage() const { return false; }
  virtual std::size_t surplusBytes() const { return 0; }
  /// Name of the one pose that the mechanism concerns, "" for all. A session without it is refused.
  virtual std::string onlyPose() const { return {}; }
};

/// Mechanisms are found by name. A user's package registers one from its own plug-in library.
class MechanismRegistry {
 public:
  using Factory = std::function<std::unique_ptr<Mechanism>()>;
  static MechanismRegistry& instance();
  void add(const std::string& name, Factory factory);
  /// Throws InputError naming the known mechanisms.
  std::unique_ptr<Mechanism> create(const std::string& name) const;
  std::vector<std::string> names() const;

 private:
  std::map<std::string, Factory> factories_;
};

}  // namespace mmradartwin
