#include "settings/lua_script.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <lua.hpp>
#include <memory>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "settings/lua_part.h"
#include "settings/lua_sandbox.h"
#include "settings/lua_source.h"
#include "settings/lua_unknown.h"

namespace mmradartwin {
namespace {

using namespace lua;

constexpr std::size_t kMostCalls = 20000;
constexpr std::size_t kMostArguments = 64;

constexpr char kExit = 0;  ///< its address is the error that ends the script

ScriptArgument argumentAt(lua_State* L, int index) {
  ScriptArgument argument;
  int is_number = 0;
  const double number = lua_tonumberx(L, index, &is_number);
  if (is_number) argument.number = number;
  if (isUnknown(L, index)) {
    argument.unknown_from = originOf(L, index);
  } else if (lua_type(L, index) == LUA_TSTRING) {
    argument.text = std::string(lua_tostring(L, index)).substr(0, 200);
  } else if (!is_number) {
    argument.text = luaL_typename(L, index);
  }
  return argument;
}

void recordCall(lua_State* L, const char* name) {
  ScriptCall call;
  call.name = name;
  call.where = placeOf(L);
  const int count = std::min<int>(lua_gettop(L), kMostArguments);
  for (int i = 1; i <= count; ++i) call.arguments.push_back(argumentAt(L, i));
  sandboxOf(L).record.calls.push_back(std::move(call));
}

int callAr1(lua_State* L) {
  const char* name = lua_tostring(L, lua_upvalueindex(1));
  luaL_checkstack(L, 8, nullptr);
  if (sandboxOf(L).record.calls.size() >= kMostCalls) return luaL_error(L, "too many calls of ar1");
  recordCall(L, name);
  if (!std::strstr(name, "IsConnected")) return answerZero(L);
  lua_pushinteger(L, 1);
  return 1;
}

int indexAr1(lua_State* L) {
  if (lua_type(L, 2) != LUA_TSTRING) return answerNil(L);
  if (std::strcmp(lua_tostring(L, 2), "ReadRegister") == 0) {
    lua_pushcfunction(L, readRegister);
  } else if (asksForPart(lua_tostring(L, 2))) {
    return answerPart(L, lua_tostring(L, 2));
  } else {
    lua_pushvalue(L, 2);
    lua_pushcclosure(L, callAr1, 1);
  }
  return 1;
}

int indexRstd(lua_State* L) {
  lua_pushcfunction(L, answerZero);
  return 1;
}

void noteLeftOut(lua_State* L) {
  std::vector<std::string>& left_out = sandboxOf(L).record.left_out;
  if (left_out.size() >= 20) return;
  std::string what = lua_type(L, 1) == LUA_TSTRING ? std::string(lua_tostring(L, 1)).substr(0, 200) : "a file";
  if (isUnknown(L, 1)) what = originOf(L, 1);
  for (const char* library : {"bitoperations.lua", "socket", "lfs", "bit", "bit32"}) {
    const std::size_t size = std::strlen(library);
    if (what.size() >= size && what.compare(what.size() - size, size, library) == 0) return;  // configures nothing
  }
  left_out.push_back(oneLine(placeOf(L) + ": " + what));
}

/// dofile and its like.
int leaveOut(lua_State* L) {
  noteLeftOut(L);
  return pushUnknown(L, lua_tostring(L, lua_upvalueindex(1)));
}

int exitScript(lua_State* L) {
  lua_pushlightuserdata(L, const_cast<char*>(&kExit));
  return lua_error(L);
}

/// os.clock and os.time: each call is a second later, so that a script that waits goes on.
int answerClock(lua_State* L) {
  lua_pushnumber(L, sandboxOf(L).clock_s += 1);
  return 1;
}

/// debug.getinfo: scripts take the folder of TI's programs from their own name.
int describeScript(lua_State* L) {
  lua_newtable(L);
  lua_pushfstring(L, "@%s", sandboxOf(L).file.c_str());
  lua_setfield(L, -2, "source");
  return 1;
}

enum Guard : int { kPlain, kPattern, kFormat };

/// Searches for patterns go back over the text once more for each repetition in the pattern, and the steps of Lua do
/// not count that.
void chargePattern(lua_State* L) {
  std::size_t text_bytes = 0, pattern_bytes = 0;
  luaL_checklstring(L, 1, &text_bytes);
  const char* pattern = luaL_checklstring(L, 2, &pattern_bytes);
  int repetitions = 0;
  for (std::size_t i = 0; i < pattern_bytes; ++i) {
    const bool balanced = pattern[i] == 'b' && i > 0 && pattern[i - 1] == '%';
    if (balanced || (pattern[i] && std::strchr("*+-?", pattern[i]))) ++repetitions;
  }
  addSteps(L, std::pow(static_cast<double>(text_bytes + 1), repetitions + 1) / 16);
}

/// A function of Lua's own (first upvalue) whose answer is unknown where an argument is.
int callGuarded(lua_State* L) {
  const int count = lua_gettop(L);
  for (int i = 1; i <= count; ++i) {
    if (!isUnknown(L, i)) continue;
    lua_pushvalue(L, i);
    return 1;
  }
  const auto guard = static_cast<Guard>(lua_tointeger(L, lua_upvalueindex(2)));
  if (guard == kPattern) chargePattern(L);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  if (guard == kFormat) {
    const int status = lua_pcall(L, count, 1, 0);
    if (status == LUA_OK) return 1;
    // Lua 5.1 writes 2.5 as %d, later versions refuse it; it is text for a log.
    if (status == LUA_ERRRUN && !sandboxOf(L).ran_too_long) return pushUnknown(L, "string.format()");
    return lua_error(L);
  }
  lua_call(L, count, LUA_MULTRET);
  return lua_gettop(L);
}

/// pcall and xpcall (upvalue): what they catch has cost more than its steps.
int callProtected(lua_State* L) {
  addSteps(L, kStepsOfACall);
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, lua_gettop(L) - 1, LUA_MULTRET);
  return lua_gettop(L);
}

/// Finalisers run where no step is counted, and a length of one's own makes Lua's functions run for ever.
int setMetatable(lua_State* L) {
  luaL_checkany(L, 2);
  lua_rawgeti(L, LUA_REGISTRYINDEX, LUA_RIDX_GLOBALS);
  const bool keep = lua_rawequal(L, 1, -1) || isUnknown(L, 1) || isUnknown(L, 2);
  lua_settop(L, 2);
  if (keep) return answerItself(L);
  for (const char* refused : {"__gc", "__len"}) {
    if (lua_type(L, 2) != LUA_TTABLE) break;
    lua_pushstring(L, refused);
    lua_rawget(L, 2);
    if (!lua_isnil(L, -1)) return luaL_error(L, "metatables with %s are not known here", refused);
    lua_pop(L, 1);
  }
  lua_pushvalue(L, lua_upvalueindex(1));
  lua_insert(L, 1);
  lua_call(L, 2, 1);
  return 1;
}

/// Names of Lua 5.1 and of mmWave Studio's bitoperations.lua.
constexpr char kPrelude[] = R"(
unpack = table.unpack
table.getn = function(t) return #t end
table.maxn = table.getn
math.pow = function(a, b) return a ^ b end
math.log10 = function(a) return math.log(a, 10) end
math.mod = math.fmod
string.gfind = string.gmatch
function bit_and(a, b) return a & b end
function bit_or(a, b) return a | b end
function bit_xor(a, b) return a ~ b end
function bit_not(a) return ~a & 0xffffffff end
function bit_lshift(a, n) return a << n & 0xffffffff end
function bit_rshift(a, n) return (a & 0xffffffff) >> n end
bit = {band = bit_and, bor = bit_or, bxor = bit_xor, bnot = bit_not, lshift = bit_lshift, rshift = bit_rshift}
bit32 = bit
)";

