#include "mmradartwin_driver/radar_devices.h"

#include <map>
#include <mutex>

#include "built_in_devices.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

struct Registry {
  std::mutex mutex;
  std::map<std::string, RadarDevice> devices;
  Registry() {
    for (const RadarDevice& device : builtInDevices()) devices.emplace(device.name, device);
  }
};

Registry& registry() {
  static Registry all;
  return all;
}

}  // namespace

void registerRadarDevice(const RadarDevice& device) {
  Registry& known = registry();
  const std::lock_guard<std::mutex> lock(known.mutex);
  if (!known.devices.emplace(device.name, device).second) {
    throw InputError("radar device '" + device.name + "' is registered already");
  }
}

RadarDevice radarDevice(const RadarConfig& radar, const std::string& file) {
  Registry& known = registry();
  const std::lock_guard<std::mutex> lock(known.mutex);
  const auto found = known.devices.find(radar.device);
  if (found != known.devices.end()) return found->second;
  std::string names;
  for (const auto& [name, device] : known.devices) names += (names.empty() ? "" : ", ") + name;
  throw InputError(file + ": key device: '" + radar.device + "' cannot be configured here; known devices: " + names);
}

}  // namespace mmradartwin
