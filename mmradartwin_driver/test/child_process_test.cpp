#include "../emulator/child_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <vector>

namespace mmradartwin {
namespace {

TEST(ChildProcess, InheritsNoFileOfItsCaller) {
  const int open_here = open("/dev/null", O_RDONLY);  // as roscpp's sockets: not closed by exec
  ASSERT_GT(open_here, 2);
  ASSERT_GE(dup2(open_here, 77), 0);
  ChildProcess child("/bin/ls", {"-1", "/proc/self/fd"});
  std::vector<std::string> files;
  while (const auto line = child.readLine(500)) files.push_back(*line);
  EXPECT_EQ(files, (std::vector<std::string>{"0", "1", "2", "3"}));  // the last is that of the folder
  close(77);
  close(open_here);
}

}  // namespace
}  // namespace mmradartwin