/// Puts a guard before each function of the table on top of the stack.
void guardFunctions(lua_State* L) {
  lua_pushnil(L);
  while (lua_next(L, -2)) {
    if (lua_isfunction(L, -1) && lua_type(L, -2) == LUA_TSTRING) {
      const char* name = lua_tostring(L, -2);
      Guard guard = std::strcmp(name, "format") == 0 ? kFormat : kPlain;
      for (const char* pattern : {"find", "match", "gmatch", "gsub"}) {
        if (std::strcmp(name, pattern) == 0) guard = kPattern;
      }
      lua_pushvalue(L, -2);
      lua_insert(L, -2);
      lua_pushinteger(L, guard);
      lua_pushcclosure(L, callGuarded, 2);
      lua_rawset(L, -4);  // a field that is there already
    } else {
      lua_pop(L, 1);
    }
  }
}

void removeFields(lua_State* L, std::initializer_list<const char*> names) {
  for (const char* name : names) {
    lua_pushnil(L);
    lua_setfield(L, -2, name);
  }
}

void openLibraries(lua_State* L) {
  luaL_requiref(L, "string", luaopen_string, 1);
  removeFields(L, {"dump"});
  guardFunctions(L);
  luaL_requiref(L, "math", luaopen_math, 1);
  removeFields(L, {"random", "randomseed"});
  guardFunctions(L);
  luaL_requiref(L, "table", luaopen_table, 1);
  removeFields(L, {"move"});
  luaL_requiref(L, "_G", luaopen_base, 1);
  removeFields(L, {"collectgarbage", "warn"});
  for (const char* name : {"dofile", "loadfile", "load", "loadstring", "require"}) {
    lua_pushstring(L, name);
    lua_pushcclosure(L, leaveOut, 1);
    lua_setfield(L, -2, name);
  }
  for (const char* name : {"tonumber", "tostring"}) {
    lua_getfield(L, -1, name);
    lua_pushinteger(L, kPlain);
    lua_pushcclosure(L, callGuarded, 2);
    lua_setfield(L, -2, name);
  }
  for (const char* name : {"pcall", "xpcall"}) {
    lua_getfield(L, -1, name);
    lua_pushcclosure(L, callProtected, 1);
    lua_setfield(L, -2, name);
  }
  lua_getfield(L, -1, "setmetatable");
  lua_pushcclosure(L, setMetatable, 1);
  lua_setfield(L, -2, "setmetatable");
  setFunction(L, "print", answerNothing);
  setFunction(L, "WriteToLog", answerNothing);
  lua_pop(L, 4);
}

