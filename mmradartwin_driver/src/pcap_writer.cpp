#include "mmradartwin_driver/pcap_writer.h"

#include <pcap/pcap.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <filesystem>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kHeaderBytes = 14 + 20 + 8;  // Ethernet, IPv4, UDP
constexpr int kSnapLength = 65535;

void put16(std::uint8_t* p, std::size_t value) {
  p[0] = static_cast<std::uint8_t>(value >> 8);
  p[1] = static_cast<std::uint8_t>(value);
}

/// RFC 1071 over the 20 bytes of an IPv4 header whose checksum field is zero.
std::uint16_t headerChecksum(const std::uint8_t* p) {
  std::uint32_t sum = 0;
  for (int i = 0; i < 20; i += 2) sum += static_cast<std::uint32_t>(p[i] << 8 | p[i + 1]);
  sum = (sum >> 16) + (sum & 0xffff);
  return static_cast<std::uint16_t>(~(sum + (sum >> 16)));
}

void writeHeaders(const Datagram& datagram, std::uint8_t* p) {
  constexpr std::uint8_t kCard[6] = {0x12, 0x34, 0x56, 0x78, 0x90, 0x12}, kHost[6] = {2, 0, 0, 0, 0, 1};
  constexpr std::uint8_t kUdp = 17;
  // The card's factory address is 192.168.33.180. Datagrams from port 1024 are the card's.
  const bool from_card = ntohs(datagram.source.sin_port) == 1024;
  std::memcpy(p, from_card ? kHost : kCard, 6);
  std::memcpy(p + 6, from_card ? kCard : kHost, 6);
  put16(p + 12, 0x0800);
  std::uint8_t* ip = p + 14;
  std::memset(ip, 0, 20);
  ip[0] = 0x45;
  put16(ip + 2, 20 + 8 + datagram.size);
  put16(ip + 6, 0x4000);  // do not fragment
  ip[8] = 255;
  ip[9] = kUdp;
  std::memcpy(ip + 12, &datagram.source.sin_addr, 4);
  std::memcpy(ip + 16, &datagram.destination.sin_addr, 4);
  put16(ip + 10, headerChecksum(ip));
  std::uint8_t* udp = ip + 20;
  std::memcpy(udp, &datagram.source.sin_port, 2);
  std::memcpy(udp + 2, &datagram.destination.sin_port, 2);
  put16(udp + 4, 8 + datagram.size);
  put16(udp + 6, 0);
}

std::string stamped(std::string file) {
  const std::string place = "{stamp}";
  const std::size_t at = file.find(place);
  if (at == std::string::npos) return file;
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%S", &utc);
  return file.replace(at, place.size(), text);
}

}  // namespace

struct PcapWriter::Output {
  std::unique_ptr<pcap_t, decltype(&pcap_close)> format{nullptr, pcap_close};
  pcap_dumper_t* dumper = nullptr;
  long whole = 0;  ///< bytes up to the end of the last packet that is certainly on the disk
  ~Output() {
    if (dumper) pcap_dump_close(dumper);
  }
};

PcapWriter::PcapWriter(const std::string& file, std::size_t queue_bytes, std::uint64_t min_free_bytes)
    : file_(stamped(file)),
      queue_bytes_(queue_bytes),
      min_free_bytes_(min_free_bytes),
      output_(std::make_unique<Output>()) {
  if (std::filesystem::is_regular_file(file_)) {
    throw InputError(file_ + ": exists already; give a new name for the packet recording, or one with {stamp} in it");
  }
  output_->format.reset(pcap_open_dead_with_tstamp_precision(DLT_EN10MB, kSnapLength, PCAP_TSTAMP_PRECISION_NANO));
  output_->dumper = output_->format ? pcap_dump_open(output_->format.get(), file_.c_str()) : nullptr;
  if (!output_->dumper) {
    throw InputError(file_ + ": packet recording cannot be written (" + std::strerror(errno) +
                     "); give a file in a folder that can be written");
  }
  thread_ = std::thread([this] { run(); });
}

