#pragma once

#include <string>
#include <vector>

namespace mmradartwin {

/// A script as people write it for Lua 5.1, made readable by a later Lua.
struct LuaSource {
  std::string text;  ///< lines keep their numbers
  /// Strings and numbers that the script compares something with, or that are keys of its tables, in their order.
  std::vector<std::string> compared_texts, compared_numbers;
  std::vector<std::string> assigned_names;  ///< of variables, or keys of tables that stand as names
};

/// Takes off a byte order mark and a first line with '#', and the backslash of escapes that Lua 5.1 does not know: it
/// reads them as the character itself, later versions refuse them ("C:\ti\mmwave").
LuaSource readableLua(const std::string& text);

}  // namespace mmradartwin
