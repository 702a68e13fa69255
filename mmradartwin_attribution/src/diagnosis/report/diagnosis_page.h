#pragma once

#include <string>
#include <vector>

#include "diagnosis/rooms.h"
#include "mmradartwin_attribution/diagnosis_result.h"

namespace mmradartwin::diagnosis::report {

/// Files of a finding, relative to the page.
struct FindingFiles {
  std::string figure;
  std::string records;  ///< "" where it changes no path records
};

/// Page of a diagnosis (HTML) for a person. files: by finding. command: of the run, word by word.
std::string diagnosisPage(const Diagnosis& diagnosis, const std::vector<FindingFiles>& files,
                          const std::vector<std::string>& command);

}  // namespace mmradartwin::diagnosis::report
