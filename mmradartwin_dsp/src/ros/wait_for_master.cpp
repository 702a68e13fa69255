#include "mmradartwin_dsp/ros/wait_for_master.h"

#include <XmlRpc.h>
#include <ros/network.h>

#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <thread>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {
namespace {

constexpr std::chrono::milliseconds kLook{50};

struct Answer {
  std::mutex mutex;
  std::condition_variable changed;
  bool came = false, given_up = false;
};

/// Asks until there is an answer or nobody waits for one.
void keepAsking(const MasterAddress& master, Answer& answer) {
  for (;;) {
    XmlRpc::XmlRpcClient client(master.host.c_str(), static_cast<int>(master.port), "/");
    XmlRpc::XmlRpcValue request, reply;
    request[0] = "/wait_for_master";
    const bool came = client.execute("getPid", request, reply) && !client.isFault();
    {
      const std::lock_guard<std::mutex> lock(answer.mutex);
      answer.came = came;
      if (came || answer.given_up) break;
    }
    std::this_thread::sleep_for(kLook);
  }
  answer.changed.notify_all();
}

}  // namespace

MasterAddress masterAddress(int argc, const char* const* argv) {
  const std::string argument = "__master:=";
  const char* set = std::getenv("ROS_MASTER_URI");
  MasterAddress master;
  master.uri = set == nullptr ? "" : set;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word.compare(0, argument.size(), argument) == 0) master.uri = word.substr(argument.size());
  }
  if (!ros::network::splitURI(master.uri, master.host, master.port) || master.host.empty() || master.port == 0 ||
      master.port > 65535) {
    throw InputError("ROS_MASTER_URI: '" + master.uri +
                     "' is no address of a ROS master; it must be as http://localhost:11311");
  }
  return master;
}

bool masterAnswers(const MasterAddress& master, double within_s, const std::function<bool()>& stop) {
  const auto answer = std::make_shared<Answer>();
  // Left alone where it hangs: a call cannot be broken off.
  std::thread([master, answer] { keepAsking(master, *answer); }).detach();
  const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(within_s);
  std::unique_lock<std::mutex> lock(answer->mutex);
  while (!answer->changed.wait_for(lock, kLook, [&answer] { return answer->came; })) {
    if (std::chrono::steady_clock::now() > until || (stop && stop())) break;
  }
  answer->given_up = true;
  return answer->came;
}

std::string noMasterAnswers(const MasterAddress& master) {
  return "no ROS master answers at " + master.uri + ": start live.launch or replay.launch first, or set ROS_MASTER_URI";
}

}  // namespace mmradartwin
