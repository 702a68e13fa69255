#pragma once

#include "mmradartwin_dsp/progress_line.h"
