#pragma once

/// Rooms of the diagnosis: a folder and a namespace for each step of the method. This table says which room sees the
/// names of which; a name of any other room does not compile. test/scripts/check_includes.py holds includes to the
/// same table.
namespace mmradartwin::diagnosis {

/// Causes, findings and the mechanisms that answer them; seen by all rooms.
namespace catalogue {}
using namespace catalogue;

/// The likelihood's arithmetic and statistics over locations.
namespace numbers {}
/// Raw frames: damaged samples, what moves, what drifts.
namespace frames {}
/// Each pose's channels per range bin, in time and delivered as they ought to be.
namespace channels {
using namespace numbers;
using namespace frames;
}  // namespace channels
/// Echoes expected of a twin: paths, their values and spreads in each range bin, what receivers mix of them.
namespace echoes {
using namespace channels;
}
/// How likely the channels are under the echoes expected.
namespace likelihood {
using namespace echoes;
}
/// What may be wrong with a twin: a mechanism with free numbers, and what evidence it needs.
namespace hypotheses {
using namespace likelihood;
}
/// Fits of hypotheses.
namespace fit {
using namespace hypotheses;
}
/// What is wrong with the receiver, told without a scene.
namespace receiver {
using namespace fit;
}
/// Which hypotheses are worth a fit, and from where.
namespace search {
using namespace fit;
}
/// What a finding gains on poses that its fit did not see.
namespace gain {
using namespace fit;
}
/// Rounds of fits, the finding of a round and its place beside those before it.
namespace rounds {
using namespace receiver;
using namespace search;
using namespace gain;
}  // namespace rounds
/// Files and figures that a person reads; sees results alone.
namespace report {}

using namespace rounds;
using namespace report;

}  // namespace mmradartwin::diagnosis
