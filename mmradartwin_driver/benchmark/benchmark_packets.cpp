// Packets per second: the assembler beside a bare copy of the same payloads, the receiver beside a bare recvmmsg loop.
#include <arpa/inet.h>
#include <benchmark/benchmark.h>
#include <sys/socket.h>

#include <cstring>
#include <vector>

#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_dsp/paper_radar.h"

namespace mmradartwin {
namespace {

constexpr std::size_t kPayload = 1456;

RadarConfig radarWithLoops(int loops) {
  RadarConfig radar = paperRadar();
  radar.loops_per_frame = loops;
  return radar;
}

std::vector<std::uint8_t> payloads(std::size_t packets) {
  std::vector<std::uint8_t> bytes(packets * kPayload);
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<std::uint8_t>(i * 2654435761u >> 24);
  return bytes;
}

constexpr std::size_t kPackets = 4096;

void copyPayloads(benchmark::State& state) {
  const auto source = payloads(kPackets);
  std::vector<std::uint8_t> target(source.size());
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPackets; ++i) std::memcpy(&target[i * kPayload], &source[i * kPayload], kPayload);
    benchmark::DoNotOptimize(target.data());
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kPackets));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * source.size()));
}
BENCHMARK(copyPayloads);

/// Packets in order, frames of 2 loops x 2048 bytes; decoding to samples is part of it.
void assemble(benchmark::State& state) {
  const auto source = payloads(kPackets);
  std::int64_t frames = 0;
  FrameAssembler assembler(radarWithLoops(static_cast<int>(state.range(0))), [&](AdcCube&&) { ++frames; });
  std::uint32_t sequence = 0;
  std::uint64_t count = 0;
  std::int64_t now_ns = 0;
  for (auto _ : state) {
    for (std::size_t i = 0; i < kPackets; ++i) {
      assembler.add({++sequence, count, &source[i * kPayload], kPayload, now_ns += 16'700});
      count += kPayload;
    }
  }
  if (assembler.counters().lost_bytes != 0) state.SkipWithError("bytes were lost");
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * kPackets));
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * source.size()));
}
BENCHMARK(assemble)->Arg(1)->Arg(128);

/// Fills the socket with a burst, outside of the time that counts.
class Burst {
 public:
  Burst(const char* from, const char* to, std::uint16_t port) : socket_(from, 1024, "benchmark"), datagram_(1466) {
    to_.sin_family = AF_INET;
    to_.sin_port = htons(port);
    to_.sin_addr = parseIpv4(to);
  }
  void send(int packets) {
    for (int i = 0; i < packets; ++i) {
      sendto(socket_.fd(), datagram_.data(), datagram_.size(), 0, reinterpret_cast<sockaddr*>(&to_), sizeof to_);
    }
  }

 private:
  UdpSocket socket_;
  sockaddr_in to_{};
  std::vector<std::uint8_t> datagram_;
};

constexpr int kBurst = 1024;
constexpr char kHost[] = "127.202.1.1", kCard[] = "127.202.1.2";

void bareRecvmmsg(benchmark::State& state) {
  const UdpSocket socket(kHost, kDca1000DataPort, "benchmark");
  const int buffer = 32 << 20;
  setsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer);
  Burst burst(kCard, kHost, kDca1000DataPort);
  constexpr int kBatch = 64;
  std::vector<std::uint8_t> data(kBatch * 2048);
  std::vector<iovec> vectors(kBatch);
  std::vector<mmsghdr> messages(kBatch);
  for (int i = 0; i < kBatch; ++i) {
    vectors[i] = {&data[i * 2048], 2048};
    messages[i].msg_hdr = {};
    messages[i].msg_hdr.msg_iov = &vectors[i];
    messages[i].msg_hdr.msg_iovlen = 1;
  }
  std::int64_t packets = 0;
  for (auto _ : state) {
    state.PauseTiming();
    burst.send(kBurst);
    state.ResumeTiming();
    int got;
    while ((got = recvmmsg(socket.fd(), messages.data(), kBatch, MSG_DONTWAIT, nullptr)) > 0) packets += got;
  }
  if (packets != state.iterations() * kBurst) state.SkipWithError("packets were dropped");
  state.SetItemsProcessed(packets);
}
BENCHMARK(bareRecvmmsg);

void receivePackets(benchmark::State& state) {
  PacketReceiver receiver(kHost, kDca1000DataPort, kCard);
  Burst burst(kCard, kHost, kDca1000DataPort);
  std::int64_t packets = 0;
  for (auto _ : state) {
    state.PauseTiming();
    burst.send(kBurst);
    state.ResumeTiming();
    int got;
    while ((got = receiver.receive(0, [](const DataPacket& packet) { benchmark::DoNotOptimize(packet); })) > 0)
      packets += got;
  }
  if (packets != state.iterations() * kBurst) state.SkipWithError("packets were dropped");
  state.SetItemsProcessed(packets);
}
BENCHMARK(receivePackets);

}  // namespace
}  // namespace mmradartwin

BENCHMARK_MAIN();
