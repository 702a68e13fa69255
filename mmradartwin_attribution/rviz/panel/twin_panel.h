#pragma once

#include <rviz/panel.h>

#include <memory>

class QComboBox;
class QLabel;
class QProgressBar;
class QPushButton;

namespace mmradartwin {

class BeforeAfter;
class LayerList;
class TwinLink;
class WordsPanel;

/// rviz panel "Twin": which pose is shown and how well the twin explains it, what stands behind a place, what is drawn,
/// and the diagnosis. It asks the nodes for all of it; what they cannot do is grey, and says why under the pointer.
class TwinPanel : public rviz::Panel {
 public:
  explicit TwinPanel(QWidget* parent = nullptr);
  ~TwinPanel() override;

 private:
  QWidget* makePoses();
  QWidget* makeDiagnosis();
  QPushButton* button(const char* name, const QString& words, const QString& tip);
  /// Has what changed shown soon, several changes as one.
  void showSoon();
  void show();
  void showPoses();
  void showDiagnosis();
  /// Opens the window where `open`, and draws it anew where it is open.
  void showBeforeAfter(bool open);
  void showWorst();
  void saveTwin();
  void openReport();

  std::unique_ptr<TwinLink> link_;
  QLabel *source_ = nullptr, *said_ = nullptr;
  QComboBox* order_ = nullptr;
  QPushButton *worst_ = nullptr, *previous_ = nullptr, *play_ = nullptr, *next_ = nullptr;
  QPushButton *diagnose_ = nullptr, *cancel_ = nullptr, *apply_ = nullptr, *revert_ = nullptr, *save_ = nullptr,
              *report_ = nullptr, *compare_ = nullptr;
  QProgressBar* progress_ = nullptr;
  WordsPanel *figures_ = nullptr, *why_ = nullptr, *findings_ = nullptr;
  LayerList* layers_ = nullptr;
  BeforeAfter* before_after_ = nullptr;
  bool was_changed_ = false;
  bool due_ = false;
};

}  // namespace mmradartwin
