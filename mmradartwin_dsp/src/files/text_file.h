#pragma once

#include <cstddef>
#include <string>

namespace mmradartwin {

/// What a person writes, or a tool on his behalf, is kilobytes; a capture given in its place is refused by its size.
constexpr std::size_t kMaxTextBytes = 16u << 20;

/// All of a file, pipes included. Throws InputError: cannot be read (`advice` says what to give instead), or longer
/// than kMaxTextBytes.
std::string readTextFile(const std::string& file, const std::string& advice);

}  // namespace mmradartwin
