#include "settings/lua_part.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "settings/lua_unknown.h"

namespace mmradartwin::lua {
namespace {

/// Notes that the part was asked for. Whether it is known.
bool knowsPart(lua_State* L) {
  Sandbox& sandbox = sandboxOf(L);
  if (sandbox.part.empty() && sandbox.record.part_asked.empty()) sandbox.record.part_asked = placeOf(L);
  return !sandbox.part.empty();
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

/// Whether a word of the script means the part: "AWR1843", "xwr18xx".
bool spells(std::string word, const std::string& part) {
  std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool one_word =
      std::all_of(word.begin(), word.end(), [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '-'; });
  return one_word && (word.find(part) != std::string::npos || word.find(part.substr(0, 2) + "xx") != std::string::npos);
}

}  // namespace

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

}  // namespace mmradartwin::lua
