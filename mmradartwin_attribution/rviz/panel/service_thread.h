#pragma once

#include <QObject>
#include <QPointer>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>

namespace mmradartwin {

/// Calls to ROS services one after the other in a thread of its own, so that a node that takes its time does not stop
/// the window. What is still going on when this ends ends by itself.
class ServiceThread {
 public:
  ServiceThread();
  ~ServiceThread();
  /// `work` runs in the thread, and then `done` in the window's, unless `receiver` is gone.
  void call(std::function<void()> work, QObject* receiver, std::function<void()> done);

 private:
  struct Job {
    std::function<void()> work, done;
    QPointer<QObject> receiver;
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
