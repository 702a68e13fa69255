#include "page/shipped_templates.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/text.h"
#include "shipped_texts.h"

namespace mmradartwin::page {

std::string shippedTemplate(const std::string& file) {
  static const std::map<std::string, std::string> texts = shippedTexts();
  const auto found = texts.find(file);
  if (found != texts.end()) return found->second;
  std::vector<std::string> known;
  for (const auto& item : texts) known.push_back(item.first);
  throw InputError("the report has no template " + file + "; " + didYouMean(file, known) +
                   "known: " + join(known, ", "));
}

const Glossary& docsGlossary() {
  static const Glossary glossary(kShippedGlossary);
  return glossary;
}

TemplateText templatesOf(const std::string& folder) {
  if (folder.empty()) return shippedTemplate;
  if (!std::filesystem::is_directory(folder)) throw InputError(folder + ": is no folder with templates of the report");
  return [folder](const std::string& file) -> TemplateFile {
    const std::string path = (std::filesystem::path(folder) / file).string();
    std::ifstream in(path);
    if (!in) return shippedTemplate(file);
    std::ostringstream text;
    text << in.rdbuf();
    return {text.str(), path};
  };
}

}  // namespace mmradartwin::page
