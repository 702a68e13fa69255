#include "diagnosis/numbers/number_text.h"

#include <iomanip>
#include <sstream>

namespace mmradartwin::diagnosis::numbers {

std::string number(double value, int digits) {
  std::ostringstream out;
  out << std::setprecision(digits) << value;
  return out.str();
}

}  // namespace mmradartwin::diagnosis::numbers
