#include "mmradartwin_dsp/program.h"

#include <CLI/CLI.hpp>
#include <boost/timer/progress_display.hpp>
#include <exception>
#include <iostream>

#include "mmradartwin_dsp/input_error.h"

namespace mmradartwin {

int runProgram(CLI::App& app, int argc, char** argv, const std::function<int()>& run) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help
    std::cerr << "error: " << error.what() << "; run with --help for the options\n";
    return 2;
  }
  try {
    return run();
  } catch (const InputError& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 2;
  } catch (const std::exception& error) {
    std::cerr << "error: " << error.what() << "\n";
    return 1;
  }
}

struct ProgressBar::Display {
  explicit Display(int total) : bar(static_cast<unsigned long>(total), std::cerr) {}
  boost::timer::progress_display bar;
};

ProgressBar::ProgressBar(int total) : display_(std::make_unique<Display>(total)) {}
ProgressBar::~ProgressBar() = default;

void ProgressBar::show(int done) {
  const auto target = static_cast<unsigned long>(done);
  if (target > display_->bar.count()) display_->bar += target - display_->bar.count();
}

}  // namespace mmradartwin
