#include "server/tools/walls/XmlText.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

namespace tessera {

bool sameWord(std::string_view a, std::string_view b) {
    return std::ranges::equal(a, b,
                              [](unsigned char x, unsigned char y) { return std::tolower(x) == std::tolower(y); });
}

pugi::xml_node childOf(const pugi::xml_node& node, std::string_view name) {
    for (const pugi::xml_node& child : node.children())
        if (sameWord(child.name(), name)) return child;
    return {};
}

std::vector<pugi::xml_node> childrenOf(const pugi::xml_node& node, std::string_view name) {
    std::vector<pugi::xml_node> found;
    for (const pugi::xml_node& child : node.children())
        if (sameWord(child.name(), name)) found.push_back(child);
    return found;
}

std::string attributeOf(const pugi::xml_node& node, std::string_view name) {
    for (const pugi::xml_attribute& attribute : node.attributes())
        if (sameWord(attribute.name(), name)) return attribute.value();
    return {};
}

std::string_view withoutBlanks(std::string_view text) {
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.front()))) text.remove_prefix(1);
    while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.remove_suffix(1);
    return text;
}

std::string textOf(const pugi::xml_node& node, std::string_view child) {
    return std::string(withoutBlanks(childOf(node, child).child_value()));
}

Expected<pugi::xml_node> readXml(pugi::xml_document& document, std::string_view text, std::string_view name,
                                 const std::string& path) {
    const pugi::xml_parse_result parsed = document.load_buffer(text.data(), text.size());
    if (!parsed) {
        const std::string_view before = text.substr(
            0, std::min<std::size_t>(text.size(), parsed.offset > 0 ? static_cast<std::size_t>(parsed.offset) : 0));
        return fail(ErrorCode::kBadInput,
                    fmt::format("{}:{}: not XML: {}; see that each element that begins ends too", path,
                                1 + std::ranges::count(before, '\n'), parsed.description()));
    }
    if (const pugi::xml_node root = childOf(document, name)) return root;
    return fail(ErrorCode::kBadInput, fmt::format("{}: there is no element {} around all", path, name));
}

}  // namespace tessera
