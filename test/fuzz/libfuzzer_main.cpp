// libFuzzer's entry: reader FUZZ_INPUT (environment) of the package that this is linked with. With -inputs it prints
// their names instead, with -seeds=FOLDER it writes that reader's seeds there.
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "hostile_input.h"

namespace {

const mmradartwin::HostileInput* chosen = nullptr;

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  static const std::vector<mmradartwin::HostileInput> inputs = mmradartwin::hostileInputs();
  const char* name = std::getenv("FUZZ_INPUT");
  for (const mmradartwin::HostileInput& input : inputs) {
    if (name && input.name == name) chosen = &input;
  }
  for (int i = 1; i < *argc; ++i) {
    const std::string argument = (*argv)[i];
    if (argument == "-inputs") {
      for (const mmradartwin::HostileInput& input : inputs) std::printf("%s\n", input.name.c_str());
      std::exit(0);
    }
    if (chosen && argument.compare(0, 7, "-seeds=") == 0) {
      for (std::size_t seed = 0; seed < chosen->seeds.size(); ++seed) {
        mmradartwin::writeInput(argument.substr(7) + "/seed_" + std::to_string(seed), chosen->seeds[seed]);
      }
      std::exit(0);
    }
  }
  if (!chosen) {
    std::fprintf(stderr, "set FUZZ_INPUT to one of the names that -inputs prints\n");
    std::exit(2);
  }
  return 0;
}

/// Assimp leaks some bytes of files that it refuses; what is ours is looked at all the same.
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp.so\n"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  chosen->read(std::string(reinterpret_cast<const char*>(data), size));
  return 0;
}
