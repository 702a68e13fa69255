#include "mmradartwin_dsp/ros/master_watch.h"

#include <ros/ros.h>
// These need ros.h before them.
#include <ros/connection_manager.h>
#include <ros/network.h>
#include <ros/publication.h>
#include <ros/service_manager.h>
#include <ros/topic_manager.h>
#include <ros/xmlrpc_manager.h>

#include <chrono>
#include <optional>
#include <vector>

namespace mmradartwin {
namespace {

constexpr int kServices = 2;  // in the master's answer to getSystemState, behind publishers and subscribers

/// A call of the master's API, with this node's name first. False where it fails.
bool ask(const std::string& method, const std::vector<std::string>& arguments, XmlRpc::XmlRpcValue& payload) {
  XmlRpc::XmlRpcValue request, response;
  request[0] = ros::this_node::getName();
  for (std::size_t i = 0; i < arguments.size(); ++i) request[static_cast<int>(i) + 1] = arguments[i];
  return ros::master::execute(method, request, response, payload, false);
}

bool ask(const std::string& method, const std::vector<std::string>& arguments) {
  XmlRpc::XmlRpcValue ignored;
  return ask(method, arguments, ignored);
}

/// A call of this node's own API, as another node makes it: roscpp offers no other way to these.
XmlRpc::XmlRpcValue askMyself(const std::string& method, XmlRpc::XmlRpcValue arguments) {
  arguments[0] = ros::this_node::getName();
  const ros::XMLRPCManagerPtr& manager = ros::XMLRPCManager::instance();
  const int port = static_cast<int>(manager->getServerPort());
  XmlRpc::XmlRpcClient* client = manager->getXMLRPCClient(ros::network::getHost(), port, "/");
  XmlRpc::XmlRpcValue answer;
  client->execute(method.c_str(), arguments, answer);
  manager->releaseXMLRPCClient(client);
  return answer;
}

/// Addresses of the publishers that this node is connected to, of one topic; nothing where it does not say.
std::optional<std::set<std::string>> publishersOf(const std::string& topic) {
  const XmlRpc::XmlRpcValue answer = askMyself("getBusInfo", {});  // status, words, connections
  std::set<std::string> found;
  if (answer.getType() != XmlRpc::XmlRpcValue::TypeArray || answer.size() < 3) return std::nullopt;
  const XmlRpc::XmlRpcValue& connections = answer[2];
  for (int i = 0; i < connections.size(); ++i) {
    const XmlRpc::XmlRpcValue& c = connections[i];  // id, other end, direction, transport, topic
    const std::string direction = c[2], of = c[4];
    if (direction == "i" && of == topic) found.insert(std::string(c[1]));
  }
  return found;
}

/// Tells this node of a topic's publishers, as a master does. Those that are not named would be given up.
void tellOfPublishers(const std::string& topic, std::set<std::string> publishers) {
  const std::optional<std::set<std::string>> connected = publishersOf(topic);
  if (!connected) return;
  publishers.insert(connected->begin(), connected->end());
  XmlRpc::XmlRpcValue arguments;
  arguments[1] = topic;
  arguments[2].setSize(static_cast<int>(publishers.size()));
  int count = 0;
  for (const std::string& publisher : publishers) arguments[2][count++] = publisher;
  askMyself("publisherUpdate", arguments);
}

}  // namespace

MasterWatch::MasterWatch(const std::string& parameters_of, double period_s)
    : parameters_of_(parameters_of), period_s_(period_s), thread_([this] { run(); }) {}

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
  std::unique_lock<std::mutex> lock(mutex_);
  do {
    lock.unlock();
    try {
      look();
    } catch (const XmlRpc::XmlRpcException& error) {  // no answer of a master's shape
      ROS_WARN_THROTTLE(60, "the ROS master's answer is not understood: %s", error.getMessage().c_str());
    }
    lock.lock();
  } while (!ended_.wait_for(lock, period, [this] { return stop_; }));
}

void MasterWatch::look() {
  if (!ros::isStarted() || ros::isShuttingDown()) return;
  if (!ros::master::check()) {
    if (!gone_) ROS_WARN("the ROS master is gone: connections that stand go on, new ones wait until it is back");
    gone_ = true;
    return;
  }
  // A master that does not know this node is another one than it was registered with.
  if (incomplete_ || !ask("lookupNode", {ros::this_node::getName()})) {
    incomplete_ = !registerAgain();
    if (incomplete_) return;
    ROS_WARN(
        "the ROS master was restarted: this node's topics, services and parameters are registered anew; programs that "
        "do not do so, as rviz, rosbag and most nodes of others, have to be started again");
  } else {
    if (gone_) ROS_INFO("the ROS master is back");
    remember();
  }
  gone_ = false;
}

void MasterWatch::remember() {
  XmlRpc::XmlRpcValue state;
  if (ask("getSystemState", {}, state)) {
    services_.clear();
    const XmlRpc::XmlRpcValue& services = state[kServices];
    for (int i = 0; i < services.size(); ++i) {
      const std::string name = services[i][0];
      if (ros::ServiceManager::instance()->lookupServicePublication(name)) services_.insert(name);
    }
  }
  XmlRpc::XmlRpcValue parameters;
  if (ask("getParam", {parameters_of_}, parameters)) parameters_ = parameters;
}

bool MasterWatch::registerAgain() const {
  setParameters();
  const bool topics = registerTopics();
  return registerServices() && topics;
}

bool MasterWatch::registerTopics() const {
  const std::string uri = ros::XMLRPCManager::instance()->getServerURI();
  bool all = true;
  ros::V_string topics;
  ros::this_node::getAdvertisedTopics(topics);
  for (const std::string& topic : topics) {
    const ros::PublicationPtr publication = ros::TopicManager::instance()->lookupPublication(topic);
    if (publication) all = ask("registerPublisher", {topic, publication->getDataType(), uri}) && all;
  }
  topics.clear();
  ros::this_node::getSubscribedTopics(topics);
  for (const std::string& topic : topics) {
    XmlRpc::XmlRpcValue publishers;
    all = ask("registerSubscriber", {topic, "*", uri}, publishers) && all;
    // Who has come before this node is told here and not again.
    std::set<std::string> found;
    for (int i = 0; publishers.getType() == XmlRpc::XmlRpcValue::TypeArray && i < publishers.size(); ++i) {
      if (std::string(publishers[i]) != uri) found.insert(std::string(publishers[i]));
    }
    if (!found.empty()) tellOfPublishers(topic, found);
  }
  return all;
}

bool MasterWatch::registerServices() const {
  const std::string own =
      "rosrpc://" + ros::network::getHost() + ":" + std::to_string(ros::ConnectionManager::instance()->getTCPPort());
  bool all = true;
  for (const std::string& service : services_) {
    if (!ros::ServiceManager::instance()->lookupServicePublication(service)) continue;
    all = ask("registerService", {service, own, ros::XMLRPCManager::instance()->getServerURI()}) && all;
  }
  return all;
}

void MasterWatch::setParameters() const {
  if (parameters_ && !ros::param::has(parameters_of_)) ros::param::set(parameters_of_, *parameters_);
  if (ros::Time::isSimTime() && !ros::param::has("/use_sim_time")) ros::param::set("/use_sim_time", true);
}

}  // namespace mmradartwin
