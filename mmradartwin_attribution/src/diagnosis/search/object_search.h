#pragma once

#include <optional>

#include "diagnosis/fit/hypothesis_fitter.h"
#include "diagnosis/rooms.h"

namespace mmradartwin::diagnosis::search {

/// True for a box that the twin lacks.
bool isUnmodelledBox(const Hypothesis& hypothesis);
/// Box in place of an object that was fitted as a cylinder: starts turn it in many ways, its near side where the
/// cylinder's front is.
Screened asBox(const ChannelData& data, const ModelState& null, const HypothesisFit& cylinder);
/// Box that hides what is behind it, at the place of a law that dims passing paths; nothing for other laws. It shows no
/// side of its own to most poses. Starts are turns of it about the place.
std::optional<Screened> boxThatHides(const Screened& law);
/// Fits an object whose place is free, moved or unmodelled. Few poses see a side, and the likelihood has an optimum for
/// each way to explain one of them: around each optimum other places are tried, and boxes that keep a side, a corner or
/// the middle.
HypothesisFit fitObject(HypothesisFitter& fitter, const ModelState& null, const Screened& object);

}  // namespace mmradartwin::diagnosis::search
