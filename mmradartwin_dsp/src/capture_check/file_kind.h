#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace mmradartwin {

/// Bytes of a file's beginning that foreignKind() looks at, at most.
constexpr std::size_t kFileKindBytes = 4096;

/// What a file is that holds no raw samples, by its first bytes, and what to do about it; "" where nothing speaks
/// against raw samples.
std::string foreignKind(const std::uint8_t* bytes, std::size_t size);

}  // namespace mmradartwin
