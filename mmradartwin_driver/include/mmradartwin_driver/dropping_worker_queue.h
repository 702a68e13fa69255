#pragma once

#include <semaphore.h>

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <cerrno>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>

namespace mmradartwin {

/// Queue from one thread to another that may stall: in order, without a lock, and without waiting for the giver. Values
/// are dropped and counted while `capacity` values wait. The taker is a thread of this object, which ends after it has
/// delivered everything.
template <typename T>
class DroppingWorkerQueue {
 public:
  DroppingWorkerQueue(std::size_t capacity, std::function<void(T&&)> take) : queue_(capacity), take_(std::move(take)) {
    sem_init(&waiting_, 0, 0);
    thread_ = std::thread([this] { run(); });
  }
  ~DroppingWorkerQueue() {
    stop_ = true;
    sem_post(&waiting_);
    thread_.join();
    sem_destroy(&waiting_);
  }
  DroppingWorkerQueue(const DroppingWorkerQueue&) = delete;
  DroppingWorkerQueue& operator=(const DroppingWorkerQueue&) = delete;

  /// Adds a value; from one thread only. False where the value was dropped.
  bool give(T&& value) {
    if (!queue_.push(std::move(value))) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
      return false;
    }
    sem_post(&waiting_);  // takes no lock
    return true;
  }
  std::uint64_t dropped() const { return dropped_.load(std::memory_order_relaxed); }

 private:
  void run() {
    for (;;) {
      while (sem_wait(&waiting_) != 0 && errno == EINTR) {
      }
      bool any = false;
      T value;
      if (queue_.pop(value)) {
        any = true;
        take_(std::move(value));
      }
      if (!any && stop_) return;
    }
  }

  boost::lockfree::spsc_queue<T> queue_;
  std::function<void(T&&)> take_;
  sem_t waiting_;
  std::atomic<bool> stop_{false};
  std::atomic<std::uint64_t> dropped_{0};
  std::thread thread_;
};

}  // namespace mmradartwin
