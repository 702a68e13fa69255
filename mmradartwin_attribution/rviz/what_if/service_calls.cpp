#include "service_calls.h"

#include <mmradartwin_msgs/SaveTwin.h>
#include <ros/service.h>
#include <std_srvs/Trigger.h>

#include <utility>

namespace mmradartwin {
namespace {

const char* const kNobody = "nobody offers what_if/edit: is what_if_node running?";

}  // namespace

ServiceCalls::ServiceCalls(std::function<void(bool, const std::string&)> on_answer)
    : on_answer_(std::move(on_answer)), thread_([this] { work(); }) {}

ServiceCalls::~ServiceCalls() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ends_ = true;
  }
  ready_.notify_one();
  thread_.join();
}

void ServiceCalls::edit(const std::string& knob, const mmradartwin_msgs::EditTwin::Request& request) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!waiting_.empty() && waiting_.back().knob == knob && request.continues) {
      const bool continues = waiting_.back().request.continues;
      waiting_.back().request = request;
      waiting_.back().request.continues = continues;
      return;
    }
  }
  post({knob, request, nullptr});
}

void ServiceCalls::trigger(const std::string& service) {
  post({"", {}, [this, service] {
          std_srvs::Trigger call;
          const bool reached = ros::service::call(service, call);
          on_answer_(reached && call.response.success, reached ? call.response.message : kNobody);
        }});
}

void ServiceCalls::save(const std::string& folder, bool overwrite) {
  post({"", {}, [this, folder, overwrite] {
          mmradartwin_msgs::SaveTwin call;
          call.request.folder = folder;
          call.request.overwrite = overwrite;
          const bool reached = ros::service::call("what_if/save", call);
          on_answer_(reached && call.response.success, reached ? call.response.message : kNobody);
        }});
}

void ServiceCalls::post(Call call) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_.push_back(std::move(call));
  }
  ready_.notify_one();
}

void ServiceCalls::work() {
  for (;;) {
    Call call;
    {
      std::unique_lock<std::mutex> lock(mutex_);
      ready_.wait(lock, [this] { return ends_ || !waiting_.empty(); });
      if (ends_) return;
      call = std::move(waiting_.front());
      waiting_.pop_front();
    }
    if (call.run) {
      call.run();
      continue;
    }
    mmradartwin_msgs::EditTwin edit;
    edit.request = call.request;
    const bool reached = ros::service::call("what_if/edit", edit);
    on_answer_(reached && edit.response.success, reached ? edit.response.message : kNobody);
  }
}

}  // namespace mmradartwin
