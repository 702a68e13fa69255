#pragma once

#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "mmradartwin_driver/datagram.h"
#include "mmradartwin_driver/dca1000_protocol.h"
#include "mmradartwin_driver/udp_socket.h"

namespace mmradartwin {

/// Command port of the card. Replies are matched by command code. Status datagrams that arrive between them are kept
/// for takeStatus(), the newest 64. One thread at a time.
class Dca1000Control {
 public:
  struct Options {
    std::chrono::milliseconds reply_timeout{300};
    int attempts = 3;
    std::chrono::milliseconds deaf_limit{5000};  ///< after CONFIG_FPGA_GEN the card does not answer for a while
  };

  /// Binds host_ip:port, talks to card_ip:port. Throws RigError, InputError.
  Dca1000Control(const std::string& host_ip, const std::string& card_ip, std::uint16_t port);
  Dca1000Control(const std::string& host_ip, const std::string& card_ip, std::uint16_t port, const Options& options);

  // Each command throws RigError where the card does not answer after all attempts, or answers that it failed.
  void connect();  ///< SYSTEM_CONNECT: checks that the card answers
  bool answers();  ///< connect() once, without an exception
  void resetFpga();
  void resetRadar();
  FpgaVersion readVersion();
  /// Sets lanes and format, then waits until the card answers again.
  void configureFpga(int lanes);
  void configurePackets(double delay_us, std::uint16_t packet_bytes = 1470);
  void startRecord();
  void stopRecord();

  /// `tap` receives every later command and every datagram that the card answers with.
  void setTap(DatagramTap tap) { tap_ = std::move(tap); }

  /// Next status datagram; waits for one up to the given time.
  std::optional<std::uint16_t> takeStatus(std::chrono::milliseconds wait);
  /// Those of an earlier recording.
  void forgetStatuses();

 private:
  Dca1000Reply command(Dca1000Command command, const std::vector<std::uint8_t>& body, int attempts);
  void done(Dca1000Command command, const std::vector<std::uint8_t>& body = {});
  void send(Dca1000Command command, const std::vector<std::uint8_t>& body);
  void keep(std::uint16_t status);
  /// Next datagram of the card until `deadline`; foreign and malformed ones are skipped.
  std::optional<Dca1000Reply> receive(std::chrono::steady_clock::time_point deadline);

  Options options_;
  std::string card_ip_;
  sockaddr_in card_{}, local_{};
  DatagramTap tap_;
  UdpSocket socket_;
  std::deque<std::uint16_t> statuses_;
};

}  // namespace mmradartwin
