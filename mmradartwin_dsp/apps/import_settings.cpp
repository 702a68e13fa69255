// import_settings: settings of mmWave Studio, the mmWave SDK and the DCA1000's command line -> radar.yaml.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "mmradartwin_dsp/device_settings.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::vector<std::string> files;
  std::string output, device;
  CLI::App app(
      "Makes a radar.yaml of mmWave Studio's Lua script, XML or JSON, the SDK's profile.cfg, and the DCA1000's "
      "cf.json.");
  app.add_option(
         "FILE", files,
         "*.lua, *.xml, *.mmwave.json, setup.json, cf.json, profile.cfg, of one configuration; known by their content")
      ->required();
  app.add_option("--output", output, "radar.yaml to write")->required();
  app.add_option("--device", device,
                 "awr2243, xwr1843, ...: where the files do not say, and what a script is told that it runs on");
  return runProgram(app, argc, argv, [&] {
    const ImportedSettings settings = importSettings(files, device);
    if (std::filesystem::exists(output)) throw InputError(output + ": exists already; give a new name");
    std::ofstream out(output, std::ios::binary);
    out << toYaml(settings);
    out.close();
    if (!out) throw InputError(output + ": cannot be written; give a file in a folder that can be written");
    for (const std::string& line : settings.assumed) std::cerr << "note: " << line << "\n";
    std::cerr << output << " written\n";
    return 0;
  });
}
