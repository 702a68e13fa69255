#pragma once

namespace mmradartwin::page {

/// A figure of the paper's table "Evaluation summary in the central usable field of view": 154 poses of its room.
struct PaperFigure {
  const char* name;  ///< key below "central" in summary.json, as a JSON pointer
  double value;
};

inline constexpr int kPaperPoses = 154;
inline constexpr PaperFigure kPaperFigures[] = {
    {"/recall", 0.708},
    {"/recall_by_band/near/recall", 0.828},
    {"/recall_by_band/mid/recall", 0.607},
    {"/recall_by_band/far/recall", 0.384},
    {"/top/0", 0.260},
    {"/top/1", 0.242},
    {"/top/2", 0.261},
    {"/q3_median_db", 1.01},
    {"/q3_iqr_db", 5.80},
    {"/q1_energy", 0.518},
    {"/q2_energy", 0.311},
    {"/q4_mae_db", 7.20},
    {"/classes/C1/share", 0.03},
    {"/classes/C2/share", 0.26},
    {"/classes/C3/share", 0.16},
    {"/classes/C4/share", 0.33},
    {"/classes/C5/share", 0.22},
};

}  // namespace mmradartwin::page
