#pragma once

#include <ros/this_node.h>
#include <xmlrpcpp/XmlRpcValue.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>

namespace mmradartwin {

/// Keeps this process known where the ROS master is restarted. roscpp registers topics and services once: the new
/// master knows nothing of a node that runs on, and nobody who comes later finds it. They are registered again, and the
/// parameters below `parameters_of` and /use_sim_time are set again where the new master has none: a node that is
/// started again reads them. Connections that stand need no master. Make one in main(), after ros::init(), or in a
/// nodelet.
class MasterWatch {
 public:
  explicit MasterWatch(const std::string& parameters_of = ros::this_node::getName(), double period_s = 2.0);
  ~MasterWatch();
  MasterWatch(const MasterWatch&) = delete;
  MasterWatch& operator=(const MasterWatch&) = delete;

 private:
  void run();
  void look();
  /// Notes what the next master has to be told.
  void remember();
  /// False where the master did not take all of it.
  bool registerAgain() const;
  bool registerTopics() const;
  bool registerServices() const;
  void setParameters() const;

  const std::string parameters_of_;
  const double period_s_;
  bool gone_ = false, incomplete_ = false;
  std::set<std::string> services_;
  std::optional<XmlRpc::XmlRpcValue> parameters_;  ///< nothing: there were none
  std::mutex mutex_;
  std::condition_variable ended_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace mmradartwin
