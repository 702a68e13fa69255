#pragma once

#include <mmradartwin_msgs/Findings.h>
#include <mmradartwin_msgs/Ledger.h>
#include <mmradartwin_msgs/PathRecords.h>
#include <mmradartwin_msgs/PoseFigures.h>
#include <mmradartwin_msgs/RangeAngleMap.h>
#include <mmradartwin_msgs/Residuals.h>
#include <mmradartwin_msgs/Scene.h>

#include <string>
#include <vector>

#include "mmradartwin_attribution/finding.h"
#include "mmradartwin_attribution/ledger.h"
#include "mmradartwin_attribution/residual.h"

namespace mmradartwin {

/// The caller sets the headers.
mmradartwin_msgs::Residuals toMsg(const EvaluationField& field, const PoseAttribution& pose, const std::string& name,
                                  const Eigen::Isometry3d& T_map_radar);
/// A normalised map in the unit that it had, clipped as it is compared.
mmradartwin_msgs::RangeAngleMap toMsg(const EvaluationField& field, const NormalisedMap& map, Branch source,
                                      const Eigen::Isometry3d& T_map_radar);
/// Simulated - measured [dB], NaN where they are not compared.
mmradartwin_msgs::RangeAngleMap residualMapMsg(const EvaluationField& field, const PoseAttribution& pose,
                                               const Eigen::Isometry3d& T_map_radar);
mmradartwin_msgs::Ledger toMsg(const LedgerSummary& summary, const std::vector<std::string>& duplicates);
/// Of one pose alone.
mmradartwin_msgs::PoseFigures poseFiguresMsg(const PoseAttribution& pose, const std::string& name);
/// Throws std::logic_error as toJson() does.
mmradartwin_msgs::Findings toMsg(const Findings& findings);

/// Regions and residuals, without maps and metrics. `scene`, where there is one, tells the regions' materials.
PoseAttribution attributionFromMsg(const mmradartwin_msgs::Residuals& msg, const Scene* scene);
/// Records with the indices of `scene`'s actors (-1 for a name it lacks); facets are not in the message.
std::vector<PathRecord> pathsFromMsg(const mmradartwin_msgs::PathRecords& msg, const Scene& scene);
/// Actors with their triangles, tags and colours, without facets. Throws InputError for broken geometry (a triangle
/// count that is no whole number, coordinates that are not finite).
Scene actorsFromMsg(const mmradartwin_msgs::Scene& msg);
/// The same with facets, which take seconds of a scan.
Scene sceneFromMsg(const mmradartwin_msgs::Scene& msg);

}  // namespace mmradartwin