/// A global table with an index of its own.
void addTable(lua_State* L, const char* name, lua_CFunction index) {
  lua_newtable(L);
  lua_newtable(L);
  setFunction(L, "__index", index);
  lua_pushboolean(L, 0);
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_setglobal(L, name);
}

int setUp(lua_State* L) {
  openLibraries(L);
  if (luaL_dostring(L, kPrelude) != LUA_OK) return lua_error(L);
  describeValues(L);
  addTable(L, "ar1", indexAr1);
  addTable(L, "RSTD", indexRstd);
  lua_newtable(L);
  setFunction(L, "exit", exitScript);
  setFunction(L, "clock", answerClock);
  setFunction(L, "time", answerClock);
  lua_setglobal(L, "os");
  lua_newtable(L);
  setFunction(L, "getinfo", describeScript);
  lua_setglobal(L, "debug");
  lua_pushglobaltable(L);
  lua_newtable(L);
  setFunction(L, "__index", indexGlobals);
  lua_setmetatable(L, -2);
  return 0;
}

int noteErrorLine(lua_State* L) {
  sandboxOf(L).error_line = linesOf(L).innermost;
  return 1;
}

/// The error on top of the stack, as a person reads it.
InputError describeError(lua_State* L, int status, const Sandbox& sandbox) {
  std::string text = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "an error without a text";
  int line = sandbox.error_line;
  if (text.compare(0, 4, "lua:") == 0) {
    char* end = nullptr;
    line = static_cast<int>(std::strtol(text.c_str() + 4, &end, 10));
    text = end && *end == ':' ? end + 2 : text;
  }
  const std::string place = sandbox.file + (line > 0 ? ":" + std::to_string(line) : "") + ": ";
  if (sandbox.ran_too_long) {
    return InputError(place + "the script takes more than " + std::to_string(static_cast<int>(kMostSteps / 1e6)) +
                      " million steps; give one that only configures the radar");
  }
  if (status == LUA_ERRMEM) {
    return InputError(place + "the script takes more than " + std::to_string(kMostBytes >> 20) +
                      " MB; give one that only configures the radar");
  }
  if (status == LUA_ERRSYNTAX) return InputError(place + "is no Lua that can be read: " + text);
  return InputError(place + "the script does not run to its end: " + text);
}

