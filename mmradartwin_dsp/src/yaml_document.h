#pragma once

#include <yaml-cpp/yaml.h>

#include <string>

namespace mmradartwin {

/// The one document that `text` holds; a null node where there is none. Throws InputError that begins with `name`: not
/// valid YAML, a second document, an alias to what it stands in, or aliases that would grow to more than a million
/// nodes. What comes back is therefore a tree that can be walked.
YAML::Node parseYamlDocument(const std::string& text, const std::string& name);

}  // namespace mmradartwin
