#pragma once

#include <mmradartwin_msgs/EditTwin.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace mmradartwin {

/// Calls what_if/... one after the other in a thread of its own, so that the window goes on.
class ServiceCalls {
 public:
  /// on_answer: called from that thread.
  explicit ServiceCalls(std::function<void(bool success, const std::string& message)> on_answer);
  ~ServiceCalls();
  ServiceCalls(const ServiceCalls&) = delete;
  ServiceCalls& operator=(const ServiceCalls&) = delete;

  /// knob: what is changed. A change of the same knob that waits still, and goes on, is replaced.
  void edit(const std::string& knob, const mmradartwin_msgs::EditTwin::Request& request);
  void trigger(const std::string& service);  ///< what_if/undo or what_if/revert
  void save(const std::string& folder, bool overwrite);

 private:
  struct Call {
    std::string knob;
    mmradartwin_msgs::EditTwin::Request request;
    std::function<void()> run;
  };
  void post(Call call);
  void work();

  std::function<void(bool, const std::string&)> on_answer_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Call> waiting_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace mmradartwin
