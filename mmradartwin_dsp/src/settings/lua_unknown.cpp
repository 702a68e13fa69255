#include "settings/lua_unknown.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

#include "settings/lua_sandbox.h"

namespace mmradartwin::lua {

static constexpr char kUnknown[] = "mmradartwin.unknown";

bool isUnknown(lua_State* L, int index) { return luaL_testudata(L, index, kUnknown) != nullptr; }

const char* originOf(lua_State* L, int index) {
  lua_getiuservalue(L, index, 1);
  const char* origin = lua_tostring(L, -1);
  lua_pop(L, 1);
  return origin ? origin : "?";
}

int pushUnknown(lua_State* L, const char* origin) {
  lua_newuserdatauv(L, 0, 1);
  lua_pushstring(L, origin);
  lua_setiuservalue(L, -2, 1);
  luaL_setmetatable(L, kUnknown);
  return 1;
}

int answerNothing(lua_State*) { return 0; }
int answerNil(lua_State* L) {
  lua_pushnil(L);
  return 1;
}

int answerZero(lua_State* L) {
  lua_pushinteger(L, 0);
  return 1;
}

int answerItself(lua_State* L) {
  lua_settop(L, 1);
  return 1;
}

namespace {

/// What stands in nothing: unknown by its name. A list ends, so that loops over it do.
int indexNothing(lua_State* L) {
  if (lua_type(L, 2) == LUA_TNUMBER) return answerNil(L);
  const char* key = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : "?";
  const char* holder = isUnknown(L, 1) ? originOf(L, 1) : "";
  if (*holder && std::strlen(holder) < 100) key = lua_pushfstring(L, "%s.%s", holder, key);
  return pushUnknown(L, key);
}

void noteUnknown(lua_State* L, std::vector<std::string>& notes, const char* what) {
  if (notes.size() >= 8) return;
  const std::string note = placeOf(L) + ": " + what;
  if (std::find(notes.begin(), notes.end(), note) == notes.end()) notes.push_back(note);
}

int callNothing(lua_State* L) {
  Sandbox& sandbox = sandboxOf(L);
  lua_Debug frame;
  const char* name = "a function";
  if (isUnknown(L, 1)) {
    name = originOf(L, 1);
  } else if (lua_getstack(L, 0, &frame) && lua_getinfo(L, "n", &frame) && frame.name) {
    name = frame.name;
  }
  const std::size_t size = std::strlen(name);
  if (size >= 5 && std::strcmp(name + size - 5, "lines") == 0) {  // an iterator
    lua_pushcfunction(L, answerNil);
    return 1;
  }
  addSteps(L, kStepsOfACall);
  const char* origin = size < 100 ? lua_pushfstring(L, "%s()", name) : name;
  noteUnknown(L, sandbox.unknown_called, origin);
  return sandbox.answers.calls_give_zero ? answerZero(L) : pushUnknown(L, origin);
}

/// Arithmetic and joining of texts where a part is unknown.
int operateOnUnknown(lua_State* L) {
  for (int i = 1; i <= 2; ++i) {
    if (!isUnknown(L, i)) continue;
    lua_pushvalue(L, i);
    return 1;
  }
  return pushUnknown(L, "a name without a value");
}

int compareUnknown(lua_State* L) {
  Sandbox& sandbox = sandboxOf(L);
  noteUnknown(L, sandbox.unknown_compared, originOf(L, isUnknown(L, 1) ? 1 : 2));
  bool& next = sandbox.next_comparison.emplace(linesOf(L).innermost, sandbox.answers.first_comparison).first->second;
  lua_pushboolean(L, next);
  next = !next;
  return 1;
}

int iterateNothing(lua_State* L) {
  lua_pushcfunction(L, answerNil);
  return 1;
}

/// What can be done with a value that is not there: the table on top of the stack.
void describeNothing(lua_State* L) {
  setFunction(L, "__index", indexNothing);
  setFunction(L, "__newindex", answerNothing);
  setFunction(L, "__call", callNothing);
  setFunction(L, "__concat", operateOnUnknown);
  setFunction(L, "__pairs", iterateNothing);
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
}

}  // namespace

void describeValues(lua_State* L) {
  luaL_newmetatable(L, kUnknown);
  describeNothing(L);
  for (const char* operation : {"__add", "__sub", "__mul", "__div", "__mod", "__pow", "__unm", "__idiv", "__band",
                                "__bor", "__bxor", "__shl", "__shr", "__bnot"}) {
    setFunction(L, operation, operateOnUnknown);
  }
  setFunction(L, "__lt", compareUnknown);
  setFunction(L, "__le", compareUnknown);
  setFunction(L, "__len", answerZero);
  lua_pop(L, 1);
  lua_pushnil(L);
  lua_newtable(L);
  describeNothing(L);
  lua_setmetatable(L, -2);
  // ar1.partNumber and ar1.partNumber() are the same.
  lua_pushinteger(L, 0);
  lua_newtable(L);
  setFunction(L, "__call", answerItself);
  setFunction(L, "__index", indexNothing);
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_pushliteral(L, "");
  lua_getmetatable(L, -1);
  setFunction(L, "__call", answerItself);
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
  lua_pop(L, 4);
}

}  // namespace mmradartwin::lua
