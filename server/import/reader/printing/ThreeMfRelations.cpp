#include "server/import/reader/printing/ThreeMfRelations.h"

#include <charconv>

#include "server/import/reader/printing/XmlStream.h"

namespace tessera {
namespace {

class RelationReader : public XmlReader {
public:
    std::string target;

    void begin(std::string_view name, const XmlAttributes& attributes) override {
        constexpr std::string_view kModel = "/3dmodel";
        if (name == "Relationship" && target.empty() && attributes["Type"].ends_with(kModel))
            target = attributes["Target"];
    }
    void end() override {}
    void text(std::string_view) override {}
};

}  // namespace

std::string startPartOf(ByteSpan relations) {
    RelationReader reader;
    XmlStream stream(reader);
    if (!stream.feed(relations) || !stream.finish()) return {};
    return reader.target;
}

std::string partNameOf(std::string_view path, bool isDecoded) {
    std::string name;
    for (std::size_t at = path.find_first_not_of('/'); at < path.size(); ++at) {
        unsigned char letter = 0;
        const char* const digits = path.data() + at + 1;
        if (isDecoded && path[at] == '%' && path.size() - at > 2 &&
            std::from_chars(digits, digits + 2, letter, 16).ptr == digits + 2) {
            name += static_cast<char>(letter);
            at += 2;
        } else {
            name += path[at];
        }
    }
    const std::string framed = '/' + name + '/';
    return framed.find("/../") == framed.npos && name.find('\0') == name.npos ? name : std::string();
}

}  // namespace tessera
