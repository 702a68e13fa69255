#pragma once

#include <mmradartwin_msgs/Explanation.h>
#include <mmradartwin_msgs/Findings.h>

#include <QString>

#include "twin_link.h"

namespace mmradartwin {

/// HTML of the panel: what the nodes say, for people.

/// The table of the pose and of all poses, and beside each that of the twin before, where there was one.
QString wordsOf(const TwinFigures& now, const TwinFigures& before);
/// How well one twin explains the pose, in a line of plain text.
QString shortWordsOf(const TwinFigures& twin);
/// What stands behind a place that was asked for, or how to ask.
QString wordsOf(const mmradartwin_msgs::Explanation* explanation);
/// Findings with values, intervals, gain and place.
QString wordsOf(const mmradartwin_msgs::Findings* findings);

}  // namespace mmradartwin
