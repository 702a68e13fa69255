#include "twin_link.h"

#include <actionlib_msgs/GoalID.h>
#include <mmradartwin_msgs/ApplyTwin.h>
#include <mmradartwin_msgs/DiagnoseActionGoal.h>
#include <mmradartwin_msgs/ShowPose.h>
#include <std_srvs/SetBool.h>

#include <QFile>
#include <memory>
#include <utility>

namespace mmradartwin {
namespace {

constexpr const char* kPlayer = "player/pause_playback";
constexpr double kPlayerEvery_s = 2;
constexpr double kClockStands_s = 1;

}  // namespace

TwinLink::TwinLink(std::function<void()> on_change) : on_change_(std::move(on_change)) {
  hear("inspect/shown", shown_);
  hear("attribution/pose", pose_);
  hear("attribution/ledger", ledger_);
  hear("twin/range_angle", simulated_);
  hear("attribution/residual_map", residual_);
  hear("attribution/explanation", explanation_);
  hear("attribution/findings", findings_);
  hear("inspect/poses", stored_);
  poses_subscriber_ = subscribers_.back();
  hear("twin/scene", twin_);
  scene_subscriber_ = subscribers_.back();
  status_subscriber_ = nh_.subscribe("attribution/diagnose/status", 5, &TwinLink::onStatus, this);
  subscribers_.push_back(nh_.subscribe("attribution/diagnose/result", 5, &TwinLink::onResult, this));
  subscribers_.push_back(nh_.subscribe<mmradartwin_msgs::DiagnoseActionFeedback>(
      "attribution/diagnose/feedback", 5, [this](const mmradartwin_msgs::DiagnoseActionFeedback::ConstPtr& msg) {
        stage_ = QString::fromStdString(msg->feedback.stage);
        share_ = msg->feedback.share;
        on_change_();
      }));
  goal_ = nh_.advertise<mmradartwin_msgs::DiagnoseActionGoal>("attribution/diagnose/goal", 2);
  cancel_ = nh_.advertise<actionlib_msgs::GoalID>("attribution/diagnose/cancel", 2);
}

template <typename Message>
void TwinLink::hear(const std::string& topic, boost::shared_ptr<const Message>& kept) {
  subscribers_.push_back(nh_.subscribe<Message>(topic, 1, [this, &kept](const boost::shared_ptr<const Message>& msg) {
    kept = msg;
    on_change_();
  }));
}

TwinLink::Source TwinLink::source() const {
  if (poses_subscriber_.getNumPublishers() > 0) return Source::kStored;
  if (player_there_) return Source::kReplay;
  return scene_subscriber_.getNumPublishers() > 0 ? Source::kLive : Source::kNone;
}

QString TwinLink::whyNoPoses() const {
  switch (source()) {
    case Source::kStored:
      return "";
    case Source::kNone:
      return "no node answers: start inspect.launch, replay.launch or live.launch";
    case Source::kReplay:
      return "a replay goes on by itself; evaluate the bag, and inspect.launch steps through its poses";
    case Source::kLive:
      return "a live radar has no stored poses; inspect.launch steps through those of evaluate";
  }
  return "";
}

QString TwinLink::whyNoPlay() const {
  if (source() == Source::kStored || source() == Source::kReplay) return "";
  return source() == Source::kLive ? "a live radar cannot be stopped" : whyNoPoses();
}

QString TwinLink::whyNoDiagnosis() const {
  if (source() == Source::kStored) {
    return "stored results hold no frames; replay the bag, or run diagnose on the recording";
  }
  if (status_subscriber_.getNumPublishers() == 0) {
    return "diagnosis_node does not run; replay.launch and live.launch start it, unless diagnosis:=false";
  }
  return "";
}

QString TwinLink::whyNoApply() const {
  if (source() == Source::kStored) return "stored results are not simulated anew; evaluate --twin does";
  if (scene_subscriber_.getNumPublishers() == 0) return "no twin is simulated";
  if (extended_twin_file_.empty()) return "no diagnosis has found anything yet";
  return applied_ ? "is simulated" : "";
}

QString TwinLink::whyNoRevert() const { return applied_ ? "" : "the twin is the first one"; }

bool TwinLink::playing() const {
  if (source() == Source::kStored) return shown_ && shown_->playing;
  return player_runs_;
}

void TwinLink::say(const QString& words) {
  said_ = words;
  on_change_();
}

void TwinLink::showPose(const std::string& order, const std::string& pose, int step) {
  using Show = mmradartwin_msgs::ShowPose;
  Show::Request request;
  request.order = order;
  request.pose = pose;
  request.step = step;
  ++showing_;
  services_.callService<Show>("inspect/show", request, this, [this](bool reached, const Show::Response& response) {
    --showing_;
    const QString problem = response.success ? "" : QString::fromStdString(response.message);
    say(reached ? problem : "inspect/show does not answer");
  });
}

void TwinLink::play(bool on) {
  using Switch = std_srvs::SetBool;
  const bool stored = source() == Source::kStored;
  const std::string service = stored ? "inspect/play" : kPlayer;
  Switch::Request request;
  request.data = stored ? on : !on;  // the player's is whether to pause
  services_.callService<Switch>(
      service, request, this, [this, service](bool reached, const Switch::Response& response) {
        say(reached ? QString::fromStdString(response.message) : QString::fromStdString(service) + " does not answer");
      });
}

void TwinLink::diagnose() {
  mmradartwin_msgs::DiagnoseActionGoal goal;
  goal.header.stamp = ros::Time::now();
  goal.goal_id.stamp = goal.header.stamp;
  goal.goal_id.id = ros::this_node::getName() + "-" + std::to_string(ros::WallTime::now().toNSec());
  goal_.publish(goal);
  stage_ = "asked";
  share_ = 0;
  say("");
}

void TwinLink::cancelDiagnosis() {
  cancel_.publish(actionlib_msgs::GoalID());  // all there are
  say("the diagnosis is being cancelled");
}

void TwinLink::onStatus(const actionlib_msgs::GoalStatusArray::ConstPtr& msg) {
  using actionlib_msgs::GoalStatus;
  bool active = false;
  for (const GoalStatus& status : msg->status_list) {
    active = active || status.status == GoalStatus::PENDING || status.status == GoalStatus::ACTIVE ||
             status.status == GoalStatus::PREEMPTING || status.status == GoalStatus::RECALLING;
  }
  if (active == diagnosing_) return;
  diagnosing_ = active;
  on_change_();
}

void TwinLink::onResult(const mmradartwin_msgs::DiagnoseActionResult::ConstPtr& msg) {
  diagnosing_ = false;
  const bool done = msg->status.status == actionlib_msgs::GoalStatus::SUCCEEDED;
  if (done) {
    report_file_ = msg->result.report_file;
    extended_twin_file_ = msg->result.findings.findings.empty() ? "" : msg->result.extended_twin_file;
  }
  say(done ? QString("%1 poses at %2 places were judged").arg(msg->result.poses).arg(msg->result.locations)
           : QString::fromStdString(msg->status.text));
}

void TwinLink::apply() { applyTwin(extended_twin_file_, true); }

void TwinLink::revert() { applyTwin("", false); }

void TwinLink::applyTwin(const std::string& file, bool extended) {
  using Apply = mmradartwin_msgs::ApplyTwin;
  Apply::Request request;
  request.file = file;
  TwinFigures before = figures();
  before.label = extended ? "as given" : "with findings";
  services_.callService<Apply>("twin/apply", request, this,
                               [this, extended, before](bool reached, const Apply::Response& response) {
                                 if (reached && response.success) {
                                   applied_ = extended;
                                   changed_ = true;
                                   other_ = before;
                                 }
                                 say(reached ? QString::fromStdString(response.message) : "twin/apply does not answer");
                               });
}

QString TwinLink::saveTwin(const QString& name) const {
  if (!twin_ || twin_->twin_yaml.empty()) return "no twin is known";
  QFile file(name);
  const QByteArray text = QByteArray::fromStdString(twin_->twin_yaml);
  if (!file.open(QIODevice::WriteOnly) || file.write(text) != text.size() || !file.flush()) {
    return name + ": cannot be written: " + file.errorString();
  }
  return "";
}

QString TwinLink::reportFile() const {
  if (!report_file_.empty()) return QString::fromStdString(report_file_);
  return stored_ ? QString::fromStdString(stored_->report_file) : QString();
}

void TwinLink::look() {
  const ros::WallTime now = ros::WallTime::now();
  if (ros::Time::isSimTime()) {
    const ros::Time clock = ros::Time::now();
    if (clock != clock_) clock_moved_ = now;
    clock_ = clock;
    player_runs_ = (now - clock_moved_).toSec() < kClockStands_s;
  }
  if (!asked_for_player_ && (now - player_looked_).toSec() > kPlayerEvery_s) {
    asked_for_player_ = true;
    const auto there = std::make_shared<bool>(false);
    services_.call([there] { *there = ros::service::exists(kPlayer, false); }, this,
                   [this, there] {
                     player_there_ = *there;
                     player_looked_ = ros::WallTime::now();
                     asked_for_player_ = false;
                   });
  }
  on_change_();
}

}  // namespace mmradartwin