PcapWriter::~PcapWriter() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void PcapWriter::add(const Datagram& datagram) {
  const auto size = static_cast<std::uint32_t>(kHeaderBytes + datagram.size);
  const std::size_t record = sizeof datagram.stamp_ns + sizeof size + size;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!problem_.empty() || waiting_.size() + record > queue_bytes_ || datagram.size > kSnapLength - kHeaderBytes) {
      ++left_out_;
      return;
    }
    const std::size_t at = waiting_.size();
    waiting_.resize(at + record);
    std::uint8_t* p = &waiting_[at];
    std::memcpy(p, &datagram.stamp_ns, sizeof datagram.stamp_ns);
    std::memcpy(p + sizeof datagram.stamp_ns, &size, sizeof size);
    p += sizeof datagram.stamp_ns + sizeof size;
    writeHeaders(datagram, p);
    std::memcpy(p + kHeaderBytes, datagram.bytes, datagram.size);
  }
  changed_.notify_all();
}

void PcapWriter::flush() {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return waiting_.empty() && !writing_; });
}

std::string PcapWriter::problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

void PcapWriter::run() {
  std::vector<std::uint8_t> records;
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return !waiting_.empty() || stop_; });
    if (waiting_.empty()) return;
    records.clear();
    records.swap(waiting_);
    writing_ = true;
    lock.unlock();
    write(records);
    lock.lock();
    writing_ = false;
    changed_.notify_all();
  }
}

void PcapWriter::write(const std::vector<std::uint8_t>& records) {
  if (!output_->dumper) {  // these waited while the recording ended
    for (std::size_t at = 0; at < records.size(); ++left_out_) {
      std::uint32_t size;
      std::memcpy(&size, &records[at + sizeof(std::int64_t)], sizeof size);
      at += sizeof(std::int64_t) + sizeof size + size;
    }
    return;
  }
  std::uint64_t packets = 0;
  for (std::size_t at = 0; at < records.size();) {
    std::int64_t stamp_ns;
    std::uint32_t size;
    std::memcpy(&stamp_ns, &records[at], sizeof stamp_ns);
    std::memcpy(&size, &records[at + sizeof stamp_ns], sizeof size);
    at += sizeof stamp_ns + sizeof size;
    pcap_pkthdr header{};
    header.ts.tv_sec = stamp_ns / 1'000'000'000;
    header.ts.tv_usec = stamp_ns % 1'000'000'000;  // ns by the precision
    header.caplen = header.len = size;
    pcap_dump(reinterpret_cast<u_char*>(output_->dumper), &header, &records[at]);
    at += size;
    ++packets;
  }
  errno = 0;
  if (pcap_dump_flush(output_->dumper) == 0 && !std::ferror(pcap_dump_file(output_->dumper))) {
    written_ += packets;
    output_->whole = pcap_dump_ftell(output_->dumper);
    if (!spaceLeft()) end("less than " + std::to_string(min_free_bytes_ >> 20) + " MB are free on its disk");
    return;
  }
  left_out_ += packets;
  end(errno ? std::strerror(errno) : "write error");
}

/// True where the disk has enough space. A file that is no regular one (a pipe, say) has no limit.
bool PcapWriter::spaceLeft() {
  struct statvfs disk = {};
  if (!std::filesystem::is_regular_file(file_) || ::statvfs(file_.c_str(), &disk) != 0) return true;
  return static_cast<std::uint64_t>(disk.f_bavail) * disk.f_frsize >= min_free_bytes_;
}

void PcapWriter::end(const std::string& why) {
  pcap_dump_close(output_->dumper);
  output_->dumper = nullptr;
  const bool cut = ::truncate(file_.c_str(), output_->whole) == 0;
  const std::lock_guard<std::mutex> lock(mutex_);
  problem_ = "packet recording " + file_ + " ends after " + std::to_string(written_) + " packets (" + why + ")" +
             (cut ? "; what it holds is whole" : "") + ": make room and record anew";
}

}  // namespace mmradartwin
