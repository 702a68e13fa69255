#pragma once

#include <actionlib_msgs/GoalStatusArray.h>
#include <mmradartwin_msgs/DiagnoseActionFeedback.h>
#include <mmradartwin_msgs/DiagnoseActionResult.h>
#include <mmradartwin_msgs/Explanation.h>
#include <mmradartwin_msgs/Findings.h>
#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/PoseFigures.h>
#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/Scene.h>
#include <mmradartwin_msgs/ShownPose.h>
#include <mmradartwin_msgs/StoredPoses.h>
#include <ros/ros.h>

#include <QObject>
#include <QString>
#include <functional>
#include <string>
#include <vector>

#include "../service_thread.h"

namespace mmradartwin {

/// RangeAngleMap::source of a residual.
constexpr std::uint8_t kResidualSource = 2;

/// The table of one twin, and its maps.
struct TwinFigures {
  QString label;
  mmradartwin_msgs::PoseFigures::ConstPtr pose;
  mmradartwin_msgs::Ledger::ConstPtr all;
  mmradartwin_msgs::RangeAngleMap::ConstPtr simulated, residual;
};

/// The panel's side of the graph: what it hears of the nodes, and what it asks them for. `on_change` is called in the
/// window's thread after each message and answer.
class TwinLink : public QObject {
 public:
  enum class Source { kNone, kStored, kReplay, kLive };

  explicit TwinLink(std::function<void()> on_change);

  Source source() const;
  /// Why something cannot be done now; empty where it can.
  QString whyNoPoses() const;
  QString whyNoPlay() const;
  QString whyNoDiagnosis() const;
  QString whyNoApply() const;
  QString whyNoRevert() const;

  /// `pose` and `step` as in ShowPose; `order` empty: as before.
  void showPose(const std::string& order, const std::string& pose, int step);
  /// A call of showPose() has no answer yet.
  bool showing() const { return showing_ > 0; }
  void play(bool on);
  void diagnose();
  void cancelDiagnosis();
  /// The extended twin of the last diagnosis.
  void apply();
  void revert();
  /// Empty, or why the file was not written.
  QString saveTwin(const QString& file) const;
  QString reportFile() const;

  const mmradartwin_msgs::StoredPoses* stored() const { return stored_.get(); }
  const mmradartwin_msgs::ShownPose* shown() const { return shown_.get(); }
  const mmradartwin_msgs::Explanation* explanation() const { return explanation_.get(); }
  const mmradartwin_msgs::Findings* findings() const { return findings_.get(); }
  const mmradartwin_msgs::Scene* twin() const { return twin_.get(); }
  TwinFigures figures() const { return {QString(), pose_, ledger_, simulated_, residual_}; }
  /// Of the twin before the last change; without maps and figures where there was none.
  const TwinFigures& otherFigures() const { return other_; }
  bool playing() const;
  bool diagnosing() const { return diagnosing_; }
  /// The twin has been changed by apply(), and perhaps back.
  bool changed() const { return changed_; }
  bool applied() const { return applied_; }
  QString stage() const { return stage_; }
  double share() const { return share_; }
  /// What was answered last, in words.
  QString said() const { return said_; }
  void say(const QString& words);

  /// Looks at what answers; the panel calls it some times a second.
  void look();

 private:
  template <typename Message>
  void hear(const std::string& topic, boost::shared_ptr<const Message>& kept);
  void onStatus(const actionlib_msgs::GoalStatusArray::ConstPtr& msg);
  void onResult(const mmradartwin_msgs::DiagnoseActionResult::ConstPtr& msg);
  void applyTwin(const std::string& file, bool extended);

  std::function<void()> on_change_;
  ros::NodeHandle nh_;
  ServiceThread services_;
  std::vector<ros::Subscriber> subscribers_;
  ros::Subscriber poses_subscriber_, scene_subscriber_, status_subscriber_;
  ros::Publisher goal_, cancel_;
  mmradartwin_msgs::StoredPoses::ConstPtr stored_;
  mmradartwin_msgs::ShownPose::ConstPtr shown_;
  mmradartwin_msgs::PoseFigures::ConstPtr pose_;
  mmradartwin_msgs::Ledger::ConstPtr ledger_;
  mmradartwin_msgs::RangeAngleMap::ConstPtr simulated_, residual_;
  mmradartwin_msgs::Explanation::ConstPtr explanation_;
  mmradartwin_msgs::Findings::ConstPtr findings_;
  mmradartwin_msgs::Scene::ConstPtr twin_;
  TwinFigures other_;
  std::string report_file_, extended_twin_file_;
  bool diagnosing_ = false, applied_ = false, changed_ = false, player_there_ = false, player_runs_ = false;
  bool asked_for_player_ = false;
  int showing_ = 0;
  ros::WallTime player_looked_;
  ros::Time clock_;
  ros::WallTime clock_moved_;
  QString stage_, said_;
  double share_ = 0;
};

}  // namespace mmradartwin
