// Command and data sockets against a card that this test plays itself.
#include "mmradartwin_driver/dca1000_control.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <functional>
#include <thread>

#include "emulated_rig.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_driver/rig_error.h"
#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

using std::chrono::milliseconds;

sockaddr_in address(const std::string& ip, std::uint16_t port) {
  sockaddr_in a{};
  a.sin_family = AF_INET;
  a.sin_port = htons(port);
  a.sin_addr = parseIpv4(ip);
  return a;
}

std::vector<std::uint8_t> reply(std::uint8_t code, std::uint16_t status) {
  return {0x5a, 0xa5, code, 0, static_cast<std::uint8_t>(status), static_cast<std::uint8_t>(status >> 8), 0xaa, 0xee};
}

/// Answers each of `requests` datagrams with the datagrams that `script` gives for it, from port 1024.
class ScriptedCard {
 public:
  using Script = std::function<std::vector<std::vector<std::uint8_t>>(int request, std::uint8_t code)>;
  ScriptedCard(const std::string& ip, int requests, Script script)
      : commands_(ip, kDca1000ConfigPort, "test"), out_(ip, 1024, "test"), thread_([this, requests, script] {
          for (int i = 0; i < requests && commands_.waitReadable(3000); ++i) {
            std::uint8_t bytes[64];
            sockaddr_in from{};
            socklen_t size = sizeof from;
            recvfrom(commands_.fd(), bytes, sizeof bytes, 0, reinterpret_cast<sockaddr*>(&from), &size);
            for (const auto& answer : script(i, bytes[2])) {
              sendto(out_.fd(), answer.data(), answer.size(), 0, reinterpret_cast<sockaddr*>(&from), size);
            }
          }
        }) {}
  ~ScriptedCard() { thread_.join(); }

 private:
  UdpSocket commands_, out_;
  std::thread thread_;
};

Dca1000Control::Options quick() {
  Dca1000Control::Options options;
  options.reply_timeout = milliseconds(100);
  return options;
}

TEST(Dca1000Control, StatusBetweenCommandAndReplyIsKept) {
  const std::string host = loopbackIp(1), ip = loopbackIp(2);
  ScriptedCard card(ip, 2, [](int, std::uint8_t code) -> std::vector<std::vector<std::uint8_t>> {
    if (code == 0x09)
      return {reply(0x0a, kNoLvdsData), {1, 2, 3}, reply(0x0e, 0x0402), reply(0x0a, kDdrFull), reply(0x09, 0)};
    return {reply(code, 0)};
  });
  Dca1000Control control(host, ip, kDca1000ConfigPort, quick());
  control.connect();
  control.startRecord();
  EXPECT_EQ(kNoLvdsData, control.takeStatus(milliseconds(0)));
  EXPECT_EQ(kDdrFull, control.takeStatus(milliseconds(0)));
  EXPECT_FALSE(control.takeStatus(milliseconds(20)));
}

TEST(Dca1000Control, KeepsTheNewestStatusesOfMany) {
  const std::string host = loopbackIp(1), ip = loopbackIp(2);
  ScriptedCard card(ip, 2, [](int request, std::uint8_t code) -> std::vector<std::vector<std::uint8_t>> {
    std::vector<std::vector<std::uint8_t>> answers;
    if (request == 0) {
      for (std::uint16_t i = 0; i < 100; ++i) answers.push_back(reply(0x0a, i));
    } else {
      answers.push_back(reply(0x0a, kDdrFull));
    }
    answers.push_back(reply(code, 0));
    return answers;
  });
  Dca1000Control control(host, ip, kDca1000ConfigPort, quick());
  control.connect();
  EXPECT_EQ(36, control.takeStatus(milliseconds(0)));
  for (int left = 63; left > 0; --left) EXPECT_TRUE(control.takeStatus(milliseconds(0)));
  EXPECT_FALSE(control.takeStatus(milliseconds(0)));
  control.connect();
  control.forgetStatuses();
  EXPECT_FALSE(control.takeStatus(milliseconds(0)));
}

