#pragma once

#include <memory>
#include <string>
#include <vector>

#include "mmradartwin_dsp/temporary_folder.h"

namespace mmradartwin {

/// What a program was told about its output.
struct OutputArguments {
  std::string path;
  bool force = false;  ///< an older result of that name is replaced
};

/// The file or folder that a program writes. All is written beside its place, under a name that begins with a dot, and
/// takes its place when it is complete; else nothing remains. A folder is replaced as a whole, so that files of two
/// runs never stand together.
class Output {
 public:
  /// A file. Throws InputError where `inputs` hold the output itself, where it exists and is not to be replaced, and
  /// where it cannot be made.
  static Output file(const OutputArguments& arguments, const std::vector<std::string>& inputs);
  /// A folder, likewise; one that is empty may exist. `mark` is a file or folder in it by which an older result is
  /// known: a folder without it is never replaced.
  static Output folder(const OutputArguments& arguments, const std::vector<std::string>& inputs,
                       const std::string& mark);

  /// Where to write; for a folder, the folder itself, which exists.
  const std::string& path() const { return path_; }
  /// As the user named it.
  const std::string& name() const { return name_; }
  /// Where it will stand: an absolute path, links followed.
  const std::string& place() const { return target_; }
  /// Puts what was written in its place. Throws InputError where that would replace what this process has read.
  void complete();

  /// A text for the user in which each output stands under its own name, not under the one that it is written under.
  static std::string namedIn(std::string text);
  /// From now on namedIn() names `path`, and what lies below it, so: what a bag holds is unpacked somewhere.
  static void showAs(const std::string& path, const std::string& name);

 private:
  Output(const OutputArguments& arguments, const std::vector<std::string>& inputs, const std::string& mark);
  void refuseInputs(const std::vector<std::string>& inputs) const;
  void refuseExisting(bool force, const std::string& mark) const;
  void makeStage();
  void replaceFolder() const;
  void refillFolder() const;

  std::string name_, target_, path_;
  bool is_folder_ = false, force_ = false, in_place_ = false;
  std::unique_ptr<MissingParents> parents_;  ///< goes after the stage
  std::unique_ptr<TemporaryFolder> stage_;
};

}  // namespace mmradartwin
