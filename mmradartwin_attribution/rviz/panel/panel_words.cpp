#include "panel_words.h"

#include <QStringList>
#include <algorithm>
#include <cmath>

#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {
namespace {

constexpr int kMostPaths = 12;

QString plain(const std::string& text) { return QString::fromStdString(text).toHtmlEscaped(); }

/// Names as they are spoken.
QString spokenName(const std::string& name) { return plain(name).replace(';', " + ").replace('_', ' '); }

QString number(double value, int digits) {
  if (!std::isfinite(value)) return QString::fromUtf8("–");
  return QString::number(value, 'f', digits).replace('-', QChar(0x2212));
}

/// As many digits as tell it from its interval's ends.
QString measured(double value) {
  if (!std::isfinite(value)) return QString::fromUtf8("–");
  return QString::number(value, 'g', 4).replace('-', QChar(0x2212));
}

/// In dB; a dash where there is none.
QString level(double value) { return std::isfinite(value) ? number(value, 1) + " dB" : number(value, 1); }

QString percent(double share) { return std::isfinite(share) ? number(100 * share, 0) + " %" : number(share, 0); }

QString right(const QString& words) {
  return "<td align='right' style='white-space: nowrap'>&nbsp;" + words + "&nbsp;</td>";
}

QString head(const QString& words) {
  return "<th align='right' style='white-space: nowrap'>&nbsp;" + words + "&nbsp;</th>";
}

QString line(const QString& label, const QStringList& cells) {
  QString html = "<tr><td style='white-space: nowrap'>" + label + "</td>";
  for (const QString& c : cells) html += right(c);
  return html + "</tr>";
}

/// Figures of the columns, each nullptr where it has none.
using Columns = std::vector<const mmradartwin_msgs::Ledger*>;

template <typename Text>
QString figureLine(const QString& label, const Columns& columns, Text text) {
  QStringList cells;
  for (const mmradartwin_msgs::Ledger* column : columns) cells << (column ? text(*column) : QString::fromUtf8("–"));
  return line(label, cells);
}

QString rowOf(const mmradartwin_msgs::PathShare& path) {
  QStringList actors;
  for (const std::string& actor : path.actors) actors << spokenName(actor);
  return "<tr><td>" + plain(path.event) + "&nbsp;&nbsp;</td><td>" + actors.join(QString::fromUtf8(" → ")) + "</td>" +
         right(number(path.level_db, 1)) + right(number(1e9 * path.delay_s, 2)) +
         right(number(path.azimuth_rad * 180 / M_PI, 1) + QChar(0xb0)) + right(percent(path.share)) + "</tr>";
}

QString kindWords(const std::string& kind) {
  if (kind.size() == 2 && kind[0] == 'C' && kind[1] >= '1' && kind[1] <= '5') {
    return plain(kind + " " + classLabel(static_cast<ResidualClass>(kind[1] - '0')));
  }
  if (kind == "matched") return "agrees";
  if (kind == "measured") return "strong in the measurement alone";
  if (kind == "simulated") return "strong in the twin alone";
  return kind == "both" ? "strong in both" : "quiet";
}

QString parameterWords(const mmradartwin_msgs::FindingParameter& p) {
  QStringList values;
  for (std::size_t i = 0; i < p.value.size(); ++i) {
    QString words = measured(p.value[i]);
    if (i < p.ci95_low.size() && i < p.ci95_high.size()) {
      words += QString::fromUtf8(" (%1 … %2)").arg(measured(p.ci95_low[i]), measured(p.ci95_high[i]));
    }
    values << words;
  }
  for (const std::string& text : p.text) values << plain(text);
  // "range_m" in metres is "range".
  std::string name = p.name;
  const std::string end = "_" + QString::fromStdString(p.unit).toLower().toStdString();
  if (name.size() > end.size() && name.compare(name.size() - end.size(), end.size(), end) == 0) {
    name.resize(name.size() - end.size());
  }
  QString words = spokenName(name) + " <b>" + values.join(", ") + "</b>";
  if (!p.unit.empty() && p.unit != "1") words += " " + plain(p.unit);
  return words;
}

QString placeWords(const mmradartwin_msgs::FindingPlace& place) {
  QStringList words;
  for (const std::string& actor : place.actors) words << spokenName(actor);
  if (std::isfinite(place.x_m) && std::isfinite(place.y_m)) {
    words << QString("x %1 m, y %2 m").arg(number(place.x_m, 2), number(place.y_m, 2));
  }
  if (std::isfinite(place.range_min_m)) {
    words << QString::fromUtf8("%1 to %2 m from the radar")
                 .arg(number(place.range_min_m, 2), number(place.range_max_m, 2));
  }
  if (std::isfinite(place.azimuth_min_rad)) {
    words << QString::fromUtf8("%1° to %2°")
                 .arg(number(place.azimuth_min_rad * 180 / M_PI, 0), number(place.azimuth_max_rad * 180 / M_PI, 0));
  }
  if (!place.poses.empty()) words << QString("%1 poses").arg(place.poses.size());
  return words.join("; ");
}

}  // namespace

