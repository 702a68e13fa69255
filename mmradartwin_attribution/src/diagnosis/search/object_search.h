#pragma once

#include <optional>

#include "diagnosis/fit/hypothesis_fitter.h"
#include "diagnosis/rooms.h"
#include "diagnosis/search/back_projection.h"
#include "diagnosis/search/hiding_places.h"

namespace mmradartwin::diagnosis::search {

/// True for a box that the twin lacks.
bool isUnmodelledBox(const Hypothesis& hypothesis);
/// Box in place of an object that was fitted as a cylinder. Starts turn the box in many ways, with its near side where
/// the cylinder's front is.
Screened asBox(const ChannelData& data, const ModelState& null, const HypothesisFit& cylinder);
/// Box one of whose sides faces some poses.
Screened boxFacing(const ChannelData& data, const ProjectedPlace& side);
/// Box that hides what is behind it. Most poses see no side of it. Starts turn the box about the place.
Screened boxAbout(const HidingPlace& place);
/// Fits an object whose place is free, moved or unmodelled. Few poses see one of its sides, so that the likelihood has
/// several optima. Around each optimum other places are tried, and boxes that share a side, a corner or the middle.
HypothesisFit fitObject(HypothesisFitter& fitter, const ModelState& null, const Screened& object);

}  // namespace mmradartwin::diagnosis::search
