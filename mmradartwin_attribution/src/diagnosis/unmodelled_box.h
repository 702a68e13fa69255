#pragma once

#include "hypothesis_fit.h"

namespace mmradartwin {

bool isUnmodelledBox(const Hypothesis& hypothesis);
/// The object that was fitted as a cylinder as a box: turned in many ways, its near side where the cylinder's is.
Screened asBox(const ChannelData& data, const ModelState& null, const HypothesisFit& cylinder);
/// Fits asBox(). A side is seen from few poses, and the likelihood has a top for each way in which one of them may be
/// explained: from each the boxes around are tried that keep a side, a corner or the place.
HypothesisFit fitBox(HypothesisFitter& fitter, const ModelState& null, const Screened& box);

}  // namespace mmradartwin
