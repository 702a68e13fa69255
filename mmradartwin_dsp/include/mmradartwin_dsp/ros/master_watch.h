#pragma once

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <thread>

namespace mmradartwin {

/// Keeps this process's topics known where the ROS master is restarted. roscpp registers a topic once: the new master
/// knows nothing of a node that runs on, and nobody who comes later finds it. Connections that stand are not touched,
/// they need no master. Make one in main(), after ros::init().
class MasterWatch {
 public:
  explicit MasterWatch(double period_s = 2.0);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

 private:
  void run();
  void look();

  double period_s_;
  bool gone_ = false;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace mmradartwin
