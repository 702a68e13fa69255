// mmradartwin.sim: the twin for Python. Arrays and records come as the classes of the package mmradartwin.

#include <pybind11/complex.h>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/range_angle.h"
#include "mmradartwin_dsp/strict_yaml.h"
#include "mmradartwin_sim/cell_records.h"
#include "mmradartwin_sim/mechanism_registry.h"
#include "mmradartwin_sim/mechanism_stages.h"
#include "mmradartwin_sim/plugin.h"
#include "mmradartwin_sim/pose_placement.h"
#include "mmradartwin_sim/twin.h"

namespace py = pybind11;
using namespace mmradartwin;

namespace {

using Matrix4 = Eigen::Matrix<double, 4, 4>;

/// What twins that change() made of each other share: scene, radar and session.
struct Origin {
  std::vector<Pose> poses;  ///< of the session, where there is one
};

struct PythonTwin {
  std::shared_ptr<const Origin> origin;
  std::shared_ptr<const Twin> twin;
};

/// Paths as they were traced, before weights.
struct Traced {
  std::shared_ptr<const Origin> origin;
  std::string tracing;  ///< tracingOf() the twin
  std::int64_t stamp_ns;
  Eigen::Isometry3d T_map_radar;
  std::vector<PathRecord> records;
};

struct PythonSimulation {
  std::shared_ptr<const Twin> twin;
  Simulation simulation;
};

py::object mmradartwinClass(const char* name) { return py::module_::import("mmradartwin").attr(name); }

template <typename T>
py::array_t<T> array(const std::vector<py::ssize_t>& shape, const std::vector<T>& values) {
  return py::array_t<T>(shape, values.data());
}

Eigen::Isometry3d isometry(const Matrix4& T) {
  const Eigen::Matrix3d R = T.topLeftCorner<3, 3>();
  const bool rigid = T.allFinite() && (R * R.transpose()).isIdentity(1e-6) && R.determinant() > 0 &&
                     T.row(3) == Eigen::RowVector4d(0, 0, 0, 1);
  if (!rigid)
    throw InputError("T_map_radar: is no rotation and translation; give a 4 x 4 matrix with the last row 0 0 0 1");
  Eigen::Isometry3d isometry;
  isometry.matrix() = T;
  return isometry;
}

/// Text that is equal for mechanisms with which a twin traces the same paths.
std::string tracingOf(const std::vector<NamedParameters>& mechanisms) {
  TwinDescription tracing;
  for (const NamedParameters& named : mechanisms) {
    const std::unique_ptr<Mechanism> m = MechanismRegistry::instance().create(named.mechanism);
    const bool traces = dynamic_cast<const SceneStage*>(m.get()) || dynamic_cast<const MountingStage*>(m.get()) ||
                        (dynamic_cast<const PathStage*>(m.get()) && !m->needsStrongestAmplitude());
    if (!traces) continue;
    NamedParameters kept{named.mechanism, {}};
    for (const ParameterSpec& spec : m->parameters()) {
      if (!spec.weighs && named.values.has(spec.name)) kept.values.set(spec.name, named.values.all().at(spec.name));
    }
    tracing.mechanisms.push_back(std::move(kept));
  }
  std::stable_sort(tracing.mechanisms.begin(), tracing.mechanisms.end(),
                   [](const auto& a, const auto& b) { return a.mechanism < b.mechanism; });
  return tracing.toYaml();
}

PythonTwin makeTwin(const std::string& twin_file, const std::optional<std::string>& scene_file,
                    const std::optional<std::string>& radar_file, std::uint64_t seed) {
  const RadarConfig radar = radar_file ? loadRadarConfig(*radar_file) : RadarConfig();
  TwinDescription description = loadTwin(twin_file, scene_file, radar);
  if (!radar_file && description.radar_file.empty()) {
    throw InputError((twin_file.empty() ? "Twin" : twin_file + ": key radar") +
                     std::string(": no radar is named; give radar="));
  }
  return {std::make_shared<Origin>(), std::make_shared<Twin>(std::move(description), seed)};
}

/// As the program simulate makes it.
PythonTwin twinOfSession(const std::string& session, const std::string& twin_file, std::uint64_t seed) {
  SessionOptions options;
  options.need_captures = false;
  options.exclude_duplicates = false;
  const Recording recording = openSession(session, options);
  const std::string file = twin_file.empty() ? recording.twin_file.value_or("") : twin_file;
  Twin twin =
      placedTwin(loadTwin(file, recording.scene_file, recording.radar), recording.poses, recording.source, seed);
  std::vector<Eigen::Isometry3d> poses;
  for (const Pose& pose : recording.poses) poses.push_back(pose.T_map_radar);
  twin.prepare(poses);
  return {std::make_shared<Origin>(Origin{recording.poses}), std::make_shared<Twin>(std::move(twin))};
}

PythonTwin changed(const PythonTwin& self, const py::dict& mechanisms) {
  const std::string name = "Twin.changed()";
  py::dict given, removed;
  for (const auto& [key, value] : mechanisms) (value.is_none() ? removed : given)[key] = value;
  // JSON is YAML: a mechanism is read by the reader of twin.yaml.
  std::vector<NamedParameters> read;
  if (!given.empty()) {
    YamlMap yaml = YamlMap::parse(py::module_::import("json").attr("dumps")(given).cast<std::string>(), name);
    read = readMechanisms(yaml);
  }
  std::vector<NamedParameters> all;
  for (const NamedParameters& m : self.twin->description().mechanisms) {
    if (!mechanisms.contains(m.mechanism)) all.push_back(m);
  }
  for (const auto& [key, value] : removed) {
    const auto& had = self.twin->description().mechanisms;
    const auto has = [name = key.cast<std::string>()](const NamedParameters& m) { return m.mechanism == name; };
    if (std::none_of(had.begin(), had.end(), has)) {
      throw InputError(name + ": key " + key.cast<std::string>() + ": the twin has no such mechanism to leave out");
    }
  }
  all.insert(all.end(), read.begin(), read.end());
  const py::gil_scoped_release released;
  Twin twin = self.twin->changed(std::move(all));
  if (!self.origin->poses.empty()) {
    twin.setSession(self.origin->poses);
    std::vector<Eigen::Isometry3d> poses;
    for (const Pose& pose : self.origin->poses) poses.push_back(pose.T_map_radar);
    twin.setStrongestAmplitude(-1);
    twin.prepare(poses);
  }
  return {self.origin, std::make_shared<Twin>(std::move(twin))};
}

/// By name the parameters, or a list of them where a mechanism stands several times.
py::dict mechanismsOf(const PythonTwin& self) {
  py::dict all;
  for (const NamedParameters& m : self.twin->description().mechanisms) {
    py::dict values;
    for (const auto& [key, value] : m.values.all()) {
      const py::object object = py::cast(value);
      if (py::isinstance<py::float_>(object) || py::len(object) > 0) values[key.c_str()] = object;  // empty: not given
    }
    if (!all.contains(m.mechanism)) {
      all[m.mechanism.c_str()] = values;
    } else if (py::isinstance<py::list>(all[m.mechanism.c_str()])) {
      all[m.mechanism.c_str()].cast<py::list>().append(values);
    } else {
      py::list several;
      several.append(all[m.mechanism.c_str()]);
      several.append(values);
      all[m.mechanism.c_str()] = several;
    }
  }
  return all;
}

Traced trace(const PythonTwin& self, const Matrix4& T, std::int64_t stamp_ns) {
  const Eigen::Isometry3d T_map_radar = isometry(T);
  return {self.origin, tracingOf(self.twin->description().mechanisms), stamp_ns, T_map_radar,
          self.twin->trace(T_map_radar, stamp_ns)};
}

PythonSimulation weigh(const PythonTwin& self, const Traced& traced) {
  if (traced.origin != self.origin)
    throw InputError("Twin.weigh(): the paths are of a twin that was not changed() into this one");
  if (traced.tracing != tracingOf(self.twin->description().mechanisms)) {
    throw InputError(
        "Twin.weigh(): this twin traces other paths than the twin of these: it differs in more than weights and "
        "receiver; trace() again");
  }
  return {self.twin, self.twin->weigh(traced.T_map_radar, traced.records, traced.stamp_ns)};
}

PythonSimulation simulate(const PythonTwin& self, const Matrix4& T, std::int64_t stamp_ns) {
  return {self.twin, self.twin->simulate(isometry(T), stamp_ns)};
}

py::object gridOf(const PythonSimulation& self) {
  const ReceiveGrid& grid = self.simulation.grid;
  return mmradartwinClass("ReceiveGrid")(grid.x, grid.full_scale, grid.frames, self.simulation.stamp_ns,
                                         Matrix4(self.simulation.T_map_radar.matrix()));
}

py::object pathsOf(const PythonSimulation& self, const std::string& diffuse_records) {
  const std::vector<PathRecord> records = exportedRecords(self.twin->radar(), self.simulation.records,
                                                          diffuseRecordsFrom(diffuse_records, "diffuse_records"));
  const Scene& scene = self.twin->scene();
  const auto count = static_cast<py::ssize_t>(records.size());
  const py::ssize_t channels = self.twin->radar().channels();
  std::vector<double> departure, arrival, amplitude, length_m;
  std::vector<std::complex<double>> contribution;
  std::vector<std::int64_t> bounces;
  py::list event, actors, materials, vertices_m;
  for (const PathRecord& r : records) {
    departure.insert(departure.end(), r.departure.data(), r.departure.data() + 3);
    arrival.insert(arrival.end(), r.arrival.data(), r.arrival.data() + 3);
    amplitude.push_back(r.amplitude);
    length_m.insert(length_m.end(), r.length_m.begin(), r.length_m.end());
    contribution.insert(contribution.end(), r.c.begin(), r.c.end());
    bounces.push_back(r.bounces);
    event.append(*r.event);
    py::tuple names(r.actors.size()), tags(r.actors.size());
    for (std::size_t i = 0; i < r.actors.size(); ++i) {
      names[i] = scene.actorOf(r.actors[i]).name;
      tags[i] = scene.actorOf(r.actors[i]).material_tag;
    }
    actors.append(names);
    materials.append(tags);
    std::vector<double> vertices;
    for (const Eigen::Vector3d& v : r.vertices) vertices.insert(vertices.end(), v.data(), v.data() + 3);
    vertices_m.append(array({static_cast<py::ssize_t>(r.vertices.size()), 3}, vertices));
  }
  using namespace py::literals;
  return py::module_::import("mmradartwin.paths")
      .attr("records_of")(array({count, 3}, departure), array({count, 3}, arrival), array({count}, amplitude),
                          array({count, channels}, length_m), array({count, channels}, contribution),
                          "bounces"_a = array({count}, bounces), "event"_a = event, "actors"_a = actors,
                          "materials"_a = materials, "vertices_m"_a = vertices_m);
}

/// Takes and returns what the package calls ReceiveGrid and RangeAngleMap.
py::object mapOf(const SignalChain& chain, const py::object& grid) {
  ReceiveGrid measured;
  measured.x = grid.attr("x").cast<ComplexGrid>();
  measured.full_scale = grid.attr("full_scale").cast<double>();
  const RangeAngleMap map = chain.map(measured);
  const auto list = [](const std::vector<double>& values) {
    return array({static_cast<py::ssize_t>(values.size())}, values);
  };
  return mmradartwinClass("RangeAngleMap")(list(map.axes.range_m), list(map.axes.azimuth_rad), map.power_db,
                                           grid.attr("frames"), grid.attr("stamp_ns"), grid.attr("T_map_radar"));
}

}  // namespace

