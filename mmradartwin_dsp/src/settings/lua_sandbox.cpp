#include "settings/lua_sandbox.h"

#include <cstdlib>
#include <cstring>

namespace mmradartwin::lua {
namespace {

constexpr int kDeepestFrame = 100;  ///< of those that are searched for a line

}  // namespace

void* allocate(void* user, void* block, std::size_t old_bytes, std::size_t new_bytes) {
  Sandbox& sandbox = *static_cast<Sandbox*>(user);
  const std::size_t old = block ? old_bytes : 0;
  if (new_bytes == 0) {
    std::free(block);
    sandbox.bytes -= old;
    return nullptr;
  }
  if (new_bytes > old && sandbox.bytes - old + new_bytes > kMostBytes) return nullptr;
  void* fresh = std::realloc(block, new_bytes);
  if (fresh) sandbox.bytes += new_bytes - old;
  return fresh;
}

void addSteps(lua_State* L, double steps) {
  Sandbox& sandbox = sandboxOf(L);
  sandbox.steps += steps;
  if (sandbox.steps <= kMostSteps) return;
  sandbox.ran_too_long = true;
  lua_sethook(L, countSteps, LUA_MASKCOUNT, 1);
  luaL_error(L, "too many steps");
}

void countSteps(lua_State* L, lua_Debug*) { addSteps(L, kStepsPerCheck); }

Lines linesOf(lua_State* L) {
  Lines lines;
  lua_Debug frame;
  for (int level = 0; level < kDeepestFrame && lua_getstack(L, level, &frame); ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline <= 0 || std::strcmp(frame.source, kChunk) != 0) continue;
    if (lines.innermost == 0) lines.innermost = frame.currentline;
    lines.outermost = frame.currentline;
  }
  return lines;
}

std::string placeOf(lua_State* L) {
  const Lines lines = linesOf(L);
  std::string place = sandboxOf(L).file + ":" + std::to_string(lines.innermost);
  if (lines.outermost != lines.innermost) place += " (called from line " + std::to_string(lines.outermost) + ")";
  return place;
}

void setFunction(lua_State* L, const char* name, lua_CFunction function) {
  lua_pushcfunction(L, function);
  lua_setfield(L, -2, name);
}

}  // namespace mmradartwin::lua
