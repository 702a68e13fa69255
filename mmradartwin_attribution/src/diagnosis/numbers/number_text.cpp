#include "diagnosis/numbers/number_text.h"

#include "mmradartwin_dsp/text.h"

namespace mmradartwin::diagnosis::numbers {

std::string number(double value, int digits) { return significantNumber(value, digits); }

}  // namespace mmradartwin::diagnosis::numbers
