#include <algorithm>
#include <cmath>

#include "mechanisms/base/random_draw.h"
#include "mmradartwin_dsp/capture.h"
#include "twin/twin_impl.h"

namespace mmradartwin {
namespace {

/// From one chirp's start to the next: as radar.yaml says, else as short as its samples allow.
double chirpPeriod_s(const RadarConfig& radar) {
  const double sampled_s = radar.adc_start_s + radar.samples_per_chirp / radar.sample_rate_hz;
  return (std::isfinite(radar.ramp_end_s) ? radar.ramp_end_s : sampled_s) +
         (std::isfinite(radar.idle_s) ? radar.idle_s : 0);
}

std::int16_t count(double full_scales) {
  return static_cast<std::int16_t>(std::lround(std::min(32767.0, std::max(-32768.0, full_scales * 32768))));
}

}  // namespace

bool Twin::hasFrameStage() const {
  const Impl& m = *impl_;
  return m.has_chirp_paths || m.has_modulation || m.has_chirp_stage || m.has_digitise || m.has_transport;
}

bool Twin::framesNeedRecords() const { return impl_->has_chirp_paths || impl_->has_modulation; }

double Twin::clippedFraction() const {
  double fraction = 0;
  for (const auto& m : impl_->mechanisms) fraction = std::max(fraction, m->clippedFraction());
  return fraction;
}

void Twin::forEachChirp(const Simulation& pose, int frames,
                        const std::function<void(const ChirpContext&, ComplexGrid&)>& visit) const {
  const Impl& m = *impl_;
  const RadarConfig& radar = m.description.radar;
  PoseContext c = m.context(pose.T_map_radar, pose.stamp_ns);
  c.receiver_gain = [&m, &c](double length_m) { return m.toneGain(c, length_m); };
  const int slots = radar.slots(), receivers = radar.receivers(), samples = radar.samples_per_chirp;
  const double period_s = chirpPeriod_s(radar);
  const std::uint64_t pose_draw = drawKey(m.seed, static_cast<std::uint64_t>(pose.stamp_ns));
  const bool varies = framesNeedRecords();

  // What stays the same from chirp to chirp is propagated once.
  ComplexGrid still = ComplexGrid::Zero(radar.channels(), samples), delayed;
  if (varies) {
    std::vector<PathRecord> paths = m.filtered(c, pose.records);
    m.propagate(c, paths, still);
    if (m.has_modulation) {
      for (PathRecord& r : paths) {
        for (std::size_t k = 0; k < r.c.size(); ++k) r.c[k] *= r.length_m[k] / kSpeedOfLight_m_per_s;
      }
      delayed = ComplexGrid::Zero(radar.channels(), samples);
      accumulate(radar, paths, delayed);
    }
  }
  ComplexGrid x, moving_delayed, chirp, weighted;
  std::vector<PathRecord> moving;
  for (int f = 0; f < frames; ++f) {
    for (int loop = 0; loop < radar.loops_per_frame; ++loop) {
      const auto at = [&](int slot) {
        const int number = loop * slots + slot;
        ChirpContext chirp_context{c};
        chirp_context.stamp_ns = pose.stamp_ns;
        chirp_context.frame = f;
        chirp_context.chirp = number;
        chirp_context.slot = slot;
        chirp_context.time_s =
            1e-9 * static_cast<double>(radar.frame_offset_ns(f)) + number * period_s + radar.window_center_s();
        chirp_context.frame_draw = drawKey(pose_draw, static_cast<std::uint64_t>(f));
        chirp_context.draw = drawKey(chirp_context.frame_draw, static_cast<std::uint64_t>(number) + 1);
        return chirp_context;
      };
      if (varies) {
        x = still;
        for (int slot = 0; slot < slots; ++slot) {
          const ChirpContext now = at(slot);
          const auto rows = [&](ComplexGrid& grid) { return grid.middleRows(slot * receivers, receivers); };
          if (m.has_modulation) weighted = rows(delayed);
          moving.clear();
          if (m.has_chirp_paths) {
            for (const auto& mechanism : m.mechanisms) {
              if (mechanism->hasChirpPaths()) mechanism->addChirpPaths(now, moving);
            }
          }
          if (!moving.empty()) {
            m.reweight(c, moving, 0);
            m.addReplicas(c, moving);
            moving = m.filtered(c, std::move(moving));
            moving_delayed.setZero(radar.channels(), samples);
            m.propagate(c, moving, moving_delayed);
            rows(x) += rows(moving_delayed);
            if (m.has_modulation) {
              for (PathRecord& r : moving) {
                for (std::size_t k = 0; k < r.c.size(); ++k) r.c[k] *= r.length_m[k] / kSpeedOfLight_m_per_s;
              }
              moving_delayed.setZero();
              accumulate(radar, moving, moving_delayed);
              weighted += rows(moving_delayed);
            }
          }
          if (!m.has_modulation) continue;
          chirp = rows(x);
          for (const auto& mechanism : m.mechanisms) {
            if (mechanism->hasModulation()) mechanism->modulateChirp(now, weighted, chirp);
          }
          rows(x) = chirp;
        }
        m.receive(c, x);
      } else {
        x = pose.grid.x;
      }
      for (int slot = 0; slot < slots; ++slot) {
        const ChirpContext now = at(slot);
        chirp = x.middleRows(slot * receivers, receivers);
        if (m.has_chirp_stage) {
          for (const auto& mechanism : m.mechanisms) {
            if (mechanism->hasChirpStage()) mechanism->changeChirp(now, chirp);
          }
        }
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
  const Impl& m = *impl_;
  const RadarConfig& radar = m.description.radar;
  std::size_t surplus_bytes = 0;
  for (const auto& mechanism : m.mechanisms) surplus_bytes += mechanism->surplusBytes();
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
    if (m.has_digitise) {
      for (const auto& mechanism : m.mechanisms) {
        if (mechanism->hasDigitiseStage()) mechanism->digitise(now, x);
      }
    }
    std::vector<std::int16_t>& data = cubes[static_cast<std::size_t>(now.frame)].data;
    for (Eigen::Index n = 0; n < x.cols(); ++n) {
      for (Eigen::Index r = 0; r < x.rows(); ++r) {
        data.push_back(count(x(r, n).real()));
        data.push_back(count(x(r, n).imag()));
      }
    }
  });
  if (m.has_transport) {
    std::vector<std::uint8_t> payload;
    for (const AdcCube& cube : cubes) {
      const std::vector<std::uint8_t> bytes = encodeFrame(radar, cube.data);
      payload.insert(payload.end(), bytes.begin(), bytes.end());
    }
    const PayloadContext context{radar, options.pose_name,
                                 drawKey(drawKey(m.seed, static_cast<std::uint64_t>(pose.stamp_ns)), 0x7061796C6F6164)};
    for (const auto& mechanism : m.mechanisms) {
      if (mechanism->hasTransportStage()) mechanism->transport(context, payload);
    }
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
