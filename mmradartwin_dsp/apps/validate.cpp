// validate: says what is missing or odd in a bag before anyone depends on it.
#include <CLI/CLI.hpp>
#include <iostream>

#include "mmradartwin_dsp/capture_check.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/ros/bag_arguments.h"
#include "mmradartwin_dsp/ros/bag_validation.h"

namespace {

/// What the bag's samples look like beside what its radar configuration says.
void addSamples(const std::string& bag, const mmradartwin::BagOptions& options,
                std::vector<mmradartwin::BagFinding>& findings) {
  using namespace mmradartwin;
  Recording recording;
  try {
    recording = openBag(bag, options);
  } catch (const InputError&) {  // what is missing in it was found already
    return;
  }
  const auto add = [&](const std::string& line) {
    const std::string source = recording.source + ": ";
    findings.push_back({line.rfind(source, 0) == 0 ? line.substr(source.size()) : line, 1, ""});
  };
  const std::size_t known = recording.problems.size();
  try {
    for (const std::string& note : checkCaptures(recording)) add(note);
  } catch (const InputError& error) {
    add(error.what());
  }
  for (std::size_t i = known; i < recording.problems.size(); ++i) add(recording.problems[i].message);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace mmradartwin;
  std::vector<std::string> bags;
  BagOptions options;
  BagLimits limits;
  double stamp_tolerance_ms = limits.stamp_tolerance_s * 1e3;
  CLI::App app("Says what is missing or odd in a recorded bag. Exit status 0: nothing, 2: something.");
  app.add_option("BAG", bags, "bag to look at; several, the parts of one recording, are read as one")->required();
  addBagArguments(app, options);
  app.add_option("--radar", options.ns, "look at the radar of this namespace only; the same as --ns");
  app.add_option("--stamp-tolerance-ms", stamp_tolerance_ms, "frames' stamps may be off the frame period by so much")
      ->capture_default_str();
  app.add_option("--tf-gap-s", limits.tf.gap_s,
                 "longest time between transforms around a frame, where the radar stands elsewhere afterwards")
      ->capture_default_str();
  app.add_option(
         "--tf-silence-s", limits.tf_silence_s,
         "the same where it stands at the same place, and from a recording's first or last transform to a frame")
      ->capture_default_str();
  app.footer("Example: validate lab.bag");
  return runProgram(app, argc, argv, [&] {
    limits.stamp_tolerance_s = stamp_tolerance_ms * 1e-3;
    options.further.assign(bags.begin() + 1, bags.end());
    const std::string& bag = bags.front();
    std::vector<BagFinding> findings;
    {
      ProgressLine progress;
      findings = validateBag(bag, options, limits, [&progress](int done, int total) {
        progress.count(static_cast<std::size_t>(done), static_cast<std::size_t>(total), "messages");
      });
    }
    addSamples(bag, options, findings);
    for (const BagFinding& finding : findings) {
      std::cout << bag << ": ";
      if (!finding.first.empty() || finding.count > 1) std::cout << finding.count << " ";
      std::cout << finding.what;
      if (!finding.first.empty()) std::cout << "; first: " << finding.first;
      std::cout << "\n";
    }
    if (findings.empty()) std::cout << bag << ": nothing is missing or odd\n";
    return findings.empty() ? 0 : 2;
  });
}
