// Asks diagnosis_node what the twin gets wrong about the poses seen so far, shows how far it is and what it found, and
// applies the extended twin where that is wanted. Ctrl-C cancels.

#include <actionlib/client/simple_action_client.h>
#include <mmradartwin_msgs/ApplyTwin.h>
#include <mmradartwin_msgs/DiagnoseAction.h>
#include <ros/ros.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <thread>

#include "mmradartwin_attribution/progress_line.h"
#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/program.h"
#include "mmradartwin_dsp/ros/wait_for_master.h"

namespace {

using Client = actionlib::SimpleActionClient<mmradartwin_msgs::DiagnoseAction>;
using State = actionlib::SimpleClientGoalState;

constexpr std::chrono::milliseconds kLook{50};

volatile std::sig_atomic_t interrupted = 0;

struct Arguments {
  std::string output, twin;
  bool apply = false;
  double wait_s = 10;
};

std::string absolute(const std::string& path) {
  return path.empty() ? path : std::filesystem::absolute(path).lexically_normal().string();
}

int apply(const std::string& twin_file) {
  mmradartwin_msgs::ApplyTwin call;
  call.request.file = twin_file;
  if (!ros::service::call("twin/apply", call)) {
    std::cerr << "error: twin/apply does not answer; is the twin node running?\n";
    return 1;
  }
  (call.response.success ? std::cout : std::cerr) << call.response.message << '\n';
  return call.response.success ? 0 : 2;
}

int run(const Arguments& arguments) {
  // actionlib waits for a clock without end. Other times are the wall's: a replay's clock ends with the bag.
  if (!ros::Time::waitForValid(ros::WallDuration(arguments.wait_s))) {
    std::cerr << "error: /use_sim_time is set and no /clock comes: does the replay still run?\n";
    return 2;
  }
  mmradartwin::ProgressLine progress;  // outlives the client, whose callbacks show it
  Client client("attribution/diagnose", true);
  const ros::WallTime begin = ros::WallTime::now();
  while (!client.isServerConnected()) {
    if (interrupted) return 1;
    if ((ros::WallTime::now() - begin).toSec() > arguments.wait_s) {
      std::cerr << "error: attribution/diagnose does not answer; is diagnosis_node running? live.launch and "
                   "replay.launch start it\n";
      return 2;
    }
    std::this_thread::sleep_for(kLook);
  }
  mmradartwin_msgs::DiagnoseGoal goal;
  goal.output = absolute(arguments.output);
  goal.twin = absolute(arguments.twin);
  std::atomic<bool> done{false};
  client.sendGoal(
      goal, [&](const State&, const mmradartwin_msgs::DiagnoseResultConstPtr&) { done = true; }, {},
      [&](const mmradartwin_msgs::DiagnoseFeedbackConstPtr& f) { progress.show(f->share, f->stage); });
  bool cancelled = false;
  while (!done) {
    if (interrupted && !cancelled) {
      client.cancelGoal();
      cancelled = true;
    }
    if (!ros::ok() || !client.isServerConnected()) {
      client.stopTrackingGoal();
      progress.clear();
      std::cerr << "error: diagnosis_node is gone; its messages say why\n";
      return 1;
    }
    std::this_thread::sleep_for(kLook);
  }
  progress.clear();
  const State state = client.getState();
  const mmradartwin_msgs::DiagnoseResultConstPtr result = client.getResult();
  if (state != State::SUCCEEDED || !result) {
    std::cerr << "error: " << state.getText() << '\n';
    return state == State::ABORTED ? 2 : 1;
  }
  std::cout << state.getText() << "Findings: " << result->findings_file << "\nReport: " << result->report_file << '\n';
  for (const std::string& problem : result->problems) std::cerr << "error: " << problem << '\n';
  if (arguments.apply && !result->findings.findings.empty() && !result->extended_twin_file.empty()) {
    return apply(result->extended_twin_file);
  }
  return result->problems.empty() ? 0 : 2;
}

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments;
  CLI::App app("Asks what the twin gets wrong about the poses seen so far.");
  app.name("request_diagnosis");
  app.set_version_flag("--version", "request_diagnosis " MMRADARTWIN_VERSION);
  app.add_option("--output", arguments.output, "folder for findings.json, report and extended twin");
  app.add_option("--twin", arguments.twin, "twin.yaml to judge (default: the one that is simulated)");
  app.add_flag("--apply", arguments.apply, "simulate with the extended twin from then on");
  app.add_option("--wait", arguments.wait_s, "seconds to wait for the node")->check(CLI::Range(0.0, 1e6));
  std::vector<std::string> words;
  ros::removeROSArgs(argc, argv, words);
  std::vector<std::string> given(words.rbegin(), words.rend() - 1);  // as CLI11 wants them, without the program
  try {
    app.parse(given);
    mmradartwin::checkFinite(app);
    std::signal(SIGINT, [](int) { interrupted = 1; });
    const mmradartwin::MasterAddress master = mmradartwin::masterAddress(argc, argv);
    if (!mmradartwin::masterAnswers(master, arguments.wait_s, [] { return interrupted != 0; })) {
      throw mmradartwin::InputError(mmradartwin::noMasterAnswers(master));
    }
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::cerr << "error: " << error.what() << "; run with --help for the options\n";
    return 2;
  } catch (const mmradartwin::InputError& error) {
    std::cerr << "error: " << error.what() << '\n';
    return 2;
  }
  ros::init(argc, argv, "request_diagnosis", ros::init_options::AnonymousName | ros::init_options::NoSigintHandler);
  ros::start();
  return run(arguments);
}
