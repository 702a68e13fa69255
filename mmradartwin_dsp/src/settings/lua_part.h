#pragma once

#include <lua.hpp>

#include "settings/lua_sandbox.h"
#include "settings/lua_source.h"

namespace mmradartwin::lua {

/// Whether a name asks which part this is: partId, ar1.GetPartNumber, DEVICE, radarType.
bool asksForPart(const char* name);
/// As the script spells it where it compares: names and types are sooner text, all else a number.
int answerPart(lua_State* L, const char* question);
/// Index of the table of globals: what asks for the part is answered, all else is nil.
int indexGlobals(lua_State* L);
/// ar1.ReadRegister of the registers that tell parts apart.
int readRegister(lua_State* L);
/// How the script spells its part where it compares with it.
void spellPart(Sandbox& sandbox, const LuaSource& source);

}  // namespace mmradartwin::lua
