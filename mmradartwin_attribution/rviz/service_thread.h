#pragma once

#include <ros/service.h>

#include <QObject>
#include <QPointer>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

namespace mmradartwin {

/// Calls to ROS services one after the other in a thread of its own, so that a node that takes its time does not stop
/// the window. What is still going on when this ends ends by itself.
class ServiceThread {
 public:
  ServiceThread();
  ~ServiceThread();
  ServiceThread(const ServiceThread&) = delete;
  ServiceThread& operator=(const ServiceThread&) = delete;

  /// `work` runs in the thread, and then `done` in the window's, unless `receiver` is gone. Work of the same `knob`
  /// that is the last to wait still is replaced: of a slider that is being drawn the newest value counts. "": none is.
  void call(std::function<void()> work, QObject* receiver, std::function<void()> done, const std::string& knob = "");

  /// Calls a service. on_answer, in the window's thread: whether the service was there, and its response.
  template <typename Service>
  void callService(const std::string& name, const typename Service::Request& request, QObject* receiver,
                   std::function<void(bool reached, const typename Service::Response&)> on_answer,
                   const std::string& knob = "") {
    struct Answer {
      Service service;
      bool reached = false;
    };
    const auto answer = std::make_shared<Answer>();
    answer->service.request = request;
    call([answer, name] { answer->reached = ros::service::call(name, answer->service); }, receiver,
         [answer, on_answer = std::move(on_answer)] { on_answer(answer->reached, answer->service.response); }, knob);
  }

 private:
  struct Job {
    std::function<void()> work, done;
    QPointer<QObject> receiver;
    std::string knob;
  };
  struct Queue {
    std::mutex mutex;
    std::condition_variable changed;
    std::deque<Job> jobs;
    bool over = false;
  };
  static void run(const std::shared_ptr<Queue>& queue);
  std::shared_ptr<Queue> queue_ = std::make_shared<Queue>();
};

}  // namespace mmradartwin
