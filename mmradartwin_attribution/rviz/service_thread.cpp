#include "service_thread.h"

#include <QCoreApplication>
#include <thread>
#include <utility>

namespace mmradartwin {

ServiceThread::ServiceThread() {
  std::thread([queue = queue_] { run(queue); }).detach();
}

ServiceThread::~ServiceThread() {
  const std::lock_guard<std::mutex> lock(queue_->mutex);
  queue_->over = true;
  queue_->jobs.clear();
  queue_->changed.notify_all();
}

void ServiceThread::call(std::function<void()> work, QObject* receiver, std::function<void()> done,
                         const std::string& knob) {
  const std::lock_guard<std::mutex> lock(queue_->mutex);
  std::deque<Job>& jobs = queue_->jobs;
  if (!knob.empty() && !jobs.empty() && jobs.back().knob == knob) jobs.pop_back();
  jobs.push_back({std::move(work), std::move(done), receiver, knob});
  queue_->changed.notify_all();
}

void ServiceThread::run(const std::shared_ptr<Queue>& queue) {
  while (true) {
    Job job;
    {
      std::unique_lock<std::mutex> lock(queue->mutex);
      queue->changed.wait(lock, [&] { return queue->over || !queue->jobs.empty(); });
      if (queue->over) return;
      job = std::move(queue->jobs.front());
      queue->jobs.pop_front();
    }
    job.work();
    if (QCoreApplication* application = QCoreApplication::instance()) {
      QMetaObject::invokeMethod(
          application,
          [done = std::move(job.done), receiver = std::move(job.receiver)] {
            if (receiver) done();
          },
          Qt::QueuedConnection);
    }
  }
}

}  // namespace mmradartwin
