// The classic encoding of X3D, which is VRML with other words, as a document of the XML encoding.

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "server/import/coin/X3dDocument.h"

namespace tessera {
namespace {

/// Nesting is bounded before (kMostBrackets).
class ClassicParser {
public:
    explicit ClassicParser(std::string_view text) : text_(text) { next(); }

    Expected<void> parse(pugi::xml_document& document) {
        pugi::xml_node scene = document.append_child("X3D").append_child("Scene");
        while (!token_.empty() && problem_.empty()) statement(scene);
        if (problem_.empty()) return {};
        return fail(ErrorCode::kBadInput, fmt::format("line {}: {}", line_, problem_));
    }

private:
    static bool isMark(char c) { return c == '{' || c == '}' || c == '[' || c == ']'; }
    [[nodiscard]] bool isValue() const {
        const char c = token_.empty() ? '\0' : token_.front();
        return c == '"' || c == '-' || c == '+' || c == '.' || (c >= '0' && c <= '9') || token_ == "TRUE" ||
               token_ == "FALSE" || token_ == "true" || token_ == "false";
    }

    void next() {
        while (at_ < text_.size()) {
            const char c = text_[at_];
            if (c == '\n') ++line_;
            if (c == '#')
                at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
            else if (c == ' ' || c == '\t' || c == '\r' || c == '\n' || c == ',')
                ++at_;
            else
                break;
        }
        const std::size_t begin = at_;
        if (at_ >= text_.size()) {
            token_ = {};
            return;
        }
        if (isMark(text_[at_])) {
            ++at_;
        } else if (text_[at_] == '"') {
            for (++at_; at_ < text_.size() && text_[at_] != '"'; ++at_) {
                if (text_[at_] == '\n') ++line_;
                if (text_[at_] == '\\') ++at_;
            }
            at_ = std::min(at_ + 1, text_.size());
        } else {
            at_ = std::min(text_.find_first_of(" \t\r\n,{}[]\"#", at_), text_.size());
        }
        token_ = text_.substr(begin, at_ - begin);
    }

    std::string take() {
        std::string taken(token_);
        next();
        return taken;
    }
    void expect(std::string_view wanted) {
        if (token_ != wanted && problem_.empty())
            problem_ = token_.empty() ? fmt::format("the file ends where '{}' should stand", wanted)
                                      : fmt::format("'{}' stands where '{}' should", token_.substr(0, 40), wanted);
        next();
    }

    void statement(pugi::xml_node into) {
        if (token_ == "PROFILE" || token_ == "COMPONENT") {
            next();
            next();
            // "Name:2" in one word or in two.
            if (token_.starts_with(':')) next();
        } else if (token_ == "META") {
            for (int i = 0; i < 3; ++i) next();
        } else if (token_ == "UNIT") {
            for (int i = 0; i < 4; ++i) next();
            into.append_child("UNIT");
        } else if (token_ == "IMPORT" || token_ == "EXPORT") {
            into.append_child(take().c_str());
            next();
            if (token_ == "AS") {
                next();
                next();
            }
        } else if (token_ == "ROUTE") {
            next();
            route(into);
        } else if (token_ == "PROTO" || token_ == "EXTERNPROTO") {
            proto(into);
        } else if (isMark(token_.front()) || isValue()) {
            expect("a node");
        } else {
            node(into, "");
        }
    }

    void route(pugi::xml_node into) {
        const std::string from = take();
        expect("TO");
        const std::string to = take();
        pugi::xml_node element = into.append_child("ROUTE");
        for (const auto& [text, node, field] :
             {std::tuple(from, "fromNode", "fromField"), std::tuple(to, "toNode", "toField")}) {
            const std::size_t dot = text.find('.');
            element.append_attribute(node) = text.substr(0, dot).c_str();
            element.append_attribute(field) = dot == text.npos ? "" : text.substr(dot + 1).c_str();
        }
    }

    void proto(pugi::xml_node into) {
        const bool outside = take() == "EXTERNPROTO";
        pugi::xml_node element = into.append_child(outside ? "ExternProtoDeclare" : "ProtoDeclare");
        const std::string name = take();
        element.append_attribute("name") = name.c_str();
        protos_.push_back(name);
        expect("[");
        pugi::xml_node fields = outside ? element : element.append_child("ProtoInterface");
        while (!token_.empty() && token_ != "]" && problem_.empty()) interfaceField(fields, !outside);
        expect("]");
        if (outside) {
            const bool several = token_ == "[";
            if (several) next();
            element.append_attribute("url") = values().c_str();
            if (several) expect("]");
            return;
        }
        expect("{");
        pugi::xml_node bodyOf = element.append_child("ProtoBody");
        while (!token_.empty() && token_ != "}" && problem_.empty()) statement(bodyOf);
        expect("}");
    }

