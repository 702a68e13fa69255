// The card's fastest stream for some seconds, over loopback or a pair of virtual Ethernet ports: what a bare recvmmsg
// loop, the receiver, and receiver, assembler and hand-over together lose, and what of a core they take.
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <thread>
#include <vector>

#include "mmradartwin_driver/dropping_worker_queue.h"
#include "mmradartwin_driver/frame_assembler.h"
#include "mmradartwin_driver/packet_receiver.h"
#include "mmradartwin_dsp/paper_radar.h"
#include "mmradartwin_dsp/program.h"

namespace {

using namespace mmradartwin;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kPayload = 1456, kDatagram = 1466;

struct Options {
  double seconds = 10, mbit_per_s = 706;
  int burst = 1, stall_ms = 0, buffer_mb = 32;
  bool veth = false;
  std::string host_ip = "127.201.1.1", card_ip = "127.201.1.2", only;
};

double threadCpu_s() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

/// Sends numbered packets at an even pace and ends with their number as its last words.
void sendStream(const Options& options, int report_fd) {
  const UdpSocket socket(options.card_ip, 1024, "the benchmark");
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(kDca1000DataPort);
  to.sin_addr = parseIpv4(options.host_ip);
  std::vector<std::uint8_t> datagram(kDatagram);
  for (std::size_t i = 10; i < kDatagram; ++i) datagram[i] = static_cast<std::uint8_t>(i * 2654435761u >> 24);
  const auto interval = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(kPayload * 8 / (options.mbit_per_s * 1e6)));
  const auto packets = static_cast<std::uint64_t>(options.seconds / std::chrono::duration<double>(interval).count());
  const auto start = Clock::now();
  std::uint64_t refused = 0;
  for (std::uint64_t n = 0; n < packets; ++n) {
    if (n % static_cast<std::uint64_t>(options.burst) == 0) {
      while (Clock::now() < start + n * interval) {
      }
    }
    const std::uint64_t count = n * kPayload;
    const auto sequence = static_cast<std::uint32_t>(n + 1);
    std::memcpy(&datagram[0], &sequence, 4);
    std::memcpy(&datagram[4], &count, 6);
    if (sendto(socket.fd(), datagram.data(), kDatagram, 0, reinterpret_cast<sockaddr*>(&to), sizeof to) < 0) ++refused;
  }
  const double took_s = std::chrono::duration<double>(Clock::now() - start).count();
  const double report[] = {static_cast<double>(packets), static_cast<double>(refused), took_s};
  if (write(report_fd, report, sizeof report) != sizeof report) _exit(1);
}

struct Sender {
  pid_t pid = -1;
  int start_fd = -1, report_fd = -1;
};

int run(const std::string& command) {
  const int status = std::system(command.c_str());
  if (status != 0) throw std::runtime_error("this failed, is it run as root? " + command);
  return status;
}

/// Forks the sender; it begins when a byte comes through start_fd.
Sender forkSender(const Options& options) {
  int start[2], report[2];
  if (pipe(start) != 0 || pipe(report) != 0) throw std::runtime_error("no pipe");
  std::fflush(stdout);
  const pid_t pid = fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    char byte = 0;
    if (options.veth && unshare(CLONE_NEWNET) != 0) {
      std::perror("unshare");
      _exit(1);
    }
    const double ready = 0;
    if (write(report[1], &ready, sizeof ready) != sizeof ready || read(start[0], &byte, 1) != 1) _exit(1);
    try {
      if (options.veth) {
        run("ip addr add " + options.card_ip + "/24 dev mmrbench1 && ip link set mmrbench1 up && sleep 0.3");
      }
      sendStream(options, report[1]);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "sender: %s\n", error.what());
      _exit(1);
    }
    _exit(0);
  }
  close(report[1]);  // a sender that fails ends the report
  double ready;
  if (pid < 0 || read(report[0], &ready, sizeof ready) != sizeof ready) throw std::runtime_error("no sender");
  if (options.veth) {
    run("ip link add mmrbench0 type veth peer name mmrbench1 netns " + std::to_string(pid) + " && ip addr add " +
        options.host_ip + "/24 dev mmrbench0 && ip link set mmrbench0 up");
  }
  return {pid, start[1], report[0]};
}

struct Result {
  std::uint64_t packets = 0, kernel_drops = 0, frames = 0, lost_bytes = 0, not_taken = 0;
  double cpu_s = 0;
};

/// `receive` is called with a flag that turns true some time after the last packet.
void measure(const Options& options, const char* name,
             const std::function<Result(const std::function<void()>& ready, const std::atomic<bool>& over)>& receive,
             double* ns_per_packet) {
  if (!options.only.empty() && options.only != name) return;
  const Sender sender = forkSender(options);
  std::atomic<bool> over{false};
  double report[3] = {};
  bool reported = false;
  std::thread watch([&] {
    reported = read(sender.report_fd, report, sizeof report) == sizeof report;
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    over = true;
  });
  Result result;
  try {
    result = receive([&] { (void)!write(sender.start_fd, "x", 1); }, over);
  } catch (...) {
    kill(sender.pid, SIGKILL);
    watch.join();
    throw;
  }
  watch.join();
  waitpid(sender.pid, nullptr, 0);
  close(sender.start_fd);
  close(sender.report_fd);
  if (!reported) throw std::runtime_error("the sender failed");
  *ns_per_packet = result.cpu_s * 1e9 / static_cast<double>(std::max<std::uint64_t>(result.packets, 1));
  std::printf(
      "%-9s %9.0f sent at %6.1f Mbit/s (%.0f refused)  %9llu received  lost %.0f  dropped here %llu  "
      "cpu %5.1f %% of a core, %4.0f ns a packet",
      name, report[0], report[0] * kPayload * 8e-6 / report[2], report[1],
      static_cast<unsigned long long>(result.packets), report[0] - report[1] - static_cast<double>(result.packets),
      static_cast<unsigned long long>(result.kernel_drops), 100 * result.cpu_s / report[2], *ns_per_packet);
  if (result.frames) {
    std::printf("  %llu frames, %llu bytes lost, %llu not taken", static_cast<unsigned long long>(result.frames),
                static_cast<unsigned long long>(result.lost_bytes), static_cast<unsigned long long>(result.not_taken));
  }
  std::printf("\n");
  std::fflush(stdout);
}

