#include "what_if_panel.h"

#include <mmradartwin_msgs/SaveTwin.h>
#include <std_srvs/Trigger.h>

#include <QCheckBox>
#include <QComboBox>
#include <QFileDialog>
#include <QHBoxLayout>
#include <QHeaderView>
#include <QScrollArea>
#include <QSignalBlocker>
#include <QSplitter>
#include <QTabWidget>
#include <QVBoxLayout>
#include <cmath>
#include <pluginlib/class_list_macros.hpp>

#include "../disabled_letters.h"

namespace mmradartwin {
namespace {

constexpr double kFarthest_m = 5;  // that knobs move an actor; a handle in the room moves it farther

QString share(double value) { return std::isnan(value) ? "–" : QString::number(100 * value, 'f', 1) + " %"; }
QString decibel(double value) { return std::isnan(value) ? "–" : QString::number(value, 'f', 2) + " dB"; }

QString row(const QString& name, const QString& given, const QString& now) {
  const QString weight = given == now ? "normal" : "bold";
  return "<tr><td>" + name + "</td><td align=right style='padding-left:12px'>" + given +
         "</td><td align=right style='padding-left:12px;font-weight:" + weight + "'>" + now + "</td></tr>";
}

/// In a scroll area, so that the panel may be low.
QWidget* scrolled(QWidget* inside) {
  auto* area = new QScrollArea;
  area->setWidget(inside);
  area->setWidgetResizable(true);
  area->setFrameShape(QFrame::NoFrame);
  return area;
}

}  // namespace

WhatIfPanel::WhatIfPanel(QWidget* parent) : rviz::Panel(parent) {
  auto* all = new QVBoxLayout(this);
  setObjectName("what_if_panel");
  keepDisabledLettersReadable(*this);
  numbers_ = new QLabel;
  numbers_->setObjectName("numbers");
  numbers_->setTextFormat(Qt::RichText);
  words_ = new QLabel("waiting for what_if_node");
  words_->setObjectName("words");
  words_->setWordWrap(true);
  answer_ = new QLabel;
  answer_->setObjectName("answer");
  answer_->setWordWrap(true);
  auto* buttons = new QHBoxLayout;
  const auto button = [&](const char* name, const QString& text, const QString& tip) {
    auto* made = new QPushButton(text);
    made->setObjectName(name);
    made->setToolTip(tip);
    buttons->addWidget(made);
    return made;
  };
  undo_ = button("undo", "Undo", "take the last change back");
  revert_ = button("revert", "Revert", "back to the twin as given");
  save_ = button("save", "Save ...", "write twin.yaml, and scene.yaml where materials changed");
  auto* tabs = new QTabWidget;
  tabs->setObjectName("tabs");
  tabs->addTab(makeActors(), "Actors");
  tabs->addTab(makeMechanisms(), "Mechanisms");
  tabs->addTab(makeRadar(), "Radar");
  all->addWidget(numbers_);
  all->addWidget(words_);
  all->addLayout(buttons);
  all->addWidget(answer_);
  all->addWidget(tabs, 1);

  connect(undo_, &QPushButton::clicked, [this] { send<std_srvs::Trigger>("what_if/undo", {}); });
  connect(revert_, &QPushButton::clicked, [this] { send<std_srvs::Trigger>("what_if/revert", {}); });
  connect(save_, &QPushButton::clicked, [this] {
    const QString folder = QFileDialog::getExistingDirectory(this, "Folder of the twin: an empty one", QString(),
                                                             QFileDialog::ShowDirsOnly);
    if (folder.isEmpty()) return;
    mmradartwin_msgs::SaveTwin::Request request;
    request.folder = folder.toStdString();
    send<mmradartwin_msgs::SaveTwin>("what_if/save", request);
  });
  subscriber_ = nh_.subscribe("what_if/state", 1, &WhatIfPanel::onState, this);
}

WhatIfPanel::~WhatIfPanel() { subscriber_.shutdown(); }

QWidget* WhatIfPanel::makeActors() {
  actors_ = new QTableWidget(0, 3);
  actors_->setObjectName("actors");
  actors_->setHorizontalHeaderLabels({"actor", "material", "hide"});
  actors_->horizontalHeader()->setSectionResizeMode(0, QHeaderView::Stretch);
  for (int column : {1, 2}) actors_->horizontalHeader()->setSectionResizeMode(column, QHeaderView::ResizeToContents);
  actors_->verticalHeader()->hide();
  actors_->setSelectionBehavior(QAbstractItemView::SelectRows);
  actors_->setSelectionMode(QAbstractItemView::SingleSelection);
  actors_->setEditTriggers(QAbstractItemView::NoEditTriggers);
  connect(actors_, &QTableWidget::itemSelectionChanged, [this] { showActor(); });
  const auto place = [this](double, bool continues) { sendPlace(continues); };
  x_m_ = new ValueKnob("x_m", -kFarthest_m, kFarthest_m, place);
  y_m_ = new ValueKnob("y_m", -kFarthest_m, kFarthest_m, place);
  yaw_deg_ = new ValueKnob("yaw_deg", -180, 180, place);
  for (ValueKnob* knob : {x_m_, y_m_, yaw_deg_}) knob->show(0);
  auto* form = new QWidget;
  auto* rows = new QFormLayout(form);
  rows->addRow("moved along x [m]", x_m_);
  rows->addRow("moved along y [m]", y_m_);
  rows->addRow("turned [deg]", yaw_deg_);
  auto* material = new QWidget;
  material_form_ = new QFormLayout(material);
  material_form_->setContentsMargins(0, 0, 0, 0);
  material_form_->setRowWrapPolicy(QFormLayout::WrapAllRows);  // a panel is narrow
  rows->addRow(material);
  auto* halves = new QSplitter(Qt::Vertical);
  halves->addWidget(actors_);
  halves->addWidget(scrolled(form));
  return halves;
}

QWidget* WhatIfPanel::makeMechanisms() {
  mechanisms_ = new QListWidget;
  mechanisms_->setObjectName("mechanisms");
  connect(mechanisms_, &QListWidget::currentRowChanged, [this] { showMechanism(); });
  connect(mechanisms_, &QListWidget::itemChanged, [this](QListWidgetItem* item) {
    const auto row = static_cast<std::size_t>(mechanisms_->row(item));
    if (!state_ || row >= state_->mechanisms.size()) return;
    Edit edit;
    edit.kind = Edit::MECHANISM;
    edit.mechanism = state_->mechanisms[row].name;
    edit.entry = state_->mechanisms[row].entry;
    edit.enabled = item->checkState() == Qt::Checked;
    // One that asks for something in the room is about the chosen actor.
    if (const auto* actor = chosenActor(); actor && edit.enabled && state_->mechanisms[row].subject.empty()) {
      edit.actor = state_->mechanisms[row].given ? "" : actor->name;
    }
    sendEdit("", edit);
  });
  auto* form = new QWidget;
  mechanism_form_ = new QFormLayout(form);
  mechanism_form_->setRowWrapPolicy(QFormLayout::WrapAllRows);
  auto* halves = new QSplitter(Qt::Vertical);
  halves->addWidget(mechanisms_);
  halves->addWidget(scrolled(form));
  return halves;
}

QWidget* WhatIfPanel::makeRadar() {
  const auto send = [this](double, bool continues) { sendRadar(continues); };
  forward_m_ = new ValueKnob("forward_m", -1, 1, send);
  left_m_ = new ValueKnob("left_m", -1, 1, send);
  radar_yaw_deg_ = new ValueKnob("radar_yaw_deg", -180, 180, send);
  radar_pitch_deg_ = new ValueKnob("radar_pitch_deg", -45, 45, send);
  for (ValueKnob* knob : {forward_m_, left_m_, radar_yaw_deg_, radar_pitch_deg_}) knob->show(0);
  auto* form = new QWidget;
  auto* rows = new QFormLayout(form);
  rows->addRow("forward [m]", forward_m_);
  rows->addRow("to the left [m]", left_m_);
  rows->addRow("turned to the left [deg]", radar_yaw_deg_);
  rows->addRow("nose down [deg]", radar_pitch_deg_);
  return form;
}

template <typename Service>
void WhatIfPanel::send(const std::string& service, const typename Service::Request& request, const std::string& knob) {
  services_.callService<Service>(
      service, request, this,
      [this, service](bool reached, const typename Service::Response& response) {
        say(reached && response.success,
            QString::fromStdString(reached ? response.message
                                           : "nobody offers " + service + ": is what_if_node running?"));
      },
      knob);
}

void WhatIfPanel::sendEdit(const std::string& knob, const Edit& edit) {
  // The first of a drag begins a step of undo, and is not replaced.
  send<mmradartwin_msgs::EditTwin>("what_if/edit", edit, edit.continues ? knob : "");
}

void WhatIfPanel::say(bool success, const QString& message) {
  answer_->setText(message);
  answer_->setStyleSheet(success ? "" : "color: #b00020");
}

const mmradartwin_msgs::WhatIfActor* WhatIfPanel::chosenActor() const {
  const int row = actors_->currentRow();
  return state_ && row >= 0 && row < static_cast<int>(state_->actors.size())
             ? &state_->actors[static_cast<std::size_t>(row)]
             : nullptr;
}

const mmradartwin_msgs::WhatIfMechanism* WhatIfPanel::chosenMechanism() const {
  const int row = mechanisms_->currentRow();
  return state_ && row >= 0 && row < static_cast<int>(state_->mechanisms.size())
             ? &state_->mechanisms[static_cast<std::size_t>(row)]
             : nullptr;
}

void WhatIfPanel::sendPlace(bool continues) {
  const auto* actor = chosenActor();
  if (!actor) return;
  Edit edit;
  edit.kind = Edit::MOVE;
  edit.actor = actor->name;
  edit.shift_m = {x_m_->box().value(), y_m_->box().value(), actor->shift_m[2]};
  edit.yaw_deg = yaw_deg_->box().value();
  edit.continues = static_cast<std::uint8_t>(continues);
  sendEdit("place " + actor->name, edit);
}

void WhatIfPanel::sendRadar(bool continues) {
  Edit edit;
  edit.kind = Edit::RADAR;
  edit.shift_m = {forward_m_->box().value(), left_m_->box().value(), 0};
  edit.yaw_deg = radar_yaw_deg_->box().value();
  edit.pitch_deg = radar_pitch_deg_->box().value();
  edit.continues = static_cast<std::uint8_t>(continues);
  sendEdit("radar", edit);
}

void WhatIfPanel::onState(const mmradartwin_msgs::WhatIf::ConstPtr& state) {
  state_ = state;
  showNumbers();
  showActors();
  showMechanisms();
}

void WhatIfPanel::showNumbers() {
  const auto &g = state_->given, &n = state_->now;
  numbers_->setText(
      "<table><tr><td></td><td align=right style='padding-left:12px'>as given</td>"
      "<td align=right style='padding-left:12px'>what if</td></tr>" +
      row("explained power", share(g.explained_power), share(n.explained_power)) +
      row("recall", share(g.recall), share(n.recall)) +
      row("Q1: only measured", share(g.q1_energy), share(n.q1_energy)) +
      row("Q2: only simulated", share(g.q2_energy), share(n.q2_energy)) +
      row("Q3: level, median", decibel(g.q3_median_db), decibel(n.q3_median_db)) + "</table>");
  QString words = QString::fromStdString(state_->problem);
  if (words.isEmpty()) {
    words = state_->edits.empty() ? "nothing is changed"
                                  : QString("%1 change(s), the last: %2; shown after %3 ms (%4)")
                                        .arg(state_->edits.size())
                                        .arg(QString::fromStdString(state_->edits.back()))
                                        .arg(state_->shown_ms, 0, 'f', 0)
                                        .arg(state_->traced ? "traced" : "weighed");
    if (!state_->pose.empty()) words = "pose " + QString::fromStdString(state_->pose) + ": " + words;
  }
  words_->setText(words);
  undo_->setEnabled(!state_->actors.empty());
  revert_->setEnabled(!state_->edits.empty());
  revert_->setToolTip(state_->edits.empty() ? "the twin is as it was given" : "back to the twin as given");
  save_->setEnabled(!state_->actors.empty());
}

void WhatIfPanel::showActors() {
  const int rows = static_cast<int>(state_->actors.size());
  QStringList materials;
  for (const std::string& name : state_->materials) materials << QString::fromStdString(name);
  const bool same = rows == actors_->rowCount() &&
                    (rows == 0 || actors_->item(0, 0)->text().toStdString() == state_->actors.front().name);
  if (!same) {
    const QSignalBlocker quiet(actors_);
    actors_->setRowCount(rows);
    for (int i = 0; i < rows; ++i) {
      const QString name = QString::fromStdString(state_->actors[static_cast<std::size_t>(i)].name);
      actors_->setItem(i, 0, new QTableWidgetItem(name));
      auto* material = new QComboBox;
      material->setObjectName("material " + name);
      connect(material, QOverload<int>::of(&QComboBox::activated), [this, name, material] {
        Edit edit;
        edit.kind = Edit::MATERIAL;
        edit.actor = name.toStdString();
        edit.material = material->currentText().toStdString();
        sendEdit("", edit);
      });
      actors_->setCellWidget(i, 1, material);
      auto* hide = new QCheckBox;
      hide->setObjectName("hide " + name);
      connect(hide, &QCheckBox::clicked, [this, name](bool hidden) {
        Edit edit;
        edit.kind = Edit::HIDE;
        edit.actor = name.toStdString();
        edit.enabled = static_cast<std::uint8_t>(hidden);
        sendEdit("", edit);
      });
      actors_->setCellWidget(i, 2, hide);
    }
    actors_->resizeRowsToContents();
  }
  for (int i = 0; i < rows; ++i) {
    const auto& actor = state_->actors[static_cast<std::size_t>(i)];
    auto* material = static_cast<QComboBox*>(actors_->cellWidget(i, 1));
    const QSignalBlocker quiet(material);
    if (material->count() != materials.size()) {
      material->clear();
      material->addItems(materials);
    }
    material->setCurrentText(QString::fromStdString(actor.material));
    static_cast<QCheckBox*>(actors_->cellWidget(i, 2))->setChecked(actor.hidden);
  }
  showActor();
}

void WhatIfPanel::fill(QFormLayout& form, std::map<std::string, ValueKnob*>& knobs,
                       const std::vector<mmradartwin_msgs::WhatIfParameter>& numbers, const QString& prefix,
                       const std::function<void(const std::string&, double, bool)>& on_change) {
  while (form.rowCount() > 0) form.removeRow(0);
  knobs.clear();
  for (const auto& p : numbers) {
    auto* knob =
        new ValueKnob(prefix + QString::fromStdString(p.key), p.min, p.max,
                      [key = p.key, on_change](double value, bool continues) { on_change(key, value, continues); });
    knob->setToolTip(QString::fromStdString(p.meaning));
    const QString unit = p.unit.empty() || p.unit == "1" ? "" : " [" + QString::fromStdString(p.unit) + "]";
    form.addRow(QString::fromStdString(p.key) + unit, knob);
    knobs[p.key] = knob;
  }
}

void WhatIfPanel::showActor() {
  const auto* actor = chosenActor();
  for (ValueKnob* knob : {x_m_, y_m_, yaw_deg_}) knob->setEnabled(actor != nullptr);
  if (!actor) return;
  x_m_->show(actor->shift_m[0]);
  y_m_->show(actor->shift_m[1]);
  yaw_deg_->show(actor->yaw_deg);
  QString of = QString::fromStdString(actor->name);
  for (const auto& p : actor->material_values) of += " " + QString::fromStdString(p.key);
  if (of != material_of_) {
    material_of_ = of;
    fill(*material_form_, material_knobs_, actor->material_values, "material ",
         [this, name = actor->name](const std::string& key, double value, bool continues) {
           Edit edit;
           edit.kind = Edit::MATERIAL_VALUE;
           edit.actor = name;
           edit.key = key;
           edit.value = value;
           edit.continues = static_cast<std::uint8_t>(continues);
           sendEdit("value " + name + " " + key, edit);
         });
  }
  for (const auto& p : actor->material_values) material_knobs_.at(p.key)->show(p.value);
}

void WhatIfPanel::showMechanisms() {
  const int rows = static_cast<int>(state_->mechanisms.size());
  const QSignalBlocker quiet(mechanisms_);
  while (mechanisms_->count() > rows) delete mechanisms_->takeItem(mechanisms_->count() - 1);
  for (int i = 0; i < rows; ++i) {
    const auto& m = state_->mechanisms[static_cast<std::size_t>(i)];
    QString text = QString::fromStdString(m.name);
    if (!m.subject.empty()) text += " (" + QString::fromStdString(m.subject) + ")";
    if (i >= mechanisms_->count()) mechanisms_->addItem(text);
    QListWidgetItem* item = mechanisms_->item(i);
    item->setText(text);
    item->setFlags(item->flags() | Qt::ItemIsUserCheckable);
    item->setCheckState(m.on ? Qt::Checked : Qt::Unchecked);
  }
  showMechanism();
}

void WhatIfPanel::showMechanism() {
  const auto* m = chosenMechanism();
  const QString of = m ? QString::fromStdString(m->name + " " + std::to_string(m->entry)) : "";
  if (of != mechanism_of_) {
    mechanism_of_ = of;
    fill(*mechanism_form_, mechanism_knobs_, m ? m->parameters : std::vector<mmradartwin_msgs::WhatIfParameter>(),
         "mechanism ",
         [this, of, m_name = m ? m->name : "", entry = m ? m->entry : 0U](const std::string& key, double value,
                                                                          bool continues) {
           Edit edit;
           edit.kind = Edit::PARAMETER;
           edit.mechanism = m_name;
           edit.entry = entry;
           edit.key = key;
           edit.value = value;
           edit.continues = static_cast<std::uint8_t>(continues);
           sendEdit("parameter " + of.toStdString() + " " + key, edit);
         });
  }
  if (!m) return;
  for (const auto& p : m->parameters) {
    mechanism_knobs_.at(p.key)->setEnabled(m->on);
    mechanism_knobs_.at(p.key)->show(p.value);
  }
}

}  // namespace mmradartwin

PLUGINLIB_EXPORT_CLASS(mmradartwin::WhatIfPanel, rviz::Panel)
