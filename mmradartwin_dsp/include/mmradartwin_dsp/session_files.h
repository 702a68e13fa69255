#pragma once

#include <optional>
#include <string>
#include <vector>

namespace mmradartwin {

/// A file of a session directory, byte for byte. `name` is relative to that directory.
struct StoredFile {
  std::string name;
  std::string bytes;
};

/// session.yaml, radar.yaml, poses.csv and every file that scene and twin name, and what those name in turn: values of
/// the YAML keys file, materials, mesh, poses, radar, scene and twin; `mtllib` and textures of OBJ files; buffers and
/// images of glTF. Captures are not among them. session.yaml comes first.
///
/// Files outside of the directory get names below external/: package/PKG/... for package://, root/... for absolute
/// paths, session/up/... for ../. Throws InputError for a YAML reference that leads nowhere.
std::vector<StoredFile> gatherSessionFiles(const std::string& session_file);
/// The absolute path by which a stored file was named; nothing where it was named otherwise.
std::optional<std::string> absolutePathOf(const StoredFile& file);

/// Where a session's captures stand relative to its directory, with {pose} for the name: as its session.yaml says, or
/// captures/{pose}.bin where that leads out of the directory.
std::string storedCapturePattern(const std::string& session_yaml);

/// The inverse: writes the files into `directory`. A reference to an outside file that stands on this machine too, with
/// the same bytes, is left alone, so that the directory is the original bit for bit. Where it does not, the stored copy
/// is written below external/ and the reference in the YAML file is made to point there: the session works anywhere.
/// A `captures` pattern that leads outside becomes storedCapturePattern(). session.yaml is written last.
void restoreSessionFiles(const std::vector<StoredFile>& files, const std::string& directory);

}  // namespace mmradartwin
