#pragma once

#include <optional>

#include "diagnosis/fit/hypothesis_fit.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

bool isUnmodelledBox(const Hypothesis& hypothesis);
/// The object that was fitted as a cylinder as a box: turned in many ways, its near side where the cylinder's is.
Screened asBox(const ChannelData& data, const ModelState& null, const HypothesisFit& cylinder);
/// What a law that dims paths by where they pass may be: a box there that shows no side of its own to most poses;
/// starts are ways in which it may stand about the place. Nothing of other laws.
std::optional<Screened> boxThatHides(const Screened& law);
/// Fits an object whose place is free, moved or unmodelled. A side is seen from few poses, and the likelihood has a top
/// for each way in which one of them may be explained: from each, places around are tried and of a box those that keep
/// a side, a corner or the place.
HypothesisFit fitObject(HypothesisFitter& fitter, const ModelState& null, const Screened& object);

}  // namespace mmradartwin::diagnosis::search
