#include "mmradartwin_dsp/ros/master_watch.h"

#include <ros/ros.h>
// These need ros.h before them.
#include <ros/publication.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

#include <chrono>
#include <string>

namespace mmradartwin {
namespace {

/// A call of the master's API, with this node's name first. False where it fails.
bool ask(const std::string& method, const std::vector<std::string>& arguments) {
  XmlRpc::XmlRpcValue request, response, payload;
  request[0] = ros::this_node::getName();
  for (std::size_t i = 0; i < arguments.size(); ++i) request[static_cast<int>(i) + 1] = arguments[i];
  return ros::master::execute(method, request, response, payload, false);
}

void registerAgain() {
  const std::string uri = ros::XMLRPCManager::instance()->getServerURI();
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  for (const std::string& topic : topics) {
    const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
    if (publication) ask("registerPublisher", {topic, publication->getDataType(), uri});
  }
  topics.clear();
  ros::this_node::getSubscribedTopics(topics);
  for (const std::string& topic : topics) ask("registerSubscriber", {topic, "*", uri});
}

}  // namespace

MasterWatch::MasterWatch(double period_s) : period_s_(period_s), thread_([this] { run(); }) {}

MasterWatch::~MasterWatch() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  ended_.notify_all();
  thread_.join();
}

void MasterWatch::run() {
  const auto period = std::chrono::duration<double>(period_s_);
  for (std::unique_lock<std::mutex> lock(mutex_); !ended_.wait_for(lock, period, [this] { return stop_; });) {
    lock.unlock();
    look();
    lock.lock();
  }
}

void MasterWatch::look() {
  if (!ros::isStarted() || ros::isShuttingDown()) return;
  if (!ros::master::check()) {
    if (!gone_) ROS_WARN("the ROS master is gone: connections that stand go on, new ones wait until it is back");
    gone_ = true;
    return;
  }
  // A master that does not know this node is another one than it was registered with.
  const bool known = ask("lookupNode", {ros::this_node::getName()});
  if (!known) {
    registerAgain();
    ROS_WARN("the ROS master was restarted: this node's topics are registered anew");
  } else if (gone_) {
    ROS_INFO("the ROS master is back");
  }
  gone_ = false;
}

}  // namespace mmradartwin
