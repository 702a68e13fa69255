// Every reader of a package against its seeds and some hundred changed ones. The same readers run under libFuzzer, for
// as long as one likes: ./run.sh fuzz.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>

#include "../fuzz/hostile_input.h"

namespace mmradartwin {
namespace {

constexpr unsigned kLongest_s = 120;  // on a machine that does other things too; an endless loop is what is meant

char current[128] = "";

void tooLong(int) {
  const ssize_t written = write(STDERR_FILENO, current, std::strlen(current));
  _exit(written > 0 ? 3 : 4);
}

/// Random inputs per reader; MMRADARTWIN_HOSTILE_INPUTS sets more.
int inputs() {
  const char* wanted = std::getenv("MMRADARTWIN_HOSTILE_INPUTS");
  return wanted ? std::atoi(wanted) : 500;
}

class HostileInputs : public testing::TestWithParam<HostileInput> {
 protected:
  static void read(const std::string& bytes, const std::string& which) {
    std::snprintf(current, sizeof current, "reader %s does not come back from %s\n", GetParam().name.c_str(),
                  which.c_str());
    alarm(kLongest_s);
    ASSERT_NO_THROW(GetParam().read(bytes)) << which;
    alarm(0);
  }
};

TEST_P(HostileInputs, AreReadOrRefused) {
  signal(SIGALRM, tooLong);
  const std::vector<std::string>& seeds = GetParam().seeds;
  for (std::size_t i = 0; i < seeds.size(); ++i) read(seeds[i], "seed input " + std::to_string(i));
  for (int i = 0; i < inputs() && !HasFailure(); ++i) {
    std::mt19937_64 random(static_cast<std::uint64_t>(i));
    read(mutated(seeds, random), "changed input " + std::to_string(i));
  }
}

INSTANTIATE_TEST_SUITE_P(Readers, HostileInputs, testing::ValuesIn(hostileInputs()),
                         [](const auto& info) { return info.param.name; });

}  // namespace
}  // namespace mmradartwin
