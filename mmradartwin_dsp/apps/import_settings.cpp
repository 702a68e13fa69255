// import_settings: settings of mmWave Studio, the mmWave SDK and the DCA1000's command line -> radar.yaml.
#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>

#include "mmradartwin_dsp/device_settings.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::vector<std::string> files;
  OutputArguments output;
  std::string device;
  CLI::App app(
      "Makes a radar.yaml of mmWave Studio's Lua script, XML or JSON, the SDK's profile.cfg, and the DCA1000's "
      "cf.json.");
  app.add_option(
         "FILE", files,
         "*.lua, *.xml, *.mmwave.json, setup.json, cf.json, profile.cfg, of one configuration; known by their content")
      ->required();
  addOutputArguments(app, output, "radar.yaml to write");
  app.add_option("--device", device,
                 "awr2243, xwr1843, ...: where the files do not say, and what a script is told that it runs on");
  app.footer("Example: import_settings lab.mmwave.json setup.json --output radar.yaml");
  return runProgram(app, argc, argv, [&] {
    Output file = Output::file(output, files);
    const ImportedSettings settings = importSettings(files, device);
    std::ofstream out(file.path(), std::ios::binary);
    out << toYaml(settings);
    out.close();
    if (!out) throw InputError(file.path() + ": cannot be written; check the free space");
    file.complete();
    for (const std::string& line : settings.assumed) note(line);
    std::cout << file.name() << " written\n";
    return 0;
  });
}