PYBIND11_MODULE(sim, m) {
  using namespace py::literals;
  using Released = py::call_guard<py::gil_scoped_release>;
  m.doc() = "The simulator. Twin simulates poses; SignalChain makes range-angle maps as the programs do.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      PyErr_SetString(mmradartwinClass("InputError").ptr(), error.what());
    }
  });

  py::class_<Traced>(m, "Traced", "Paths of one pose before weights, for Twin.weigh().")
      .def("__len__", [](const Traced& traced) { return traced.records.size(); });

  py::class_<PythonSimulation>(m, "Simulation", "One simulated pose.")
      .def_property_readonly("grid", gridOf, "ReceiveGrid: x [M][N] in path amplitudes, full_scale 1.")
      .def("paths", pathsOf, "diffuse_records"_a = "cells",
           "PathRecords. Scatter points of rough surfaces are summed by cells, as simulate writes them; with "
           "diffuse_records='points' all stand by themselves.")
      .def_property_readonly(
          "T_map_radar", [](const PythonSimulation& s) { return Matrix4(s.simulation.T_map_radar.matrix()); },
          "[4][4], the pose asked for.")
      .def_property_readonly("stamp_ns", [](const PythonSimulation& s) { return s.simulation.stamp_ns; })
      .def_property_readonly(
          "propagation_only", [](const PythonSimulation& s) { return s.simulation.propagation_only; },
          "True where the grid is the sum of its paths; else the receiver acts on it.");

  py::class_<PythonTwin>(m, "Twin", "A scene, a radar and mechanisms.")
      .def(
          py::init(&makeTwin), Released(), "twin_file"_a = "", "scene"_a = py::none(), "radar"_a = py::none(),
          "seed"_a = 1,
          "Reads a twin.yaml, without one the base mechanisms. scene and radar are files that stand in where twin.yaml "
          "names none; seed is that of the scatter points' phases.")
      .def_static("of_session", &twinOfSession, Released(), "session"_a, "twin_file"_a = "", "seed"_a = 1,
                  "The twin with which the program simulate simulates a session; twin_file instead of the session's.")
      .def("simulate", &simulate, Released(), "T_map_radar"_a, "stamp_ns"_a = 0,
           "Simulation of a pose, T_map_radar [4][4]; stamp_ns matters to mechanisms that change with time.")
      .def("trace", &trace, Released(), "T_map_radar"_a, "stamp_ns"_a = 0,
           "The first half of simulate(): Traced, all that has to be found in the scene.")
      .def(
          "weigh", &weigh, Released(), "traced"_a,
          "The second half: Simulation of paths that this twin traced, or another that differs in weights and receiver "
          "alone.")
      .def("changed", &changed, "mechanisms"_a,
           "This twin with other mechanisms: by name their parameters as in twin.yaml, those not given at their "
           "defaults, "
           "or None to leave a mechanism out. Mechanisms that are not named stay. Reads no mesh again.")
      .def_property_readonly("mechanisms", mechanismsOf,
                             "Parameters by mechanism, all of them; a list where a mechanism stands several times.")
      .def_property_readonly(
          "channels", [](const PythonTwin& t) { return t.twin->radar().channels(); }, "M.")
      .def(
          "signal_chain", [](const PythonTwin& t) { return SignalChain(t.twin->radar()); }, "SignalChain of its radar.")
      .def(
          "notes", [](const PythonTwin& t) { return t.twin->notes(); }, "What to know about this scene, a line each.");

  py::class_<SignalChain>(m, "SignalChain", "Window, range FFT, angle FFT, level: the one chain of the programs.")
      .def(py::init([](const std::string& radar) { return SignalChain(loadRadarConfig(radar)); }), "radar"_a,
           "radar: the file.")
      .def("map", mapOf, "grid"_a, "RangeAngleMap of a ReceiveGrid, measured or simulated.");
}
