#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>

namespace mmradartwin {

/// A number that a settings file gave, and where.
struct Given {
  double value = 0;
  std::string where;
};

/// What TI's files say, in TI's units, before it is a radar. Two files that say different things are an InputError.
struct RawSettings {
  struct Profile {
    double start_ghz, idle_us, adc_start_us, ramp_end_us, slope_mhz_per_us, ksps;
    int samples, hpf1, hpf2, rx_gain;
    std::array<double, 3> backoff_db;
  };
  struct Chirp {
    int profile;
    unsigned tx_mask;
  };
  std::map<int, Profile> profiles;
  std::map<int, Chirp> chirps;
  /// chirp_start, chirp_end, loops, period_ms, rx_mask, adc_bits (2: 16), adc_format (1, 2: complex), iq_swap,
  /// interface (1: LVDS), packet (1: ADC samples only), lanes, lane_format, interleave (0: interleaved),
  /// packet_delay_us.
  std::map<std::string, Given> values;
  std::string device, device_from;
  std::string profile_from;
  std::string only_last_chirps;  ///< a file that keeps one range of chirps only, those configured last

  /// Throws InputError where another file said otherwise.
  void set(const std::string& name, double value, const std::string& where);
  void setDevice(const std::string& name, const std::string& where);
  void setProfile(int id, const Profile& profile, const std::string& where);
  /// Chirps first to last, both within 0 to 511. What is configured later holds, as in the device.
  void setChirps(int first, int last, const Chirp& chirp, const std::string& where);
};

/// `value` as an int; a mask of 32 bits keeps its bits. Throws InputError that begins with `what`.
int wholeNumber(double value, const std::string& what);

/// Adds what the ar1.* calls of a mmWave Studio script say.
void readLuaSettings(const std::string& file, RawSettings& settings);
/// Adds what mmWave Studio's XML says: <configuration>, sections <apiname_profile_cfg> and so on, in them
/// <param name="..." value="..."/> in the units of its windows (GHz, MHz/us, us, ksps, ms). It keeps one profile and
/// one range of chirps: those that were set last. Of the codes in its data path section one set is known; throws
/// InputError for others.
void readXmlSettings(const std::string& file, RawSettings& settings);

}  // namespace mmradartwin
