#pragma once

#include <array>
#include <map>
#include <string>
#include <vector>

namespace mmradartwin {

/// The end of an error about a waveform that radar.yaml cannot hold.
constexpr char kOnlyTdm[] =
    "known here are frames of equal chirps, each sent by one transmitter with its phase unshifted (TDM)";

/// A number that a settings file gave, and where.
struct Given {
  double value = 0;
  std::string where;
};

/// What TI's files say, in TI's units, before it is a radar. Two places that say different things are an InputError.
struct RawSettings {
  struct Profile {
    double start_ghz, idle_us, adc_start_us, ramp_end_us, slope_mhz_per_us, ksps;
    int samples, hpf1, hpf2, rx_gain;
    std::array<double, 3> backoff_db;
  };
  struct Chirp {
    int profile;
    unsigned tx_mask;
    std::string where = {}, conflict = {};  ///< conflict: a later place that says otherwise, empty where none does
  };
  std::map<int, Profile> profiles;
  std::map<int, std::string> profile_from;
  std::map<int, Chirp> chirps;
  /// chirp_start, chirp_end, loops, period_ms, rx_mask, adc_bits (2: 16), adc_format (0: real, 1: complex, 2: complex
  /// with the image band), iq_swap, interface (1: LVDS), packet (1: ADC samples only), second_packet (0: none), lanes,
  /// lane_format, interleave (0: interleaved), packet_delay_us.
  std::map<std::string, Given> values;
  std::string device, device_from;
  std::string sdk_from;            ///< a file of the SDK's commands, which say nothing about lanes
  std::string only_last_chirps;    ///< a file that keeps one range of chirps only, those configured last
  std::vector<std::string> notes;  ///< lines for the person who imports

  /// Throws InputError where another place said otherwise.
  void set(const std::string& name, double value, const std::string& where);
  /// Names of the same part, of which one leaves open whether it is an AWR or an IWR (xWR1843), are the same device.
  void setDevice(const std::string& name, const std::string& where);
  void setProfile(int id, const Profile& profile, const std::string& where);
  /// Chirps first to last, both within 0 to 511.
  void setChirps(int first, int last, const Chirp& chirp, const std::string& where);
};

/// `value` as an int; a mask of 32 bits keeps its bits. Throws InputError that begins with `what`.
int wholeNumber(double value, const std::string& what);

/// The four digits in the name of a device, empty where it has none.
std::string partOf(const std::string& device);

/// Adds what a mmWave Studio script configures by its ar1.* calls, run for the device that is set so far.
void readLuaSettings(const std::string& file, const std::string& text, RawSettings& settings);
/// Adds what mmWave Studio's XML says: <configuration>, sections <apiname_profile_cfg> and so on, in them
/// <param name="..." value="..."/> in the units of its windows (GHz, MHz/us, us, ksps, ms). It keeps one profile and
/// one range of chirps: those that were set last. Of the codes in its data path section one set is known; throws
/// InputError for others.
void readXmlSettings(const std::string& file, const std::string& text, RawSettings& settings);
/// Adds what the commands of the mmWave SDK's demos say (profile.cfg: channelCfg, adcCfg, profileCfg, chirpCfg,
/// frameCfg, ...).
void readSdkSettings(const std::string& file, const std::string& text, RawSettings& settings);
/// Whether a text is one of these commands by line.
bool looksLikeSdkSettings(const std::string& text);

}  // namespace mmradartwin
