// pcap_to_capture: converts recorded packets of a DCA1000 into a capture file, with the driver's own assembler.
#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_driver/pcap_capture.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/session.h"

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::string input, radar;
  OutputArguments output;
  PcapSource source;
  CLI::App app("Makes a capture from recorded packets (tcpdump, Wireshark, or the driver's record_pcap).");
  app.add_option("PCAP", input, "pcap or pcapng file")->required();
  app.add_option("--radar", radar, "radar.yaml of the radar that was recorded")->required();
  addOutputArguments(app, output, "capture to write");
  app.add_option("--data-port", source.data, "UDP port of the samples")->capture_default_str();
  app.add_option("--config-port", source.config, "UDP port of the card's answers")->capture_default_str();
  app.add_option("--card-ip", source.card_ip, "address of the card whose samples are wanted, where several sent some");
  app.footer("Example: pcap_to_capture lab.pcap --radar radar.yaml --output lab.bin");
  return runProgram(app, argc, argv, [&] {
    Output file = Output::file(output, {input, radar});
    const PcapCapture capture = pcapToCapture(input, loadRadarConfig(radar), file.path(), source);
    if (capture.frames == 0) {
      throw InputError(input + ": holds no whole frame of this radar; is --radar the one that was recorded?");
    }
    file.complete();
    if (capture.before_file > 0) {
      note("the file begins within a recording: " + std::to_string(capture.before_file) +
           " frame(s) came before it and are left out");
    }
    std::vector<std::string> notes, errors;
    for (std::size_t i = 1; i < capture.recordings.size(); ++i) {
      notes.push_back("frame " + std::to_string(capture.recordings[i]) +
                      " begins another recording: the card was armed anew");
    }
    for (const CaptureFlaw& flaw : capture.flaws) {
      errors.push_back("frame " + std::to_string(flaw.frame) + ": " + std::to_string(flaw.lost_bytes) +
                       " bytes lost (zeros in the capture), " + std::to_string(flaw.chirps.size()) + " chirp(s) from " +
                       std::to_string(flaw.chirps.front()) + " on not whole");
    }
    noteAll(notes);
    sayErrors(errors);
    errors.clear();
    for (const std::uint64_t bytes : capture.cut_off) {
      errors.push_back("a last frame was cut off after " + std::to_string(bytes) + " bytes and left out");
    }
    sayErrors(errors);
    std::cout << file.name() << ": " << capture.frames << " frame(s), the first at "
              << formatStamp(capture.first_stamp_ns) << " s, " << capture.flaws.size() << " with losses";
    if (capture.lost_packets > 0) std::cout << "; " << capture.lost_packets << " packets lost";
    std::cout << "\n";
    return capture.flaws.empty() && capture.cut_off.empty() ? 0 : 2;
  });
}
