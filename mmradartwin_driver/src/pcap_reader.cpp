#include "mmradartwin_driver/pcap_reader.h"

#include <arpa/inet.h>
#include <pcap/pcap.h>

#include <memory>
#include <optional>
#include <vector>

#include "mmradartwin_driver/udp_socket.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/input_file.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

std::uint16_t networkOrder16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] << 8 | p[1]); }

std::uint32_t networkOrder32(const std::uint8_t* p) {
  return static_cast<std::uint32_t>(networkOrder16(p)) << 16 | networkOrder16(p + 2);
}

struct CapturedDatagram {
  std::uint32_t source, destination;  ///< IPv4 addresses
  std::uint16_t destination_port;
  const std::uint8_t* payload;
  std::size_t size;  ///< as captured: less than was sent where the capture truncated packets
};

constexpr std::int64_t kLatest_s = 4294967295;  // limit of a ROS time; a pcapng may hold later times

/// Bytes of link layer before the IPv4 header, or -1.
int linkHeaderBytes(int link_type, const std::uint8_t* p, std::size_t size) {
  constexpr std::uint16_t kIpv4 = 0x0800, kVlan = 0x8100;
  switch (link_type) {
    case DLT_EN10MB: {
      std::size_t at = 12;
      if (size < at + 2) return -1;
      if (networkOrder16(p + at) == kVlan) at += 4;
      return size >= at + 2 && networkOrder16(p + at) == kIpv4 ? static_cast<int>(at + 2) : -1;
    }
    case DLT_LINUX_SLL:
      return size >= 16 && networkOrder16(p + 14) == kIpv4 ? 16 : -1;
    case DLT_LINUX_SLL2:
      return size >= 20 && networkOrder16(p) == kIpv4 ? 20 : -1;
    case DLT_NULL:
      return size >= 4 ? 4 : -1;
    case DLT_RAW:
      return 0;
    default:
      return -1;
  }
}

bool decodeUdp(int link_type, const std::uint8_t* p, std::size_t size, CapturedDatagram& out) {
  const int link = linkHeaderBytes(link_type, p, size);
  if (link < 0) return false;
  p += link;
  size -= link;
  constexpr std::uint8_t kUdp = 17;
  if (size < 20 || p[0] >> 4 != 4 || p[9] != kUdp) return false;
  if (networkOrder16(p + 6) & 0x3fff) return false;  // a fragment
  const std::size_t ip_header = (p[0] & 15) * 4u;
  if (ip_header < 20 || size < ip_header + 8) return false;
  out.source = networkOrder32(p + 12);
  out.destination = networkOrder32(p + 16);
  p += ip_header;
  size -= ip_header;
  const std::size_t udp_bytes = networkOrder16(p + 4);
  if (udp_bytes < 8) return false;
  // Short frames are padded to Ethernet's minimum: the UDP length decides, not the frame's.
  out.destination_port = networkOrder16(p + 2);
  out.payload = p + 8;
  out.size = std::min(size, udp_bytes) - 8;
  return true;
}

std::string addressText(std::uint32_t address) {
  std::vector<std::string> bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(std::to_string(address >> shift & 0xff));
  return join(bytes, ".");
}

/// Hands a capture's datagrams to a visitor, those of one card.
class CardTraffic {
 public:
  CardTraffic(const PcapVisitor& visitor, const PcapSource& source) : visitor_(visitor), source_(source) {
    if (!source.card_ip.empty()) card_ = ntohl(parseIpv4(source.card_ip).s_addr);
  }

  void take(const CapturedDatagram& datagram, std::int64_t stamp_ns) {
    if (datagram.destination_port == source_.data && takeData(datagram, stamp_ns)) return;
    if (datagram.destination_port == source_.config && takeReply(datagram, stamp_ns)) return;
    ++counters.other;
  }
  PcapCounters finish() {
    for (const auto& [address, packets] : data_of_card_) counters.data_of_card[addressText(address)] = packets;
    return counters;
  }