    [[nodiscard]] bool isAccess() const {
        static constexpr std::array<std::string_view, 8> kWords = {
            "inputOnly", "outputOnly", "initializeOnly", "inputOutput", "eventIn", "eventOut", "field", "exposedField"};
        return std::ranges::find(kWords, token_) != kWords.end();
    }

    void interfaceField(pugi::xml_node into, bool values) {
        if (!isAccess()) return expect("a field");
        const std::string access = take(), type = take(), name = take();
        pugi::xml_node field = into.append_child("field");
        field.append_attribute("accessType") = access.c_str();
        field.append_attribute("type") = type.c_str();
        field.append_attribute("name") = name.c_str();
        if (token_ == "IS") {
            next();
            connect(into, name, take());
        } else if (values && access != "inputOnly" && access != "outputOnly" && access != "eventIn" &&
                   access != "eventOut") {
            fieldValue(field, "value", "");
        }
    }

    static void connect(pugi::xml_node node, const std::string& field, const std::string& proto) {
        pugi::xml_node is = node.child("IS") ? node.child("IS") : node.append_child("IS");
        pugi::xml_node element = is.append_child("connect");
        element.append_attribute("nodeField") = field.c_str();
        element.append_attribute("protoField") = proto.c_str();
    }

    std::string values() {
        std::string all;
        while (isValue()) {
            if (!all.empty()) all.push_back(' ');
            all += take();
        }
        return all;
    }

    /// Numbers and strings become the attribute, nodes become children for the field `container`.
    void fieldValue(pugi::xml_node element, const std::string& attribute, const std::string& container) {
        const bool list = token_ == "[";
        if (list) next();
        if (token_ == "NULL") {
            next();
        } else if (isValue()) {
            element.append_attribute(attribute.c_str()) = values().c_str();
        } else if (!list) {
            node(element, container);
        } else {
            while (!token_.empty() && token_ != "]" && problem_.empty()) node(element, container);
        }
        if (list) expect("]");
    }

    void node(pugi::xml_node into, const std::string& container) {
        std::string def, use;
        if (token_ == "DEF") {
            next();
            def = take();
        } else if (token_ == "USE") {
            next();
            use = take();
        }
        const std::string kind = use.empty() ? take() : "Group";
        if (kind.empty() || isMark(kind.front()) || kind.front() == '"') {
            if (problem_.empty()) problem_ = fmt::format("'{}' stands where a node should", kind.substr(0, 40));
            return;
        }
        const bool instance = use.empty() && std::ranges::find(protos_, kind) != protos_.end();
        pugi::xml_node element = into.append_child(instance ? "ProtoInstance" : kind.c_str());
        if (instance) element.append_attribute("name") = kind.c_str();
        if (!def.empty()) element.append_attribute("DEF") = def.c_str();
        if (!use.empty()) element.append_attribute("USE") = use.c_str();
        if (!container.empty()) element.append_attribute("containerField") = container.c_str();
        if (!use.empty()) return;
        expect("{");
        while (!token_.empty() && token_ != "}" && problem_.empty()) {
            if (token_ == "ROUTE" || token_ == "PROTO" || token_ == "EXTERNPROTO") {
                statement(element);
                continue;
            }
            if (isAccess() && kind == "Script") {
                interfaceField(element, true);
                continue;
            }
            const std::string field = take();
            if (token_ == "IS") {
                next();
                connect(element, field, take());
            } else if (instance) {
                pugi::xml_node held = element.append_child("fieldValue");
                held.append_attribute("name") = field.c_str();
                fieldValue(held, "value", "");
            } else {
                fieldValue(element, field, field);
            }
        }
        expect("}");
    }

    std::string_view text_, token_;
    std::size_t at_ = 0, line_ = 1;
    std::string problem_;
    std::vector<std::string> protos_;
};

}  // namespace

Expected<void> parseX3dClassic(std::string_view text, pugi::xml_document& document) {
    return ClassicParser(text).parse(document);
}

}  // namespace tessera
