#include "settings/lua_script.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <lua.hpp>
#include <map>
#include <memory>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "settings/lua_source.h"

// Functions of Lua that raise an error do not return, and no destructor runs: where one is called, no object that has
// to be destroyed is alive.
namespace mmradartwin {
namespace {

constexpr int kStepsPerCheck = 1000;
constexpr double kMostSteps = 1e7;
constexpr double kStepsOfACall = 100;  ///< of a function that costs more than a step of Lua
constexpr std::size_t kMostBytes = 64u << 20;
constexpr std::size_t kMostCalls = 20000;
constexpr std::size_t kMostArguments = 64;
constexpr int kDeepestFrame = 100;  ///< of those that are searched for a line

constexpr char kChunk[] = "=lua";
constexpr char kUnknown[] = "mmradartwin.unknown";
constexpr char kExit = 0;  ///< its address is the error that ends the script

/// What unknown functions and comparisons answer in a run.
struct Answers {
  bool calls_give_zero = false;
  bool first_comparison = false;  ///< those of a line alternate, so that loops end
};

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

Sandbox& sandboxOf(lua_State* L) { return **static_cast<Sandbox**>(lua_getextraspace(L)); }

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

void countSteps(lua_State* L, lua_Debug*);

/// Ends the script where it has taken too many steps, whatever it catches.
void addSteps(lua_State* L, double steps) {
  Sandbox& sandbox = sandboxOf(L);
  sandbox.steps += steps;
  if (sandbox.steps <= kMostSteps) return;
  sandbox.ran_too_long = true;
  lua_sethook(L, countSteps, LUA_MASKCOUNT, 1);
  luaL_error(L, "too many steps");
}

void countSteps(lua_State* L, lua_Debug*) { addSteps(L, kStepsPerCheck); }

struct Lines {
  int innermost = 0, outermost = 0;  ///< of the script; 0: none
};

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

bool isUnknown(lua_State* L, int index) { return luaL_testudata(L, index, kUnknown) != nullptr; }

/// Where an unknown value comes from. The text lives as long as the value.
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

/// Whether a name asks which part this is: partId, ar1.GetPartNumber, DEVICE, radarType.
bool asksForPart(const char* name) {
  std::string plain;
  for (const char* c = name; *c && plain.size() < 40; ++c) {
    if (*c != '_') plain += static_cast<char>(std::tolower(static_cast<unsigned char>(*c)));
  }
  for (const char* verb : {"get", "read", "query"}) {
    if (plain.compare(0, std::strlen(verb), verb) == 0) plain.erase(0, std::strlen(verb));
  }
  const std::size_t whole = plain.size();
  for (const char* kind : {"id", "number", "num", "no", "name", "type", "variant", "model"}) {
    const std::size_t size = std::strlen(kind);
    if (plain.size() > size && plain.compare(plain.size() - size, size, kind) == 0) plain.erase(plain.size() - size);
  }
  const auto isOneOf = [&plain](std::initializer_list<const char*> things) {
    return std::any_of(things.begin(), things.end(), [&plain](const char* thing) { return plain == thing; });
  };
  if (isOneOf({"part", "device", "chip", "chipversion", "platform", "devicepart", "radarpart"})) return true;
  return plain.size() < whole && isOneOf({"radar", "sensor", "board", "evm", "soc"});
}

/// Notes that the part was asked for. Whether it is known.
bool knowsPart(lua_State* L) {
  Sandbox& sandbox = sandboxOf(L);
  if (sandbox.part.empty() && sandbox.record.part_asked.empty()) sandbox.record.part_asked = placeOf(L);
  return !sandbox.part.empty();
}

/// As the script spells it where it compares: names and types are sooner text, all else a number.
int answerPart(lua_State* L, const char* question) {
  if (!knowsPart(L)) return answerNil(L);
  const Sandbox& sandbox = sandboxOf(L);
  bool is_text = sandbox.part_number == 0;
  for (const char* part : {"ame", "ype", "ariant", "NAME", "TYPE", "VARIANT"}) {
    if (std::strstr(question, part) && !sandbox.part_text.empty()) is_text = true;
  }
  if (is_text) {
    lua_pushstring(L, sandbox.part_text.empty() ? sandbox.part_name.c_str() : sandbox.part_text.c_str());
  } else {
    lua_pushinteger(L, static_cast<lua_Integer>(sandbox.part_number));
  }
  return 1;
}

int indexGlobals(lua_State* L) {
  if (lua_type(L, 2) == LUA_TSTRING && asksForPart(lua_tostring(L, 2))) return answerPart(L, lua_tostring(L, 2));
  return answerNil(L);
}

/// Codes of the parts in their fuses, the usual one first.
const std::map<std::string, std::vector<std::uint32_t>>& fuseCodes() {
  static const std::map<std::string, std::vector<std::uint32_t>> codes = {
      {"1243", {0x20, 0x21, 0x80}},
      {"1443", {0xa0, 0x40}},
      {"1642", {0x60, 0x61, 0x04, 0x62, 0x67, 0x66, 0x01, 0xc0, 0xc1}},
      {"1843", {0x70, 0x71, 0xd0, 0x05}},
      {"2243", {0x31, 0x32, 0x30, 0x06}},
      {"6443", {0xe0, 0xe1, 0xe2, 0xe3, 0xe4}},
      {"6843", {0xe0, 0xe1, 0xe2, 0xe3, 0xe4}}};
  return codes;
}

/// The registers by which TI's scripts tell parts apart. Bits 25:18 of the first hold the part's code; the second tells
/// the first silicon's parts apart, the third holds the silicon's version.
std::uint32_t registerValue(const Sandbox& sandbox, std::uint32_t address) {
  if (address == 0xffffe214) return sandbox.fuse_code << 18;
  if (address == 0xffffe210) return sandbox.part == "1243" ? 0 : sandbox.part == "1443" ? 1 : 2;
  if (address == 0xffffe218) return 3;
  return 0;
}

int readRegister(lua_State* L) {
  const auto address = static_cast<std::uint32_t>(lua_tointeger(L, 1));
  const auto first = std::clamp<lua_Integer>(luaL_optinteger(L, 2, 0), 0, 31);
  const auto last = std::clamp<lua_Integer>(luaL_optinteger(L, 3, 31), first, 31);
  if (address == 0xffffe214 || address == 0xffffe210) knowsPart(L);
  const std::uint64_t mask = (std::uint64_t{1} << (last - first + 1)) - 1;
  const std::uint64_t value = registerValue(sandboxOf(L), address) >> first & mask;
  lua_pushinteger(L, 0);
  lua_pushinteger(L, static_cast<lua_Integer>(value));
  return 2;
}

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

void setFunction(lua_State* L, const char* name, lua_CFunction function) {
  lua_pushcfunction(L, function);
  lua_setfield(L, -2, name);
}

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

/// Whether a word of the script means the part: "AWR1843", "xwr18xx".
bool spells(std::string word, const std::string& part) {
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool one_word =
      std::all_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
  return one_word && (word.find(part) != std::string::npos || word.find(part.substr(0, 2) + "xx") != std::string::npos);
}

/// How the script spells its part where it compares with it.
void spellPart(Sandbox& sandbox, const LuaSource& source) {
  if (sandbox.part.empty()) return;
  const auto compares = [&](double value) {
    return std::any_of(source.compared_numbers.begin(), source.compared_numbers.end(),
                       [&](const std::string& number) { return std::strtod(number.c_str(), nullptr) == value; });
  };
  const double part = std::strtod(sandbox.part.c_str(), nullptr);
  if (compares(part)) sandbox.part_number = part;
  if (const auto codes = fuseCodes().find(sandbox.part); codes != fuseCodes().end()) {
    const auto used = std::find_if(codes->second.begin(), codes->second.end(), compares);
    sandbox.fuse_code = used == codes->second.end() ? codes->second.front() : *used;
  }
  const auto firstOf = [&](const std::vector<std::string>& words) {
    const auto found =
        std::find_if(words.begin(), words.end(), [&](const std::string& word) { return spells(word, sandbox.part); });
    return found == words.end() ? std::string() : *found;
  };
  sandbox.part_text = firstOf(source.compared_texts);
  if (sandbox.part_text.empty()) sandbox.part_text = firstOf(source.assigned_names);
  sandbox.part_name = "XWR" + sandbox.part;
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
