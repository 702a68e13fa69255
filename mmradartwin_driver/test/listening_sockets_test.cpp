#include "mmradartwin_driver/listening_sockets.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "emulated_rig.h"

namespace mmradartwin {
namespace {

constexpr const char* kColumns = "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt uid\n";

/// A line of /proc/net/tcp.
std::string row(const std::string& local, const std::string& state, int inode) {
  return "   0: " + local + " 00000000:0000 " + state + " 00000000:00000000 00:00000000 00000000  1000        0 " +
         std::to_string(inode) + " 1 0000000000000000 100 0 0 10 0\n";
}

void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

TEST(ListeningSockets, ThoseOfRosProcessesThatOthersReachAreNamed) {
  const TestFolder folder;
  const std::filesystem::path proc = folder.file("proc");
  write(proc / "net/tcp", kColumns + row("00000000:9F4D", "0A", 11) +  // 0.0.0.0:40781
                              row("0100007F:8943", "0A", 12) + row("00000000:0016", "0A", 13) +
                              row("0100A8C0:1F90", "01", 14));  // a connection
  write(proc / "net/tcp6", kColumns + row("00000000000000000000000000000000:2B67", "0A", 15) +
                               row("00000000000000000000000001000000:2B68", "0A", 16) +
                               row("0000000000000000FFFF00000100007F:2B69", "0A", 17));
  write(proc / "net/udp", kColumns + row("1E21A8C0:1002", "07", 18));  // 192.168.33.30:4098
  using namespace std::string_literals;
  write(proc / "100/cmdline", "/lib/driver_node\0__name:=driver\0__log:=x\0"s);
  write(proc / "101/cmdline", "/usr/sbin/sshd\0-D\0"s);
  write(proc / "102/cmdline", "/usr/bin/python3\0/usr/bin/rosmaster\0--core\0"s);
  for (const auto& [process, inodes] : std::vector<std::pair<std::string, std::vector<int>>>{
           {"100", {11, 12, 14, 16, 17, 18}}, {"101", {13}}, {"102", {15}}}) {
    std::filesystem::create_directories(proc / process / "fd");
    for (const int inode : inodes) {
      std::filesystem::create_symlink("socket:[" + std::to_string(inode) + "]",
                                      proc / process / "fd" / std::to_string(inode));
    }
  }
  EXPECT_EQ(openRosSockets(proc.string()),
            (std::vector<std::string>{"driver 0.0.0.0:40781/tcp", "driver 192.168.33.30:4098/udp",
                                      "rosmaster [::]:11111/tcp"}));
  EXPECT_TRUE(openRosSockets(folder.file("nowhere")).empty());
}

}  // namespace
}  // namespace mmradartwin
