#include "scan/things/thing_class.h"

#include <cmath>

namespace mmradartwin {
namespace {

bool within(double value, double low, double high) { return value >= low && value <= high; }

/// On a wall, and thin.
ClassGuess classOnWall(const ThingSigns& s) {
  const double height = s.high_m - s.low_m;
  if (s.low_m < 0.2 && within(s.high_m, 1.8, 2.5) && within(s.length_m, 0.55, 1.4)) {
    return {"door", 0.8, "a door's height and width, flat on a wall"};
  }
  if (s.low_m < 0.35 && within(s.high_m, 0.35, 1.1) && s.length_m > 0.35) {
    return {"radiator", 0.7, "low and flat on a wall"};
  }
  if (height < 0.12 && s.length_m > 0.3 && s.low_m > 0.4) return {"shelf", 0.7, "a level plate on a wall"};
  if (s.low_m > 0.5 && within(height, 0.3, 1.9)) {
    if (within(s.length_m / height, 1.5, 2.0) && s.length_m < 2 && s.width_m > 0.035) {
      return {"screen", 0.6, "on a wall, sides as 16 to 9"};
    }
    if (s.width_m < 0.09 && s.length_m > 0.5) return {"board", 0.5, "a thin plate on a wall at the eyes' height"};
  }
  return {};
}

/// On the floor.
ClassGuess classOnFloor(const ThingSigns& s) {
  const bool box = s.is_box;
  if (s.high_m < 0.06 && s.width_m > 0.5) return {"carpet", 0.7, "flat on the floor"};
  if (s.high_m > s.room_m - 0.45 && s.length_m < 1.3 && s.width_m > 0.1) {
    return {"pillar", 0.7, "narrow and as high as the room"};
  }
  if (within(s.seat_m, 0.3, 0.62) && within(s.high_m, 0.6, 1.35) && s.high_m - s.seat_m > 0.15) {
    if (s.length_m > 1.15) return {"sofa", 0.7, "a long seat with a back"};
    if (s.length_m < 1.0) return {"chair", 0.7, "a seat with a back"};
  }
  if (!s.is_box && s.upright_share > 0.85 && s.high_m > 0.9 && s.high_m < 2.3 && s.length_m > 0.6) {
    return {"partition", 0.6, "upright plates that stand free"};
  }
  if (s.width_m < 0.15 && s.high_m > 0.9 && s.length_m > 0.6)
    return {"partition", 0.7, "a thin upright plate that stands free"};
  if (s.high_m > 0.95 && s.width_m > 0.15 && s.length_m > 0.3 && box) {
    if (s.width_m < 0.36 && s.high_m > 1.5) return {"bookshelf", 0.6, "a high box of small depth"};
    return {"cabinet", 0.75, "a high box on the floor"};
  }
  if (s.high_m < 0.8 && s.high_m > 0.2 && s.length_m < 0.55 && s.width_m > 0.12)
    return {"bin", 0.5, s.round ? "small and round, on the floor" : "small, on the floor"};
  // Cupboards are at most 0.65 m deep, a sofa's seat and back are deeper.
  if (within(s.high_m, 0.55, 1.0) && s.length_m > 1.3 && s.width_m > 0.7) return {"sofa", 0.4, "long, low and deep"};
  if (within(s.high_m, 0.5, 1.0) && box && s.width_m > 0.3) return {"cabinet", 0.6, "a low box on the floor"};
  if (within(s.high_m, 0.3, 0.7) && s.length_m > 1.6 && s.width_m > 0.7) return {"bed", 0.5, "long, wide and low"};
  if (within(s.high_m, 0.6, 1.1) && s.length_m > 1.2 && s.width_m > 0.6)
    return {"sofa", 0.4, "long and as high as a back"};
  if (within(s.high_m, 0.7, 1.35) && within(s.length_m, 0.3, 0.95)) return {"chair", 0.4, "of a chair's size"};
  return {};
}

}  // namespace

ClassGuess classOf(const ThingSigns& s) {
  if (s.table_top) {
    if (s.high_m > 0.6 && s.high_m < 1.2) return {"table", 0.8, "a level top over free space"};
    if (s.high_m > 0.25 && s.high_m <= 0.6 && s.length_m > 0.5)
      return {"table", 0.6, "a low level top over free space"};
  }
  // A scan may lack a table's thin top.
  const bool at_table = within(s.low_m, 0.55, 1.2) && s.wall_m > 0.15 && s.length_m < 1.5 && s.high_m < 1.8;
  if (s.on_table || at_table) {
    const double height = s.high_m - s.low_m, sure = s.on_table ? 0.6 : 0.4;
    if (s.width_m < 0.35 && within(s.length_m, 0.25, 1.4) && within(height, 0.15, 0.8) &&
        s.width_m < 0.7 * s.length_m) {
      return {"screen", sure, "thin and upright at a table's height"};
    }
    if (height > 0.08 && s.width_m > 0.15) return {"device", sure, "a body at a table's height"};
    return {};
  }
  if (within(s.low_m, 0.3, 0.55) && within(s.length_m, 0.3, 0.8) && within(s.width_m, 0.3, 0.7)) {
    if (s.high_m - s.low_m < 0.1) return {"chair", 0.4, "a seat's plate at a seat's height"};
    if (within(s.seat_m, 0.3, 0.62) && s.high_m < 1.35)
      return {"chair", 0.6, "a seat with a back; its legs are not in the scan"};
  }
  if (s.flat_on_wall && s.width_m < 0.25) {
    const ClassGuess guess = classOnWall(s);
    if (guess.confidence > 0) return guess;
  }
  if (s.low_m < 0.3) return classOnFloor(s);
  if (s.wall_m < 0.15 && s.high_m - s.low_m < 0.15) return {"shelf", 0.6, "a level plate at a wall"};
  if (s.high_m > s.room_m - 0.3 && s.low_m > 1.6) return {"lamp", 0.6, "hangs from the ceiling"};
  if (s.wall_m < 0.15 && s.is_box) return {"cabinet", 0.4, "a box on a wall"};
  return {};
}

}  // namespace mmradartwin
