#include "mmradartwin_driver/pcap_reader.h"

#include <pcap/pcap.h>

#include <memory>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

std::uint16_t networkOrder16(const std::uint8_t* p) { return static_cast<std::uint16_t>(p[0] << 8 | p[1]); }

struct Datagram {
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

bool decodeUdp(int link_type, const std::uint8_t* p, std::size_t size, Datagram& out) {
  const int link = linkHeaderBytes(link_type, p, size);
  if (link < 0) return false;
  p += link;
  size -= link;
  constexpr std::uint8_t kUdp = 17;
  if (size < 20 || p[0] >> 4 != 4 || p[9] != kUdp) return false;
  if (networkOrder16(p + 6) & 0x3fff) return false;  // a fragment
  const std::size_t ip_header = (p[0] & 15) * 4u;
  if (ip_header < 20 || size < ip_header + 8) return false;
  p += ip_header;
  size -= ip_header;
  const std::size_t udp_bytes = networkOrder16(p + 4);
  if (udp_bytes < 8) return false;
  // Short frames are padded to Ethernet's minimum: the UDP length decides, not the frame's.
  out = {networkOrder16(p + 2), p + 8, std::min(size, udp_bytes) - 8};
  return true;
}

}  // namespace

PcapCounters readPcap(const std::string& file, const PcapVisitor& visitor, const PcapPorts& ports) {
  char error[PCAP_ERRBUF_SIZE] = "";
  const std::unique_ptr<pcap_t, decltype(&pcap_close)> capture(
      pcap_open_offline_with_tstamp_precision(file.c_str(), PCAP_TSTAMP_PRECISION_NANO, error), pcap_close);
  if (!capture) throw InputError(file + ": cannot be read as a packet capture: " + error);
  const int link_type = pcap_datalink(capture.get());
  PcapCounters counters;
  pcap_pkthdr* header = nullptr;
  const std::uint8_t* bytes = nullptr;
  int state;
  while ((state = pcap_next_ex(capture.get(), &header, &bytes)) == 1) {
    ++counters.frames;
    if (header->ts.tv_sec < 0 || header->ts.tv_sec > kLatest_s) {
      throw InputError(file + ": damaged: packet " + std::to_string(counters.frames) + " has no time that can be");
    }
    const std::int64_t stamp_ns = header->ts.tv_sec * 1'000'000'000LL + header->ts.tv_usec;  // ns by the precision
    Datagram datagram;
    if (!decodeUdp(link_type, bytes, header->caplen, datagram)) {
      ++counters.other;
      continue;
    }
    if (datagram.destination_port == ports.data) {
      if (const auto packet = decodeDataPacket(datagram.payload, datagram.size, stamp_ns)) {
        ++counters.data;
        if (visitor.data) visitor.data(*packet);
        continue;
      }
    } else if (datagram.destination_port == ports.config) {
      if (const auto reply = decodeReply(datagram.payload, datagram.size)) {
        ++counters.replies;
        if (visitor.reply) visitor.reply(*reply, stamp_ns);
        continue;
      }
    }
    ++counters.other;
  }
  if (state == PCAP_ERROR) {
    throw InputError(file + ": damaged after packet " + std::to_string(counters.frames) + ": " +
                     pcap_geterr(capture.get()));
  }
  return counters;
}

}  // namespace mmradartwin
