// replay_packets: sends recorded packets of a DCA1000 again, as recorded, to a driver on this host.
#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_driver/packet_replay.h"
#include "mmradartwin_dsp/program.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::string input;
  PacketReplayOptions options;
  CLI::App app(
      "Sends the samples' packets of a pcap again, with their losses, order and pace, to a driver that leaves the card "
      "alone: driver_node with _configure_card:=false _host_ip:=127.0.0.1 _card_ip:=127.0.0.2");
  app.add_option("PCAP", input, "pcap or pcapng file (tcpdump, Wireshark, or the driver's record_pcap)")->required();
  app.add_option("--host-ip", options.host_ip, "the driver's host_ip")->capture_default_str();
  app.add_option("--card-ip", options.card_ip, "the driver's card_ip, an address of this host")->capture_default_str();
  app.add_option("--data-port", options.data_port, "the driver's data_port")->capture_default_str();
  app.add_option("--source-port", options.source_port, "port that they come from")->capture_default_str();
  app.add_option("--recorded-data-port", options.recorded.data, "UDP port of the samples in the file")
      ->capture_default_str();
  app.add_option("--recorded-card-ip", options.recorded.card_ip,
                 "address in the file of the card whose samples are sent, where there are several");
  app.add_option("--rate", options.rate, "times the recorded pace")
      ->capture_default_str()
      ->check(CLI::Range(1e-3, 1e3));
  app.footer("Example: replay_packets lab.pcap --host-ip 127.0.0.1 --card-ip 127.0.0.2");
  return runProgram(app, argc, argv, [&] {
    std::cout << replayPackets(input, options) << " packets sent\n";
    return 0;
  });
}
