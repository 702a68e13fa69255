#pragma once

#include <cstddef>
#include <cstdint>
#include <lua.hpp>
#include <map>
#include <string>
#include <vector>

#include "settings/script_record.h"

// Functions of Lua that raise an error do not return, and no destructor runs: where one is called, no object that has
// to be destroyed is alive.
namespace mmradartwin::lua {

constexpr int kStepsPerCheck = 1000;
constexpr double kMostSteps = 1e7;
constexpr double kStepsOfACall = 100;  ///< of a function that costs more than a step of Lua
constexpr std::size_t kMostBytes = 64u << 20;
constexpr char kChunk[] = "=lua";  ///< name of the script within Lua

/// What unknown functions and comparisons answer in a run.
struct Answers {
  bool calls_give_zero = false;
  bool first_comparison = false;  ///< those of a line alternate, so that loops end
};

/// What one run of a script may use, and what it has left behind.
struct Sandbox {
  std::string file;
  std::string part;
  double part_number = 0;  ///< 0: the script compares with no such number
  std::string part_text;   ///< empty: the script compares with no such text
  std::string part_name;   ///< where it compares with neither
  std::uint32_t fuse_code = 0;
  Answers answers;

  ScriptRecord record;
  std::vector<std::string> unknown_called, unknown_compared;  ///< where, and what
  std::size_t bytes = 0;
  double steps = 0;
  std::map<int, bool> next_comparison;  ///< by line
  double clock_s = 0;
  bool ran_too_long = false;
  int error_line = 0;
};

inline Sandbox& sandboxOf(lua_State* L) { return **static_cast<Sandbox**>(lua_getextraspace(L)); }

/// Allocator of Lua that ends at kMostBytes. user: the Sandbox.
void* allocate(void* user, void* block, std::size_t old_bytes, std::size_t new_bytes);
/// Ends the script where it has taken too many steps, whatever it catches.
void addSteps(lua_State* L, double steps);
/// Hook of Lua, called every kStepsPerCheck steps.
void countSteps(lua_State* L, lua_Debug*);

struct Lines {
  int innermost = 0, outermost = 0;  ///< of the script; 0: none
};
Lines linesOf(lua_State* L);
/// FILE:LINE of the script, for messages.
std::string placeOf(lua_State* L);
/// Sets a field of the table on top of the stack.
void setFunction(lua_State* L, const char* name, lua_CFunction function);

}  // namespace mmradartwin::lua