void runScript(Sandbox& sandbox, const std::string& text) {
  const std::unique_ptr<lua_State, decltype(&lua_close)> state(lua_newstate(allocate, &sandbox), lua_close);
  lua_State* L = state.get();
  if (!L) throw std::runtime_error("Lua does not start: no memory");
  *static_cast<Sandbox**>(lua_getextraspace(L)) = &sandbox;
  lua_pushcfunction(L, setUp);
  if (lua_pcall(L, 0, 0, 0) != LUA_OK) throw std::runtime_error("Lua does not start");
  lua_pushcfunction(L, noteErrorLine);
  lua_sethook(L, countSteps, LUA_MASKCOUNT, kStepsPerCheck);
  int status = luaL_loadbufferx(L, text.data(), text.size(), kChunk, "t");
  if (status == LUA_OK) status = lua_pcall(L, 0, 0, 1);
  lua_sethook(L, nullptr, 0, 0);
  if (status == LUA_OK || (lua_islightuserdata(L, -1) && lua_touserdata(L, -1) == &kExit)) return;
  throw describeError(L, status, sandbox);
}

/// Whether both runs configure the same, apart from what is unknown in the first.
bool configureTheSame(const ScriptRecord& one, const ScriptRecord& other,
                      const std::function<bool(const std::string&)>& configures) {
  const auto settings = [&](const ScriptRecord& record) {
    std::vector<const ScriptCall*> calls;
    for (const ScriptCall& call : record.calls) {
      if (configures(call.name)) calls.push_back(&call);
    }
    return calls;
  };
  const auto sameArgument = [](const ScriptArgument& a, const ScriptArgument& b) {
    return !a.unknown_from.empty() || a == b;
  };
  const auto sameCall = [&](const ScriptCall* a, const ScriptCall* b) {
    return a->name == b->name &&
           std::equal(a->arguments.begin(), a->arguments.end(), b->arguments.begin(), b->arguments.end(), sameArgument);
  };
  const auto a = settings(one), b = settings(other);
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), sameCall);
}

}  // namespace

ScriptRecord recordScript(const std::string& file, const std::string& text, const std::string& part,
                          const std::function<bool(const std::string& name)>& configures) {
  const LuaSource source = readableLua(text);
  const auto run = [&](const Answers& answers) {
    auto sandbox = std::make_unique<Sandbox>();
    sandbox->file = file;
    sandbox->part = part;
    sandbox->answers = answers;
    spellPart(*sandbox, source);
    runScript(*sandbox, source.text);
    return sandbox;
  };
  const auto main = run({});
  // Once more with another answer, where the first one may have decided something.
  const auto demandTheSame = [&](const std::vector<std::string>& unknown, const Answers& answers) {
    if (unknown.empty()) return;
    std::unique_ptr<Sandbox> other;
    try {
      other = run(answers);
    } catch (const InputError&) {
      return;  // this answer cannot be the true one
    }
    if (!configureTheSame(main->record, other->record, configures)) {
      throw InputError(file + ": what the script configures depends on what only mmWave Studio can answer (" +
                       join(unknown, ", ") + "); write the value in its place");
    }
  };
  demandTheSame(main->unknown_called, {true, false});
  demandTheSame(main->unknown_compared, {false, true});
  return main->record;
}

}  // namespace mmradartwin
