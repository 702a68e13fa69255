#include "twin_panel.h"

#include <rviz/visualization_manager.h>

#include <QComboBox>
#include <QFileDialog>
#include <QGridLayout>
#include <QLabel>
#include <QProcess>
#include <QProgressBar>
#include <QPushButton>
#include <QSignalBlocker>
#include <QSplitter>
#include <QTabWidget>
#include <QTimer>
#include <QVBoxLayout>
#include <pluginlib/class_list_macros.hpp>
#include <utility>

#include "../disabled_letters.h"
#include "../words_panel.h"
#include "before_after.h"
#include "layer_list.h"
#include "panel_words.h"
#include "twin_link.h"

namespace mmradartwin {
namespace {

constexpr int kLookEvery_ms = 500;
constexpr int kShowWithin_ms = 50;

struct Order {
  const char *name, *words;
};
constexpr Order kOrders[] = {{"recorded", "as recorded"},
                             {"recall", "worst recall first"},
                             {"q1_energy", "worst Q1 first"},
                             {"q2_energy", "worst Q2 first"},
                             {"residual_rms_db", "greatest difference first"}};

/// Grey where there is a reason, which the pointer is told.
void allow(QWidget* widget, const QString& why_not, const QString& tip) {
  widget->setEnabled(why_not.isEmpty());
  widget->setToolTip(why_not.isEmpty() ? tip : why_not);
}

}  // namespace

TwinPanel::TwinPanel(QWidget* parent) : rviz::Panel(parent) {
  setObjectName("twin_panel");
  link_ = std::make_unique<TwinLink>([this] { showSoon(); });
  auto* all = new QVBoxLayout(this);
  all->setContentsMargins(4, 4, 4, 4);
  keepDisabledLettersReadable(*this);
  source_ = new QLabel;
  source_->setObjectName("source");
  source_->setWordWrap(true);
  all->addWidget(source_);
  all->addWidget(makePoses());
  figures_ = new WordsPanel("Figures");
  figures_->setObjectName("figures");
  why_ = new WordsPanel("Why?");
  why_->setObjectName("why");
  layers_ = new LayerList;
  auto* tabs = new QTabWidget;
  tabs->setObjectName("tabs");
  tabs->addTab(why_, "Why?");
  tabs->addTab(layers_, "Layers");
  tabs->addTab(makeDiagnosis(), "Diagnosis");
  auto* parts = new QSplitter(Qt::Vertical);
  parts->addWidget(figures_);
  parts->addWidget(tabs);
  parts->setStretchFactor(1, 1);
  parts->setSizes({200, 400});
  all->addWidget(parts, 1);
  said_ = new QLabel;
  said_->setObjectName("said");
  said_->setWordWrap(true);
  all->addWidget(said_);
  auto* timer = new QTimer(this);
  connect(timer, &QTimer::timeout, this, [this] { link_->look(); });
  timer->start(kLookEvery_ms);
}

TwinPanel::~TwinPanel() = default;

QPushButton* TwinPanel::button(const char* name, const QString& words, const QString& tip) {
  auto* made = new QPushButton(words);
  made->setObjectName(name);
  made->setToolTip(tip);
  made->setMinimumWidth(40);
  return made;
}

QWidget* TwinPanel::makePoses() {
  worst_ = button("worst", "Worst", "");
  previous_ = button("previous", "Previous", "");
  play_ = button("play", "Play", "");
  next_ = button("next", "Next", "");
  order_ = new QComboBox;
  order_->setObjectName("order");
  for (const Order& order : kOrders) order_->addItem(order.words, order.name);
  connect(worst_, &QPushButton::clicked, this, [this] { showWorst(); });
  connect(previous_, &QPushButton::clicked, this, [this] { link_->showPose("", "", -1); });
  connect(next_, &QPushButton::clicked, this, [this] { link_->showPose("", "", 1); });
  connect(play_, &QPushButton::clicked, this, [this] { link_->play(!link_->playing()); });
  connect(order_, static_cast<void (QComboBox::*)(int)>(&QComboBox::activated), this, [this](int index) {
    const std::string name = order_->itemData(index).toString().toStdString();
    link_->showPose(name, name == "recorded" ? "" : "first", 0);
  });
  auto* poses = new QWidget;
  auto* grid = new QGridLayout(poses);
  grid->setContentsMargins(0, 0, 0, 0);
  grid->setSpacing(3);
  int column = 0;
  for (QPushButton* b : {worst_, previous_, play_, next_}) grid->addWidget(b, 0, column++);
  grid->addWidget(order_, 1, 0, 1, 4);
  return poses;
}

QWidget* TwinPanel::makeDiagnosis() {
  diagnose_ = button("diagnose", "Diagnose", "");
  cancel_ = button("cancel", "Cancel", "");
  apply_ = button("apply", "Apply", "");
  revert_ = button("revert", "Revert", "");
  save_ = button("save", "Save twin…", "");
  save_->setText(QString::fromUtf8("Save twin…"));
  report_ = button("report", "Report", "");
  compare_ = button("before_after", "Before and after", "");
  progress_ = new QProgressBar;
  progress_->setObjectName("progress");
  progress_->setRange(0, 100);
  findings_ = new WordsPanel("Findings");
  findings_->setObjectName("findings");
  connect(diagnose_, &QPushButton::clicked, this, [this] { link_->diagnose(); });
  connect(cancel_, &QPushButton::clicked, this, [this] { link_->cancelDiagnosis(); });
  connect(apply_, &QPushButton::clicked, this, [this] { link_->apply(); });
  connect(revert_, &QPushButton::clicked, this, [this] { link_->revert(); });
  connect(save_, &QPushButton::clicked, this, [this] { saveTwin(); });
  connect(report_, &QPushButton::clicked, this, [this] { openReport(); });
  connect(compare_, &QPushButton::clicked, this, [this] { showBeforeAfter(true); });
  auto* diagnosis = new QWidget;
  auto* grid = new QGridLayout(diagnosis);
  grid->setContentsMargins(2, 4, 2, 2);
  grid->setSpacing(3);
  grid->addWidget(diagnose_, 0, 0);
  grid->addWidget(cancel_, 0, 1);
  grid->addWidget(report_, 0, 2);
  grid->addWidget(progress_, 1, 0, 1, 3);
  grid->addWidget(findings_, 2, 0, 1, 3);
  grid->addWidget(apply_, 3, 0);
  grid->addWidget(revert_, 3, 1);
  grid->addWidget(save_, 3, 2);
  grid->addWidget(compare_, 4, 0, 1, 3);
  grid->setRowStretch(2, 1);
  return diagnosis;
}

void TwinPanel::showSoon() {
  if (std::exchange(due_, true)) return;
  QTimer::singleShot(kShowWithin_ms, this, [this] { show(); });
}

void TwinPanel::show() {
  due_ = false;
  showPoses();
  figures_->setWords(wordsOf(link_->figures(), link_->otherFigures()));
  why_->setWords(wordsOf(link_->explanation()));
  showDiagnosis();
  const bool first_change = link_->changed() && !std::exchange(was_changed_, link_->changed());
  showBeforeAfter(first_change);
  said_->setText(link_->said());
  said_->setVisible(!link_->said().isEmpty());
  if (vis_manager_ && layers_->isVisible()) layers_->follow(*vis_manager_->getRootDisplayGroup());
}

void TwinPanel::showPoses() {
  using Source = TwinLink::Source;
  const Source source = link_->source();
  const mmradartwin_msgs::ShownPose* shown = link_->shown();
  QString words = source == Source::kLive     ? "<b>live</b>"
                  : source == Source::kReplay ? "<b>replay</b>"
                  : source == Source::kStored ? "<b>stored results</b>"
                                              : "no node answers yet";
  if (source == Source::kStored && shown) {
    words += QString::fromUtf8(" · pose <b>%1</b>, %2 of %3")
                 .arg(QString::fromStdString(shown->name).toHtmlEscaped())
                 .arg(shown->rank + 1)
                 .arg(shown->count);
    const QSignalBlocker quiet(order_);
    const int index = order_->findData(QString::fromStdString(shown->order));
    if (!link_->showing()) order_->setCurrentIndex(index);  // else it is about to become what was chosen
  }
  source_->setText(words);
  const QString why_not = link_->whyNoPoses();
  allow(worst_, why_not, "the worst pose: by the order below, or by recall");
  allow(previous_, why_not, "the pose before");
  allow(next_, why_not, "the next pose");
  allow(order_, why_not, "the order of the poses");
  allow(play_, link_->whyNoPlay(), link_->playing() ? "stop here" : "go on by itself");
  play_->setText(link_->playing() ? "Pause" : "Play");
}

void TwinPanel::showDiagnosis() {
  const bool runs = link_->diagnosing();
  const QString why_not = link_->whyNoDiagnosis();
  allow(diagnose_, runs ? "one is being made" : why_not,
        "find out what the twin gets wrong about the poses seen so far");
  allow(cancel_, runs ? "" : "no diagnosis is being made", "end it early; nothing is written then");
  allow(apply_, link_->whyNoApply(), "simulate with what was found");
  allow(revert_, link_->whyNoRevert(), "simulate the twin as it was given");
  allow(save_, link_->twin() ? "" : "no twin is known", "write the twin that is simulated into a twin.yaml");
  allow(report_, link_->reportFile().isEmpty() ? "there is no report yet" : "", link_->reportFile());
  allow(compare_, link_->changed() ? "" : "apply what was found, first",
        "maps and residuals of the twin as given and with what was found, side by side");
  progress_->setVisible(runs);
  progress_->setValue(static_cast<int>(100 * link_->share()));
  progress_->setFormat(link_->stage() + " %p %");
  findings_->setWords(wordsOf(link_->findings()));
}

void TwinPanel::showBeforeAfter(bool open) {
  if (open && !before_after_) {
    before_after_ = new BeforeAfter(this);
    before_after_->move(window()->geometry().center() - before_after_->rect().center());  // the panel stays in sight
  }
  if (open) before_after_->show();
  if (!before_after_ || !before_after_->isVisible()) return;
  const TwinFigures now = link_->figures(), other = link_->otherFigures();
  before_after_->showTwins(link_->applied() ? other : now, link_->applied() ? now : other);
}

void TwinPanel::showWorst() {
  const mmradartwin_msgs::ShownPose* shown = link_->shown();
  link_->showPose(!shown || shown->order == "recorded" ? "recall" : "", "first", 0);
}

void TwinPanel::saveTwin() {
  auto* dialog = new QFileDialog(this, "Save the twin that is simulated", QString(), "twin (*.yaml)");
  dialog->setObjectName("save_dialog");
  dialog->setAttribute(Qt::WA_DeleteOnClose);
  dialog->setOption(QFileDialog::DontUseNativeDialog);
  dialog->setAcceptMode(QFileDialog::AcceptSave);
  dialog->setDefaultSuffix("yaml");
  dialog->selectFile("twin.yaml");
  connect(dialog, &QFileDialog::fileSelected, this, [this](const QString& file) {
    const QString problem = link_->saveTwin(file);
    link_->say(problem.isEmpty() ? "written: " + file : problem);
  });
  dialog->open();
}

void TwinPanel::openReport() {
  if (!QProcess::startDetached("xdg-open", {link_->reportFile()})) {
    link_->say("xdg-open does not start; the report is " + link_->reportFile());
  }
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::TwinPanel, rviz::Panel)
