#include "page/run_values.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

namespace mmradartwin::page {
std::string shellWord(const std::string& word) {
  const std::string plain_signs = "_-./:=,+@%";
  const auto plain = [&](unsigned char c) {
    return std::isalnum(c) != 0 || plain_signs.find(static_cast<char>(c)) != std::string::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return word;
  std::string quoted = "'";
  for (char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string commandText(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    // The program by its name: where it was built says nothing to others.
    const std::string word = i == 0 ? std::filesystem::path(words[i]).filename().string() : words[i];
    text += (i == 0 ? "" : " ") + shellWord(word);
  }
  return text;
}

void addRunValues(const RunDescription& run, const std::vector<PoseProblem>& problems, PageValues& values) {
  values["version"] = run.version;
  values["command"] = commandText(run.command);
  values["recording"] = run.recording;
  std::vector<PageValues> texts, inputs, left_out;
  const auto addText = [&](const char* name, const std::string& text) {
    if (!text.empty()) texts.push_back({{"name", name}, {"text", text}});
  };
  addText("attribution.yaml", run.attribution_yaml);
  addText("radar.yaml", run.radar_yaml);
  addText("twin.yaml", run.twin_yaml);
  for (const InputFile& file : run.inputs) inputs.push_back({{"sha256", file.sha256}, {"file", file.file}});
  for (const PoseProblem& problem : problems) left_out.push_back({{"message", problem.message}});
  values["has_inputs"] = !inputs.empty();
  values["input_count"] = std::to_string(inputs.size());
  values["has_problems"] = !left_out.empty();
  values["texts"] = std::move(texts);
  values["inputs"] = std::move(inputs);
  values["problems"] = std::move(left_out);
}

}  // namespace mmradartwin::page
