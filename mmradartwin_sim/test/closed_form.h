#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>

namespace mmradartwin {

inline std::string shortText(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

/// EXPECT_NEAR against a closed form that leaves a row of the table of closed forms: on the output, to be picked out by
/// its first letters, and as a property in the test's XML.
inline void expectForm(const std::string& form, const std::string& unit, double asked, double computed,
                       double allowed) {
  EXPECT_NEAR(computed, asked, allowed) << form;
  char row[256];
  std::snprintf(row, sizeof row, "| %s | %s | %.6g | %.6g | %.2g | %.2g |", form.c_str(), unit.c_str(), asked, computed,
                std::abs(computed - asked), allowed);
  std::printf("%s\n", row);
  std::string key;
  for (char c : form) key += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  ::testing::Test::RecordProperty("form_" + key, row);
}

}  // namespace mmradartwin
