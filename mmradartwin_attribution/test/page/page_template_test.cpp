#include "page/page_template.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>

#include "mmradartwin_dsp/input_error.h"
#include "mmradartwin_dsp/temporary_folder.h"
#include "page/page_picture.h"
#include "page/shipped_templates.h"

namespace mmradartwin::page {
namespace {

const Glossary& words() {
  static const Glossary glossary(
      "| word | meaning |\n|---|---|\n| bin, cell | a `part` of a map |\n| nat | a unit & more |\n");
  return glossary;
}

/// Files of a template, of which page.html is the page.
PageTemplate made(const std::map<std::string, std::string>& files, const std::string& names) {
  const auto text = [&](const std::string& file) {
    if (files.count(file) == 0) throw InputError("no " + file);
    return files.at(file);
  };
  return {"page.html", text, pageNames(names), words()};
}

std::string errorOf(const std::map<std::string, std::string>& files, const std::string& names) {
  try {
    made(files, names);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(PageTemplate, FillsGapsAndEscapesTexts) {
  const PageTemplate page = made({{"page.html", "<p>{{ a }}{{! said to editors }}, {{b}}</p>"}}, "a b");
  EXPECT_EQ(page.render({{"a", "x < \"y\" & z"}, {"b", PageValue::html("<i>1</i>")}}),
            "<p>x &lt; &quot;y&quot; &amp; z, <i>1</i></p>");
}

TEST(PageTemplate, RepeatsListsAndSeesNamesAround) {
  const PageTemplate page =
      made({{"page.html", "{{#poses}}[{{name}} of {{all}}{{#worst}}!{{/worst}}]{{/poses}}{{^poses}}none{{/poses}}"}},
           "all poses[name worst[]]");
  const std::vector<PageValues> poses = {{{"name", "1"}, {"worst", true}}, {{"name", "2"}, {"worst", false}}};
  EXPECT_EQ(page.render({{"all", "2"}, {"poses", poses}}), "[1 of 2!][2 of 2]");
  EXPECT_EQ(page.render({{"all", "0"}, {"poses", std::vector<PageValues>()}}), "none");
}

TEST(PageTemplate, IncludesFiles) {
  const PageTemplate page = made({{"page.html", "a{{>part.html}}d"}, {"part.html", "{{name}}c"}}, "name");
  EXPECT_EQ(page.render({{"name", "b"}}), "abcd");
}

TEST(PageTemplate, WordsShowTheirMeaning) {
  const PageTemplate page = made({{"page.html", "{{?nat|nats}} {{=cell}}"}}, "");
  EXPECT_EQ(
      page.render({}),
      "<span class=\"word\" tabindex=\"0\">nats<span class=\"meaning\" role=\"tooltip\"><b>nats</b>: a unit &amp; "
      "more</span></span> a part of a map");
}

TEST(PageTemplate, ErrorsNameFileLineAndWhatIsKnown) {
  const std::map<std::string, std::string> wrong_name = {{"page.html", "a\n\n{{>part.html}}"},
                                                         {"part.html", "b\n{{pose_nmae}}"}};
  EXPECT_EQ(errorOf(wrong_name, "pose_name all"),
            "part.html:2: there is no name 'pose_nmae'; did you mean 'pose_name'? known here: all, pose_name");
  // Of a list without items, too: the page is checked before there are any.
  EXPECT_EQ(errorOf({{"page.html", "{{#poses}}\n{{other}}{{/poses}}"}}, "all poses[name]"),
            "page.html:2: there is no name 'other'; known here: all, name, poses");
  EXPECT_EQ(errorOf({{"page.html", "{{?natt}}"}}, ""),
            "page.html:1: the glossary has no word 'natt'; did you mean 'nat'? known: bin, cell, nat");
  EXPECT_EQ(errorOf({{"page.html", "\n{{#poses}}"}}, "poses[]"), "page.html:2: {{#poses}} is not closed");
  EXPECT_EQ(errorOf({{"page.html", "{{#poses}}{{/all}}"}}, "poses[]"), "page.html:1: {{/all}} closes {{#poses}}");
  EXPECT_EQ(errorOf({{"page.html", "{{/all}}"}}, "all"), "page.html:1: {{/all}} closes nothing");
  EXPECT_EQ(errorOf({{"page.html", "a {{all"}}, "all"), "page.html:1: a {{ without its }}");
  EXPECT_EQ(errorOf({{"page.html", "{{poses}}"}}, "poses[]"),
            "page.html:1: 'poses' is a list: write {{#poses}} ... {{/poses}}");
  EXPECT_EQ(errorOf({{"page.html", "{{#all}}{{/all}}"}}, "all"),
            "page.html:1: 'all' is a single value and no list: write {{all}}");
  EXPECT_EQ(errorOf({{"page.html", "{{>page.html}}"}}, ""), "page.html: includes itself");
}

TEST(PageTemplate, AValueThatWasForgottenIsAnErrorOfTheProgram) {
  EXPECT_THROW(made({{"page.html", "{{a}}"}}, "a").render({}), std::logic_error);
}

TEST(ShippedTemplates, AreTakenWhereAFolderLacksAFile) {
  const TemporaryFolder folder;
  std::ofstream(std::filesystem::path(folder.path()) / "run.html") << "mine";
  const TemplateText text = templatesOf(folder.path());
  EXPECT_EQ(text("run.html").text, "mine");
  EXPECT_EQ(text("run.html").name, folder.path() + "/run.html") << "what errors call it";
  EXPECT_EQ(text("head.html").text, shippedTemplate("head.html"));
  EXPECT_THROW(text("other.html"), InputError);
  EXPECT_THROW(templatesOf(folder.path() + "/none"), InputError);
}

// RFC 4648, section 10.
TEST(PagePicture, IsBase64) {
  const auto of = [](const std::string& text) { return base64({text.begin(), text.end()}); };
  EXPECT_EQ(of(""), "");
  EXPECT_EQ(of("f"), "Zg==");
  EXPECT_EQ(of("fo"), "Zm8=");
  EXPECT_EQ(of("foo"), "Zm9v");
  EXPECT_EQ(of("foobar"), "Zm9vYmFy");
}

}  // namespace
}  // namespace mmradartwin::page
