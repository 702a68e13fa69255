#pragma once

#include <functional>
#include <string>

namespace mmradartwin {

/// A network of the emulated card's own: a network namespace without a name, joined to this host by a pair of virtual
/// Ethernet ports as by a cable. It belongs to this process and goes with it, however that ends. Needs root.
class CardNetwork {
 public:
  struct Options {
    std::string interface = "mmrcard";  ///< this host's end
    std::string host_ip = "192.168.33.30", card_ip = "192.168.33.180";
  };
  /// Throws std::runtime_error that says what to do.
  explicit CardNetwork(const Options& options);
  ~CardNetwork();
  CardNetwork(const CardNetwork&) = delete;
  CardNetwork& operator=(const CardNetwork&) = delete;

  /// Runs `action` in the card's namespace; sockets and threads made there stay in it. Passes its exception on.
  void run(const std::function<void()>& action) const;
  /// Pulls the cable on the card's side, or puts it in.
  void setCable(bool in) const;

 private:
  Options options_;
  int namespace_fd_ = -1;
};

}  // namespace mmradartwin