Result receiveBare(const Options& options, const std::function<void()>& ready, const std::atomic<bool>& over) {
  const UdpSocket socket(options.host_ip, kDca1000DataPort, "the benchmark");
  const int buffer = options.buffer_mb << 20;
  if (setsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUFFORCE, &buffer, sizeof buffer) != 0) {
    setsockopt(socket.fd(), SOL_SOCKET, SO_RCVBUF, &buffer, sizeof buffer);
  }
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
  Result result;
  ready();
  const double before_s = threadCpu_s();
  while (!over) {
    if (!socket.waitReadable(50)) continue;
    const int got = recvmmsg(socket.fd(), messages.data(), kBatch, MSG_DONTWAIT, nullptr);
    if (got > 0) result.packets += static_cast<std::uint64_t>(got);
  }
  result.cpu_s = threadCpu_s() - before_s;
  return result;
}

Result receiveOnly(const Options& options, const std::function<void()>& ready, const std::atomic<bool>& over) {
  PacketReceiver::Options receiver_options;
  receiver_options.buffer_bytes = static_cast<std::size_t>(options.buffer_mb) << 20;
  PacketReceiver receiver(options.host_ip, kDca1000DataPort, options.card_ip, receiver_options);
  ready();
  const double before_s = threadCpu_s();
  while (!over) receiver.receive(50, [](const DataPacket&) {});
  Result result;
  result.cpu_s = threadCpu_s() - before_s;
  result.packets = receiver.counters().packets;
  result.kernel_drops = receiver.counters().kernel_drops;
  return result;
}

/// 128 loops of 2 x 64 samples: 262,144 bytes a frame, as fast as they come.
Result receiveFrames(const Options& options, const std::function<void()>& ready, const std::atomic<bool>& over) {
  RadarConfig radar = paperRadar();
  radar.loops_per_frame = 128;
  radar.frame_period_s = 262144 * 8 / (options.mbit_per_s * 1e6);
  Result result;
  {
    std::uint64_t taken = 0;
    DroppingWorkerQueue<AdcCube> taker(512, [&](AdcCube&&) {
      if (options.stall_ms > 0 && ++taken % 100 == 0) {
        std::this_thread::sleep_for(std::chrono::milliseconds(options.stall_ms));
      }
    });
    FrameAssembler assembler(radar, [&](AdcCube&& cube) { taker.give(std::move(cube)); });
    PacketReceiver::Options receiver_options;
    receiver_options.buffer_bytes = static_cast<std::size_t>(options.buffer_mb) << 20;
    PacketReceiver receiver(options.host_ip, kDca1000DataPort, options.card_ip, receiver_options);
    ready();
    const double before_s = threadCpu_s();
    while (!over) receiver.receive(50, [&](const DataPacket& packet) { assembler.add(packet); });
    result.cpu_s = threadCpu_s() - before_s;
    assembler.flush();
    result.packets = receiver.counters().packets;
    result.kernel_drops = receiver.counters().kernel_drops;
    result.frames = assembler.counters().frames;
    // The last frame is begun, never finished.
    const std::uint64_t open = assembler.counters().bytes % radar.bytes_per_frame();
    result.lost_bytes = assembler.counters().lost_bytes - (open ? radar.bytes_per_frame() - open : 0);
    result.not_taken = taker.dropped();
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app("Receives the card's fastest stream and prints losses and processor time.");
  app.add_option("--seconds", options.seconds, "of each run")->capture_default_str()->check(CLI::Range(0.1, 3600.0));
  app.add_option("--mbit", options.mbit_per_s, "sample bytes, Mbit/s")
      ->capture_default_str()
      ->check(CLI::Range(1, 2000));
  app.add_option("--burst", options.burst, "packets sent at once")->capture_default_str()->check(CLI::Range(1, 1000));
  app.add_option("--stall-ms", options.stall_ms, "the taker of frames sleeps so long every 100 frames")
      ->capture_default_str();
  app.add_option("--buffer-mb", options.buffer_mb, "receive buffer")->capture_default_str();
  app.add_option("--only", options.only, "bare, receive or frames");
  app.add_flag("--veth", options.veth, "over virtual Ethernet into another network namespace (as root)");
  return runProgram(app, argc, argv, [&] {
    if (options.veth) options.host_ip = "192.168.34.30", options.card_ip = "192.168.34.180";
    double bare = 0, receive = 0, frames = 0;
    using Ready = std::function<void()>;
    using Over = std::atomic<bool>;
    const auto with = [&](Result (*f)(const Options&, const Ready&, const Over&)) {
      return [&options, f](const Ready& ready, const Over& over) { return f(options, ready, over); };
    };
    measure(options, "bare", with(receiveBare), &bare);
    measure(options, "receive", with(receiveOnly), &receive);
    measure(options, "frames", with(receiveFrames), &frames);
    if (bare > 0 && receive > 0)
      std::printf("receive takes %.2f, frames %.2f of the bare loop's time\n", receive / bare, frames / bare);
    return 0;
  });
}
