#include "mmradartwin_sim/path_record.h"

#include <cmath>
#include <fstream>
#include <iomanip>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_sim/scene.h"
#include "records/path_phase.h"

namespace mmradartwin {
double phaseAtCenter_rad(const RadarConfig& radar, double length_m) {
  const double tau_s = length_m / kSpeedOfLight_m_per_s;
  const double turns = radar.center_frequency_hz() * tau_s - 0.5 * radar.slope_hz_per_s * tau_s * tau_s;
  return 2 * M_PI * (turns - std::round(turns));
}

int rangeBin(const RadarConfig& radar, double length_m) {
  const int bin = static_cast<int>(std::lround(0.5 * length_m / radar.range_bin_m()));
  return std::min(std::max(bin, 0), radar.samples_per_chirp - 1);
}

void accumulate(const RadarConfig& radar, const std::vector<PathRecord>& records, ComplexGrid& x) {
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  if (x.rows() != channels || x.cols() != samples) x = ComplexGrid::Zero(channels, samples);
  const double turns_per_m = radar.slope_hz_per_s / kSpeedOfLight_m_per_s;
  const double first_s = radar.sample_time_s(0) - radar.window_center_s();
  for (const PathRecord& record : records) {
    for (int k = 0; k < channels; ++k) {
      const double rate = 2 * M_PI * turns_per_m * record.length_m[k];
      // Four interleaved recurrences: they need not wait for each other, and rounding grows with the number of steps.
      // 64 samples stay at 1e-14.
      const std::complex<double> one = std::polar(1.0, rate / radar.sample_rate_hz), two = one * one, four = two * two;
      const std::complex<double> first = record.c[k] * std::polar(1.0, rate * first_s), third = first * two;
      const std::complex<double> begin[4] = {first, first * one, third, third * one};
      const double sr = four.real(), si = four.imag();
      double re[4], im[4];
      for (int i = 0; i < 4; ++i) {
        re[i] = begin[i].real();
        im[i] = begin[i].imag();
      }
      std::complex<double>* row = &x(k, 0);
      int n = 0;
      for (; n + 3 < samples; n += 4) {
        for (int i = 0; i < 4; ++i) {
          row[n + i] += std::complex<double>(re[i], im[i]);
          const double next = re[i] * sr - im[i] * si;
          im[i] = re[i] * si + im[i] * sr;
          re[i] = next;
        }
      }
      for (int i = 0; n < samples; ++n, ++i) row[n] += std::complex<double>(re[i], im[i]);
    }
  }
}

void setContribution(const RadarConfig& radar, std::complex<double> coefficient, PathRecord& record) {
  record.amplitude = std::abs(coefficient);
  record.c.resize(record.length_m.size());
  for (std::size_t k = 0; k < record.c.size(); ++k) {
    record.c[k] = coefficient * std::polar(1.0, phaseAtCenter_rad(radar, record.length_m[k]));
  }
  record.phase_rad = std::arg(record.c[0]);
  record.range_bin = rangeBin(radar, record.length_m[0]);
}

double meanLength_m(const PathRecord& record) {
  double sum = 0;
  for (double l : record.length_m) sum += l;
  return sum / static_cast<double>(record.length_m.size());
}

void lengthen(const RadarConfig& radar, double extra_m, PathRecord& record) {
  lengthenChannels(radar, PerChannel<double>(record.c.size(), extra_m), record);
}

void lengthenChannels(const RadarConfig& radar, const PerChannel<double>& extra_m, PathRecord& record) {
  for (std::size_t k = 0; k < record.c.size(); ++k) {
    const double before = phaseAtCenter_rad(radar, record.length_m[k]);
    record.length_m[k] += extra_m[k];
    const double after = phaseAtCenter_rad(radar, record.length_m[k]);
    record.c[k] *= std::polar(1.0, after - before);
  }
  record.phase_rad = std::arg(record.c[0]);
  record.range_bin = rangeBin(radar, record.length_m[0]);
}

void scaleRecord(std::complex<double> factor, PathRecord& record) {
  record.amplitude *= std::abs(factor);
  for (auto& c : record.c) c *= factor;
  record.phase_rad = std::arg(record.c[0]);
}

/// Compares with phasors evaluated one by one at three samples: another arithmetic than the recurrence that made x.
RecordCheck checkRecords(const RadarConfig& radar, const std::vector<PathRecord>& records, const ComplexGrid& x) {
  RecordCheck result;
  const int channels = radar.channels(), samples = radar.samples_per_chirp;
  const std::vector<int> probes = {0, samples / 2, samples - 1};
  Eigen::MatrixXcd direct = Eigen::MatrixXcd::Zero(channels, static_cast<Eigen::Index>(probes.size()));
  for (const PathRecord& r : records) {
    double power = 0;
    for (int k = 0; k < channels; ++k) {
      power += std::norm(r.c[k]);
      const double rate = 2 * M_PI * radar.slope_hz_per_s * r.length_m[k] / kSpeedOfLight_m_per_s;
      for (std::size_t i = 0; i < probes.size(); ++i) {
        direct(k, static_cast<Eigen::Index>(i)) +=
            r.c[k] * std::polar(1.0, rate * (radar.sample_time_s(probes[i]) - radar.window_center_s()));
      }
    }
    const double expected = channels * r.amplitude * r.amplitude;
    if (expected > 0)
      result.worst_amplitude_error = std::max(result.worst_amplitude_error, std::abs(power / expected - 1));
  }
  double difference = 0, norm = 0;
  for (int k = 0; k < channels; ++k) {
    for (std::size_t i = 0; i < probes.size(); ++i) {
      difference += std::norm(x(k, probes[i]) - direct(k, static_cast<Eigen::Index>(i)));
      norm += std::norm(x(k, probes[i]));
    }
  }
  result.grid_error = norm > 0 ? std::sqrt(difference / norm) : std::sqrt(difference);
  return result;
}

void writePathsCsv(const std::vector<PathRecord>& records, const Scene& scene, const std::string& file) {
  std::ofstream out(file);
  out << "length_m,azimuth_dep_deg,elevation_dep_deg,azimuth_arr_deg,elevation_arr_deg,amplitude_db,phase_rad,bounces,"
         "event,actors,materials\n";
  const auto degrees = [](double rad) { return rad * 180 / M_PI; };
  for (const PathRecord& r : records) {
    out << std::fixed << std::setprecision(6) << r.length_m[0] << ',' << std::setprecision(4)
        << degrees(std::atan2(r.departure.y(), r.departure.x())) << ','
        << degrees(std::asin(std::min(1.0, std::max(-1.0, r.departure.z())))) << ','
        << degrees(std::atan2(r.arrival.y(), r.arrival.x())) << ','
        << degrees(std::asin(std::min(1.0, std::max(-1.0, r.arrival.z())))) << ',' << 20 * std::log10(r.amplitude)
        << ',' << std::setprecision(6) << r.phase_rad << ',' << r.bounces << ',' << *r.event << ',';
    for (std::size_t i = 0; i < r.actors.size(); ++i) out << (i ? ";" : "") << scene.actorOf(r.actors[i]).name;
    out << ',';
    for (std::size_t i = 0; i < r.actors.size(); ++i) out << (i ? ";" : "") << scene.actorOf(r.actors[i]).material_tag;
    out << '\n';
  }
  out.close();
  if (!out) throw std::runtime_error(file + ": cannot be written");
}

}  // namespace mmradartwin
