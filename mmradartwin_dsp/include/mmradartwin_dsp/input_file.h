#pragma once

#include <string>

namespace mmradartwin {

/// Throws InputError for a pipe, a socket or a device: reading one may wait, or go on, without end. Whoever opens a
/// file for reading asks this first; a file or folder passes, and so does what is not there, which its reader says
/// better. The file counts as read from then on.
void requireRegularFile(const std::string& file);

/// True for a file that was read by this process, whatever its name: another link to it is the same file.
bool wasRead(const std::string& file);

}  // namespace mmradartwin