  PcapCounters counters;

 private:
  bool takeData(const CapturedDatagram& datagram, std::int64_t stamp_ns) {
    const auto packet = decodeDataPacket(datagram.payload, datagram.size, stamp_ns);
    if (!packet) return false;
    ++data_of_card_[datagram.source];
    if (!card_) card_ = datagram.source;
    if (datagram.source != *card_) return false;
    ++counters.data;
    if (visitor_.data) visitor_.data(*packet);
    return true;
  }
  /// Before the first samples, replies of any card: it may be theirs. A command to the card looks like its reply.
  bool takeReply(const CapturedDatagram& datagram, std::int64_t stamp_ns) {
    if (card_ && datagram.source != *card_ && datagram.destination != *card_) return false;
    const auto reply = decodeReply(datagram.payload, datagram.size);
    if (!reply) return false;
    ++counters.replies;
    if (visitor_.reply) visitor_.reply(*reply, stamp_ns);
    return true;
  }

  const PcapVisitor& visitor_;
  const PcapSource& source_;
  std::optional<std::uint32_t> card_;
  std::map<std::uint32_t, std::uint64_t> data_of_card_;
};

}  // namespace

PcapCounters readPcap(const std::string& file, const PcapVisitor& visitor, const PcapSource& source) {
  requireRegularFile(file);
  CardTraffic traffic(visitor, source);
  char error[PCAP_ERRBUF_SIZE] = "";
  const std::unique_ptr<pcap_t, decltype(&pcap_close)> capture(
      pcap_open_offline_with_tstamp_precision(file.c_str(), PCAP_TSTAMP_PRECISION_NANO, error), pcap_close);
  if (!capture) throw InputError(file + ": cannot be read as a packet capture: " + error);
  const int link_type = pcap_datalink(capture.get());
  PcapCounters& counters = traffic.counters;
  pcap_pkthdr* header = nullptr;
  const std::uint8_t* bytes = nullptr;
  int state;
  while ((state = pcap_next_ex(capture.get(), &header, &bytes)) == 1) {
    ++counters.frames;
    if (header->ts.tv_sec < 0 || header->ts.tv_sec > kLatest_s) {
      throw InputError(file + ": damaged: packet " + std::to_string(counters.frames) + " has no time that can be");
    }
    const std::int64_t stamp_ns = header->ts.tv_sec * 1'000'000'000LL + header->ts.tv_usec;  // ns by the precision
    CapturedDatagram datagram{};
    if (decodeUdp(link_type, bytes, header->caplen, datagram)) {
      traffic.take(datagram, stamp_ns);
    } else {
      ++counters.other;
    }
  }
  if (state == PCAP_ERROR) {
    throw InputError(file + ": damaged after packet " + std::to_string(counters.frames) + ": " +
                     pcap_geterr(capture.get()));
  }
  return traffic.finish();
}

void demandOneCard(const std::string& file, const PcapCounters& counters, const PcapSource& source,
                   const std::string& option) {
  std::vector<std::string> cards;
  for (const auto& [address, packets] : counters.data_of_card) {
    cards.push_back(address + " (" + std::to_string(packets) + " packets)");
  }
  if (cards.empty()) {
    throw InputError(file + ": holds no packet of samples to UDP port " + std::to_string(source.data) + " among its " +
                     std::to_string(counters.frames) + "; give the port that the card sent them to");
  }
  if (counters.data == 0) {
    throw InputError(file + ": holds no packet of samples from " + source.card_ip + ", but from " + join(cards, ", ") +
                     "; give " + option + " one of these");
  }
  if (cards.size() > 1 && source.card_ip.empty()) {
    throw InputError(file + ": holds samples of " + std::to_string(cards.size()) + " cards: " + join(cards, ", ") +
                     "; say whose are wanted with " + option);
  }
}

}  // namespace mmradartwin
