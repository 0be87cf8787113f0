/// XML as the readers of walls look at it: names whatever their capitals, texts without blanks around them. Entities
/// that a file defines itself are not known, so that no file grows.
#pragma once

#include <pugixml.hpp>

#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"

namespace tessera {

/// Writers differ in capitals.
[[nodiscard]] bool sameWord(std::string_view a, std::string_view b);
[[nodiscard]] pugi::xml_node childOf(const pugi::xml_node& node, std::string_view name);
[[nodiscard]] std::vector<pugi::xml_node> childrenOf(const pugi::xml_node& node, std::string_view name);
/// Empty where there is none.
[[nodiscard]] std::string attributeOf(const pugi::xml_node& node, std::string_view name);
[[nodiscard]] std::string_view withoutBlanks(std::string_view text);
/// What stands in a child, without blanks around it.
[[nodiscard]] std::string textOf(const pugi::xml_node& node, std::string_view child);

/// The root element, which is `name`. kBadInput: no XML, or another root; `path` is the file's.
[[nodiscard]] Expected<pugi::xml_node> readXml(pugi::xml_document& document, std::string_view text,
                                               std::string_view name, const std::string& path);

}  // namespace tessera
