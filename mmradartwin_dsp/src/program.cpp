#include "mmradartwin_dsp/program.h"

#include <CLI/CLI.hpp>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/progress_line.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "mmradartwin_dsp/text.h"

namespace mmradartwin {
namespace {

bool quiet = false;

void print(const char* kind, const std::string& text) {
  std::cerr << kind << ": " << oneLine(Output::namedIn(text)) << "\n";
}

void printAll(const char* kind, const std::vector<std::string>& lines) {
  constexpr std::size_t kShown = 8;
  const std::size_t shown = lines.size() <= kShown + 1 ? lines.size() : kShown;
  for (std::size_t i = 0; i < shown; ++i) print(kind, lines[i]);
  if (shown < lines.size()) print(kind, "and " + std::to_string(lines.size() - shown) + " more of the kind");
}

/// "" or what to say of the first word that looks like an option and is none. CLI11 itself would first ask for options
/// that are missing. The options of a command that follows are not looked at.
std::string unknownOption(const CLI::App& app, int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--") break;
    if (app.get_prefix_command() && word[0] != '-') break;
    if (word.size() < 2 || word[0] != '-' || !(word[1] == '-' || std::isalpha(static_cast<unsigned char>(word[1])))) {
      continue;
    }
    const std::string name = word.substr(0, word.find('='));
    if (app.get_option_no_throw(name) || (app.get_help_ptr() && app.get_help_ptr()->check_name(name))) continue;
    std::vector<std::string> known;
    for (const CLI::Option* option : app.get_options()) {
      for (const std::string& l : option->get_lnames()) known.push_back("--" + l);
    }
    return name + ": no such option; " + didYouMean(name, known) + "run with --help for the options";
  }
  return "";
}

}  // namespace

int runProgram(CLI::App& app, int argc, char** argv, const std::function<int()>& run) {
  if (argc > 0) app.name(std::filesystem::path(argv[0]).filename().string());
  app.set_version_flag("--version", app.get_name() + " " + programVersion(), "print the version and exit");
  app.add_flag("--quiet", quiet, "no progress and no notes on stderr; errors and warnings remain");
  try {
    const std::string unknown = unknownOption(app, argc, argv);
    if (!unknown.empty()) throw InputError(unknown);
    app.parse(argc, argv);
    checkFinite(app);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    print("error", std::string(error.what()) + "; run with --help for the options");
    return 2;
  } catch (const InputError& error) {
    print("error", error.what());
    return 2;
  }
  if (quiet) ProgressLine::silence();
  removeTemporaryFoldersOnSignals();
  int status = 1;
  std::string failure;
  try {
    return run();
  } catch (const InputError& error) {
    status = 2;
    failure = error.what();
  } catch (const std::filesystem::filesystem_error& error) {
    status = 2;
    const std::filesystem::path& place = error.path2().empty() ? error.path1() : error.path2();
    failure = place.string() + ": cannot be read or written (" + error.code().message() +
              "); check its name, rights and the free space";
  } catch (const std::bad_alloc&) {
    failure = "not enough memory";
  } catch (const std::length_error&) {
    failure = "not enough memory";
  } catch (const std::exception& error) {
    failure = error.what();
  }
  waitWhereInterrupted();
  print("error", failure);
  return status;
}

void checkFinite(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    if (option->get_type_name().rfind("FLOAT", 0) != 0) continue;
    for (const std::string& word : option->results()) {
      if (!std::isfinite(std::strtod(word.c_str(), nullptr))) {
        throw InputError(option->get_name() + ": '" + word + "' is no finite number");
      }
    }
  }
}

void note(const std::string& text) {
  if (!quiet) print("note", text);
}

void sayErrors(const std::vector<std::string>& errors) { printAll("error", errors); }

void noteAll(const std::vector<std::string>& notes) {
  if (!quiet) printAll("note", notes);
}

void addOutputArguments(CLI::App& app, OutputArguments& output, const std::string& description) {
  app.add_option("--output", output.path, description)->required();
  addForceArgument(app, output);
}

void addForceArgument(CLI::App& app, OutputArguments& output) {
  app.add_flag("--force", output.force, "replace an older result of that name, a folder as a whole");
}

void addJobsArgument(CLI::App& app, int& jobs) {
  app.add_option("--jobs", jobs, "threads; 0: one per core")->check(CLI::Range(0, 1024))->capture_default_str();
}

}  // namespace mmradartwin