QString wordsOf(const TwinFigures& now, const TwinFigures& before) {
  if (!now.pose && !now.all) return "No comparison has come yet.";
  const bool two = before.all != nullptr;
  const auto ofPose = [](const TwinFigures& f) { return f.pose ? &f.pose->figures : nullptr; };
  Columns columns = {ofPose(now), now.all.get()};
  if (two) columns = {ofPose(now), ofPose(before), now.all.get(), before.all.get()};
  QString html = "<table cellspacing='0'><tr><td></td>";
  if (two) {
    const QString was = before.label.toHtmlEscaped();
    html += head("pose") + head(was) + head("all") + head(was);
  } else {
    html += head("this pose") + head("all poses");
  }
  html += "</tr>";
  using L = mmradartwin_msgs::Ledger;
  html += figureLine("poses", columns, [](const L& l) { return QString::number(l.poses); });
  html += figureLine("recall", columns, [](const L& l) { return percent(l.recall); });
  html += figureLine("Q1 energy", columns, [](const L& l) { return percent(l.q1_energy); });
  html += figureLine("Q2 energy", columns, [](const L& l) { return percent(l.q2_energy); });
  html += figureLine("Q3 median", columns, [](const L& l) { return level(l.q3_median_db); });
  html += figureLine("Q4 error", columns, [](const L& l) { return level(l.q4_mae_db); });
  html += figureLine("C1 … C5", columns, [](const L& l) {
    QStringList counts;
    for (unsigned count : l.class_count) counts << QString::number(count);
    return counts.join(QChar(0xb7));
  });
  const auto rms = [](const TwinFigures& f) {
    return f.pose ? level(f.pose->residual_rms_db) : QString::fromUtf8("–");
  };
  QStringList differences = {rms(now), ""};
  if (two) differences = QStringList{rms(now), rms(before), "", ""};
  return html + line("difference, rms", differences) + "</table>";
}

QString shortWordsOf(const TwinFigures& twin) {
  if (!twin.pose) return "";
  const mmradartwin_msgs::PoseFigures& p = *twin.pose;
  return QString("recall %1, Q1 %2, Q2 %3, difference %4 rms")
      .arg(percent(p.figures.recall), percent(p.figures.q1_energy), percent(p.figures.q2_energy),
           level(p.residual_rms_db));
}

QString wordsOf(const mmradartwin_msgs::Explanation* explanation) {
  if (explanation && explanation->kind.empty() && !explanation->note.empty()) return plain(explanation->note) + ".";
  if (!explanation || explanation->kind.empty()) {
    return QString::fromUtf8(
        "Click on a place of a map at the right, on a line of “What differs”, or, with the tool "
        "“Why?” above, in the room: here stands what is behind it.");
  }
  const mmradartwin_msgs::Explanation& e = *explanation;
  QString sentence = plain(e.sentence);
  if (!sentence.isEmpty()) sentence[0] = sentence[0].toUpper();
  QString html = "<p><b>" + sentence + ".</b></p><table cellspacing='0'>";
  const auto add = [&](const QString& label, const QString& words) {
    if (!words.isEmpty()) html += "<tr><td>" + label + "&nbsp;&nbsp;</td><td>" + words + "</td></tr>";
  };
  add("class", kindWords(e.kind));
  add("what to do", plain(e.action));
  add("where", QString::fromUtf8("%1 m, %2°%3")
                   .arg(number(e.range_m, 2), number(e.azimuth_rad * 180 / M_PI, 1),
                        e.pose.empty() ? QString() : ", pose " + plain(e.pose)));
  add("actor", spokenName(e.actor));
  add("material", spokenName(e.material));
  add("region", spokenName(e.region));
  add("event", plain(e.event));
  html += "</table>";
  if (!e.note.empty()) return html + "<p>" + plain(e.note) + "</p>";
  html +=
      "<p>paths of the twin that make it up:</p><table cellspacing='0'><tr><th align='left'>event</th>"
      "<th align='left'>by way of</th>" +
      head("dB") + head("ns") + head("angle") + head("share") + "</tr>";
  const int shown = std::min(static_cast<int>(e.paths.size()), kMostPaths);
  double rest = 0;
  for (int i = 0; i < static_cast<int>(e.paths.size()); ++i) {
    if (i < shown) html += rowOf(e.paths[static_cast<std::size_t>(i)]);
    if (i >= shown) rest += e.paths[static_cast<std::size_t>(i)].share;
  }
  html += "</table>";
  const int more = static_cast<int>(e.paths.size()) - shown;
  if (more > 0) html += QString("<p>and %1 weaker ones, %2 together</p>").arg(more).arg(percent(rest));
  return html;
}

QString wordsOf(const mmradartwin_msgs::Findings* findings) {
  if (!findings) return "No diagnosis has been made yet.";
  if (findings->findings.empty()) return "<b>Nothing was found</b>: the twin explains what was measured.";
  QString html;
  int place = 0;
  for (const mmradartwin_msgs::Finding& f : findings->findings) {
    html += QString("<p><b>%1. %2</b> (%3)").arg(++place).arg(spokenName(f.cause), plain(f.residual_class));
    if (!f.description.empty()) html += "<br>" + plain(f.description);
    for (const auto& p : f.parameters) html += "<br>" + parameterWords(p);
    html += QString("<br>gain: %1 nats").arg(number(f.log_likelihood_gain, 0));
    if (std::isfinite(f.explained_power_after)) {
      html += QString::fromUtf8("; explains %1 of the power instead of %2")
                  .arg(percent(f.explained_power_after), percent(f.explained_power_before));
    }
    for (const auto& where : f.where) {
      const QString words = placeWords(where);
      if (!words.isEmpty()) html += "<br>where: " + words;
    }
    html += "</p>";
  }
  return html;
}

}  // namespace mmradartwin
