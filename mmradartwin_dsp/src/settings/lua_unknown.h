#pragma once

#include <lua.hpp>

namespace mmradartwin::lua {

/// Values that the script has not and only mmWave Studio can answer: they can be called, indexed and computed with, and
/// what comes of it is unknown, too.
bool isUnknown(lua_State* L, int index);
/// Where an unknown value comes from. The text lives as long as the value.
const char* originOf(lua_State* L, int index);
int pushUnknown(lua_State* L, const char* origin);
/// Says what can be done with unknown values, and with nil, numbers and texts that a script takes for something else.
void describeValues(lua_State* L);

/// Functions of Lua with these answers.
int answerNothing(lua_State*);
int answerNil(lua_State* L);
int answerZero(lua_State* L);
int answerItself(lua_State* L);

}  // namespace mmradartwin::lua
