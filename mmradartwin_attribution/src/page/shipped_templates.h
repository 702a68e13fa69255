#pragma once

#include <string>

#include "page/glossary.h"
#include "page/page_template.h"

namespace mmradartwin::page {

/// A file of the package's folder report/ as it was built in. Throws InputError for a file that is not there; it lists
/// those that are.
std::string shippedTemplate(const std::string& file);
/// The glossary of the docs (docs/start/glossary.md) as it was built in.
const Glossary& docsGlossary();

/// Templates of a folder, and the shipped ones of files that it lacks; "" for these alone. Throws InputError for a
/// folder that is none.
TemplateText templatesOf(const std::string& folder);

}  // namespace mmradartwin::page