TEST(Dca1000Control, AsksAgainWhenAReplyIsLost) {
  const std::string host = loopbackIp(1), ip = loopbackIp(2);
  ScriptedCard card(ip, 3, [](int request, std::uint8_t code) -> std::vector<std::vector<std::uint8_t>> {
    if (request < 2) return {};
    return {reply(code, 0)};
  });
  Dca1000Control control(host, ip, kDca1000ConfigPort, quick());
  EXPECT_NO_THROW(control.resetFpga());
}

TEST(Dca1000Control, SaysWhenTheCardRefusesOrIsSilent) {
  const std::string host = loopbackIp(1), ip = loopbackIp(2);
  {
    ScriptedCard card(
        ip, 1, [](int, std::uint8_t code) -> std::vector<std::vector<std::uint8_t>> { return {reply(code, 1)}; });
    Dca1000Control control(host, ip, kDca1000ConfigPort, quick());
    try {
      control.configurePackets(25);
      FAIL() << "a refusal passed as success";
    } catch (const RigError& error) {
      EXPECT_NE(std::string::npos, std::string(error.what()).find("refuses CONFIG_PACKET_DATA")) << error.what();
    }
  }
  Dca1000Control control(host, ip, kDca1000ConfigPort, quick());
  EXPECT_FALSE(control.answers());
  try {
    control.connect();
    FAIL() << "nobody there, and no error";
  } catch (const RigError& error) {
    EXPECT_NE(std::string::npos, std::string(error.what()).find("no answer from the DCA1000 at " + ip)) << error.what();
  }
}

TEST(Sockets, ErrorsSayWhatToDo) {
  const auto message = [](const std::function<void()>& act) -> std::string {
    try {
      act();
    } catch (const RigError& error) {
      return error.what();
    }
    return "no error";
  };
  // 203.0.113.0/24 is set aside for documentation: no host has it.
  EXPECT_NE(std::string::npos,
            message([] { PacketReceiver("203.0.113.7", 4098, "203.0.113.8"); }).find("no address 203.0.113.7"));
  const UdpSocket taken(loopbackIp(1), 4098, "test");
  EXPECT_NE(std::string::npos, message([] { PacketReceiver(loopbackIp(1), 4098, loopbackIp(2)); }).find("is in use"));
  EXPECT_THROW(parseIpv4("192.168.33"), InputError);
  EXPECT_THROW(parseIpv4("card"), InputError);
}

TEST(PacketReceiver, CountsWhatTheKernelDropsAndWhatIsForeign) {
  const std::string host = loopbackIp(1), card = loopbackIp(2);
  PacketReceiver::Options options;
  options.buffer_bytes = 64 << 10;
  PacketReceiver receiver(host, kDca1000DataPort, card, options);
  const UdpSocket sender(card, 1024, "test"), stranger(loopbackIp(3), 1024, "test");
  const sockaddr_in to = address(host, kDca1000DataPort);
  std::vector<std::uint8_t> datagram(1466, 7);
  const auto send = [&](const UdpSocket& from, std::size_t size) {
    sendto(from.fd(), datagram.data(), size, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  };
  send(stranger, 1466);
  send(sender, 10);
  for (int i = 0; i < 500; ++i) send(sender, 1466);
  int visited = 0;
  const auto now_ns = [] {
    return static_cast<double>(std::chrono::system_clock::now().time_since_epoch() / std::chrono::nanoseconds(1));
  };
  const auto visit = [&](const DataPacket& packet) {
    ++visited;
    EXPECT_EQ(1456u, packet.size);
    // No order: the kernel turns its stamping on some milliseconds after the option is set, and stamps what came before
    // when that is read.
    EXPECT_NEAR(now_ns(), static_cast<double>(packet.stamp_ns), 60e9);
  };
  while (receiver.receive(50, visit)) {
  }
  EXPECT_LT(visited, 500);
  send(sender, 1466);  // the count of drops comes with the next datagram
  receiver.receive(500, visit);
  EXPECT_EQ(501u, static_cast<unsigned>(visited) + receiver.counters().kernel_drops);
  EXPECT_EQ(1u, receiver.counters().foreign);
  EXPECT_EQ(1u, receiver.counters().malformed);
  EXPECT_EQ(static_cast<std::uint64_t>(visited), receiver.counters().packets);

  for (int i = 0; i < 20; ++i) send(sender, 1466);
  receiver.drain();
  EXPECT_EQ(0, receiver.receive(20, visit));
}

}  // namespace
}  // namespace mmradartwin
