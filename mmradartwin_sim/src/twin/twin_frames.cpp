#include <algorithm>
#include <cmath>

#include "mmradartwin_dsp/capture.h"
#include "mmradartwin_dsp/chirp_period.h"
#include "mmradartwin_sim/twin.h"
#include "stages/random_draw.h"
#include "twin/assembled_twin.h"

namespace mmradartwin {
namespace {

std::int16_t count(double full_scales) {
  return static_cast<std::int16_t>(std::lround(std::min(32767.0, std::max(-32768.0, full_scales * 32768))));
}

}  // namespace

bool Twin::hasFrameStage() const {
  const StageLists& stages = impl_->stages;
  return framesNeedRecords() || !stages.chirps.empty() || !stages.digitise.empty() || !stages.transport.empty();
}

bool Twin::framesNeedRecords() const {
  return !impl_->stages.chirp_paths.empty() || !impl_->stages.modulations.empty();
}

double Twin::clippedFraction() const {
  double fraction = 0;
  for (const DigitiseStage* m : impl_->stages.digitise) fraction = std::max(fraction, m->clippedFraction());
  return fraction;
}

ChirpContext AssembledTwin::chirpContext(const PoseContext& c, std::int64_t stamp_ns, int frame, int chirp) const {
  const RadarConfig& radar = c.radar;
  ChirpContext now{c};
  now.stamp_ns = stamp_ns;
  now.frame = frame;
  now.chirp = chirp;
  now.slot = chirp % radar.slots();
  now.time_s =
      1e-9 * static_cast<double>(radar.frame_offset_ns(frame)) + chirp * chirpPeriod_s(radar) + radar.window_center_s();
  now.frame_draw = drawKey(drawKey(seed, static_cast<std::uint64_t>(stamp_ns)), static_cast<std::uint64_t>(frame));
  now.draw = drawKey(now.frame_draw, static_cast<std::uint64_t>(chirp) + 1);
  return now;
}

void AssembledTwin::propagateWithDelays(const PoseContext& c, std::vector<PathRecord>& paths, DelayedGrid& grid) const {
  grid.x.setZero(c.radar.channels(), c.radar.samples_per_chirp);
  propagate(c, paths, grid.x);
  if (stages.modulations.empty()) return;
  for (PathRecord& r : paths) {
    for (std::size_t k = 0; k < r.c.size(); ++k) r.c[k] *= r.length_m[k] / kSpeedOfLight_m_per_s;
  }
  grid.delayed.setZero(c.radar.channels(), c.radar.samples_per_chirp);
  accumulate(c.radar, paths, grid.delayed);
}

void AssembledTwin::varyChirp(const ChirpContext& now, const DelayedGrid& still, ChirpScratch& scratch,
                              ComplexGrid& x) const {
  const PoseContext& c = now.pose;
  const int receivers = c.radar.receivers(), first = now.slot * receivers;
  const bool modulates = !stages.modulations.empty();
  if (modulates) scratch.weighted = still.delayed.middleRows(first, receivers);
  std::vector<PathRecord>& moving = scratch.moving;
  moving.clear();
  for (const ChirpPathStage* m : stages.chirp_paths) m->addChirpPaths(now, moving);
  if (!moving.empty()) {
    reweight(c, moving, 0);
    addReplicas(c, moving);
    moving = filtered(c, std::move(moving));
    propagateWithDelays(c, moving, scratch.added);
    x.middleRows(first, receivers) += scratch.added.x.middleRows(first, receivers);
    if (modulates) scratch.weighted += scratch.added.delayed.middleRows(first, receivers);
  }
  if (!modulates) return;
  scratch.chirp = x.middleRows(first, receivers);
  for (const ModulationStage* m : stages.modulations) m->modulateChirp(now, scratch.weighted, scratch.chirp);
  x.middleRows(first, receivers) = scratch.chirp;
}

void Twin::forEachChirp(const Simulation& pose, int frames,
                        const std::function<void(const ChirpContext&, ComplexGrid&)>& visit) const {
  const AssembledTwin& m = *impl_;
  const RadarConfig& radar = m.description.radar;
  PoseContext c = m.context(pose.T_map_radar, pose.stamp_ns);
  c.receiver_gain = [&m, &c](double length_m) { return m.toneGain(c, length_m); };
  const int slots = radar.slots(), receivers = radar.receivers();
  const bool varies = framesNeedRecords();

  // Paths that are the same in all chirps are propagated once.
  AssembledTwin::DelayedGrid still;
  if (varies) {
    std::vector<PathRecord> paths = m.filtered(c, pose.records);
    m.propagateWithDelays(c, paths, still);
  }
  AssembledTwin::ChirpScratch scratch;
  ComplexGrid x, chirp;
  for (int f = 0; f < frames; ++f) {
    for (int loop = 0; loop < radar.loops_per_frame; ++loop) {
      const auto at = [&](int slot) { return m.chirpContext(c, pose.stamp_ns, f, loop * slots + slot); };
      if (varies) {
        x = still.x;
        for (int slot = 0; slot < slots; ++slot) m.varyChirp(at(slot), still, scratch, x);
        m.receive(c, x);
      } else {
        x = pose.grid.x;
      }
      for (int slot = 0; slot < slots; ++slot) {
        const ChirpContext now = at(slot);
        chirp = x.middleRows(slot * receivers, receivers);
        for (const ChirpStage* stage : m.stages.chirps) stage->changeChirp(now, chirp);
        visit(now, chirp);
      }
    }
  }
}

void Twin::visitChirps(const Simulation& pose, int frames,
                       const std::function<void(const ChirpContext&, const ComplexGrid&)>& visit) const {
  forEachChirp(pose, frames, [&visit](const ChirpContext& c, ComplexGrid& x) { visit(c, x); });
}

std::vector<AdcCube> Twin::simulateFrames(const Simulation& pose, const FrameOptions& options) const {
  const AssembledTwin& m = *impl_;
  const RadarConfig& radar = m.description.radar;
  std::size_t surplus_bytes = 0;
  for (const TransportStage* stage : m.stages.transport) surplus_bytes += stage->surplusBytes();
  const int surplus = static_cast<int>((surplus_bytes + radar.bytes_per_frame() - 1) / radar.bytes_per_frame());

  std::vector<AdcCube> cubes(static_cast<std::size_t>(options.frames + surplus));
  for (std::size_t f = 0; f < cubes.size(); ++f) {
    AdcCube& cube = cubes[f];
    cube.stamp_ns = pose.stamp_ns + radar.frame_offset_ns(static_cast<std::int64_t>(f));
    cube.sequence = static_cast<std::uint32_t>(f);
    cube.chirps = radar.chirps_per_frame();
    cube.samples = radar.samples_per_chirp;
    cube.receivers = radar.receivers();
    cube.chirp_valid.assign(static_cast<std::size_t>(cube.chirps), 1);
    cube.data.reserve(static_cast<std::size_t>(cube.chirps) * cube.samples * cube.receivers * 2);
  }
  const double gain = std::pow(10.0, options.gain_db / 20);
  forEachChirp(pose, static_cast<int>(cubes.size()), [&](const ChirpContext& now, ComplexGrid& x) {
    x *= gain;
    for (const DigitiseStage* stage : m.stages.digitise) stage->digitise(now, x);
    std::vector<std::int16_t>& data = cubes[static_cast<std::size_t>(now.frame)].data;
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      for (Eigen::Index r = 0; r < x.rows(); ++r) {
        data.push_back(count(x(r, n).real()));
        data.push_back(count(x(r, n).imag()));
      }
    }
  });
  if (!m.stages.transport.empty()) {
    std::vector<std::uint8_t> payload;
    for (const AdcCube& cube : cubes) {
      const std::vector<std::uint8_t> bytes = encodeFrame(radar, cube.data);
      payload.insert(payload.end(), bytes.begin(), bytes.end());
    }
    const PayloadContext context{radar, options.pose_name,
                                 drawKey(drawKey(m.seed, static_cast<std::uint64_t>(pose.stamp_ns)), 0x7061796C6F6164)};
    for (const TransportStage* stage : m.stages.transport) stage->transport(context, payload);
    payload.resize(static_cast<std::size_t>(options.frames) * radar.bytes_per_frame(), 0);
    for (int f = 0; f < options.frames; ++f) {
      decodeFrame(radar, payload.data() + static_cast<std::size_t>(f) * radar.bytes_per_frame(),
                  cubes[static_cast<std::size_t>(f)].data);
    }
  }
  cubes.resize(static_cast<std::size_t>(options.frames));
  return cubes;
}

}  // namespace mmradartwin
