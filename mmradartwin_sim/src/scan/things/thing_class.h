#pragma once

#include <string>

namespace mmradartwin {

/// "cabinet", "table", ...; "unknown" where nothing fits. Reads shape and bounds, and what `scene` has already.
struct ClassGuess {
  std::string klass = "unknown";
  double confidence = 0;
  std::string why;
};

/// What of a thing its class shows by.
struct ThingSigns {
  double length_m, width_m;  ///< level sizes, length >= width
  double low_m, high_m;      ///< heights above the floor
  double room_m;             ///< height of the room
  double wall_m;             ///< from its nearest side to a wall, large where there is none
  double box_share;          ///< of its samples on its box
  double seat_m;             ///< height of its largest level face below its top, 0 where it has none
  bool flat_on_wall;         ///< its long side lies along the wall that it is at
  double upright_share;      ///< of its samples, with a level normal
  bool is_box;               ///< the scan bears its box out
  bool round;
  bool on_table;
  bool table_top;  ///< a level plate over little
};
ClassGuess classOf(const ThingSigns& signs);

}  // namespace mmradartwin
