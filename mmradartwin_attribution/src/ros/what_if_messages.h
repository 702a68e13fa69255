#pragma once

#include <mmradartwin_msgs/WhatIf.h>

#include "mmradartwin_attribution/what_if_comparison.h"

namespace mmradartwin {

mmradartwin_msgs::WhatIfNumbers toMsg(const TwinNumbers& numbers);
/// Numbers as they are where there are none.
mmradartwin_msgs::WhatIfNumbers noNumbers();
/// What can be changed, and what was: edits, materials, actors and mechanisms of the message.
void describe(const WhatIf& what_if, mmradartwin_msgs::WhatIf& msg);

}  // namespace mmradartwin
