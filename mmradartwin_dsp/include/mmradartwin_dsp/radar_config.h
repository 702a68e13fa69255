#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

constexpr double kSpeedOfLight_m_per_s = 299792458.0;
/// No memory is taken for larger frames, whatever a file or a message asks for, unless max_frame_mb says so. MiB.
constexpr double kMaxFrame_mb = 64;

enum class CaptureLayout {
  kFourLane,  ///< AWR2243, xWR1243/1443: per sample I rx0..rx3, then Q rx0..rx3
  kTwoLane    ///< xWR16xx/18xx/68xx: per chirp RX-major, groups I[n] I[n+1] Q[n] Q[n+1]
};
enum class IqOrder { kIq, kQi };

/// Layout in which a device of this name sends its samples (awr2243, xWR1443, iwr6843, ...): by SWRA581B and SWRA555A
/// xWR12xx, 14xx and 22xx have four lanes, xWR16xx, 18xx, 64xx and 68xx two. Empty for any other name.
std::optional<CaptureLayout> captureLayoutOf(const std::string& device);

/// The uniform line along y that the angle transform needs.
struct VirtualLine {
  std::vector<int> channels;  ///< virtual elements k of the line, from right (-y) to left (+y)
  std::vector<int> places;    ///< of each on the line, in pitches; those of receivers that were left out are missing
  double pitch_m = 0;
};

/// The radar: what radar.yaml says. SI units; positions in radar_link (x boresight, y left, z up).
struct RadarConfig {
  std::string device;
  double carrier_hz = 0;  ///< at the start of the ramp
  double slope_hz_per_s = 0;
  int samples_per_chirp = 0;  ///< N
  double sample_rate_hz = 0;
  double adc_start_s = 0;  ///< from the start of the ramp to sample 0
  int loops_per_frame = 0;
  double frame_period_s = 0;
  std::vector<Eigen::Vector3d> tx_position_m;  ///< one per TDM slot
  std::vector<Eigen::Vector3d> rx_position_m;
  CaptureLayout layout = CaptureLayout::kFourLane;
  IqOrder iq_order = IqOrder::kIq;
  /// Captures hold real samples. Samples and rate above are then those of the complex signal that they are read as:
  /// half of what radar.yaml says, over the same time, which gives the same range bins and half of the range.
  bool real_samples = false;
  // Optional: NaN or empty where radar.yaml does not say.
  double idle_s, ramp_end_s, rx_gain_db, tx_backoff_db;
  std::vector<double> if_highpass_hz;
  std::vector<std::vector<int>> tx_enable;  ///< device's TX numbers, one list per slot
  std::vector<int> rx_enable;
  double max_frame_mb = kMaxFrame_mb;  ///< a radar whose frames are larger is refused, MiB; 64 without it
  std::vector<int> angle_slots;        ///< slots that the angle transform takes; empty: all
  /// Receivers of the whole line where some were left out of rx_position_m because they deliver nothing; else empty.
  std::vector<Eigen::Vector3d> whole_line_rx_m;

  RadarConfig();

  int slots() const { return static_cast<int>(tx_position_m.size()); }
  int receivers() const { return static_cast<int>(rx_position_m.size()); }
  int channels() const { return slots() * receivers(); }  ///< M
  int chirps_per_frame() const { return loops_per_frame * slots(); }
  /// Position sum tx+rx of virtual element k = receivers*slot + rx, metres.
  Eigen::Vector3d virtual_element_m(int k) const;
  /// Receivers that a capture has room for: four lanes always carry four, those not in use as zeros (SWRA581B).
  int capture_receivers() const;
  double chirp_period_s() const;        ///< from ramp to ramp: idle_s + ramp_end_s; NaN where radar.yaml does not say
  std::size_t bytes_per_chirp() const;  ///< in a capture: samples x capture_receivers x 4
  std::size_t bytes_per_frame() const;  ///< in a capture: chirps x bytes_per_chirp
  double frame_mb() const;              ///< bytes_per_frame(), in MiB
  /// Start of frame i after that of frame 0, rounded once, so that it does not drift.
  std::int64_t frame_offset_ns(std::int64_t i) const;
  double bandwidth_hz() const;         ///< B = slope N / f_s
  double range_bin_m() const;          ///< c / (2B)
  double max_range_m() const;          ///< N c / (2B)
  double sample_time_s(int n) const;   ///< t_n = adc_start + n/f_s, from the ramp's start
  double window_center_s() const;      ///< t_c = adc_start + N/(2 f_s)
  double center_frequency_hz() const;  ///< carrier + slope t_c
  double wavelength_m() const;         ///< lambda_c, at the centre of the ADC window
  /// The elements of the angle transform, which must be a uniform line along y, in any order of slots and receivers.
  /// Throws InputError otherwise; it names the slot or the element that is off the line.
  VirtualLine virtualLine() const;
  /// Pitch d of virtualLine(). Throws InputError as that does.
  double virtual_pitch_m() const { return virtualLine().pitch_m; }
  /// Slots whose elements make the longest uniform line along y; empty where none do.
  std::vector<int> slotsOnALine() const;
};

/// Reads radar.yaml strictly. Where it does not name a layout, the device's is taken, four lanes for a device that is
/// not known. Throws InputError.
RadarConfig loadRadarConfig(const std::string& file);
RadarConfig parseRadarConfig(const std::string& yaml_text, const std::string& name);
/// The text of a radar.yaml that reads back as `radar`.
std::string toYaml(const RadarConfig& radar);

}  // namespace mmradartwin
