#include "common/request/Schema.h"

#include <fmt/format.h>

#include <cctype>
#include <set>

#include "common/request/Catalogue.h"
#include "common/request/Requests.h"

namespace tessera {
namespace {

constexpr std::size_t kWidest = 120;

/// "TreePage": "tree_page".
std::string snake(std::string_view name) {
    std::string text;
    for (const char c : name) {
        if (std::isupper(static_cast<unsigned char>(c)) && !text.empty()) text += '_';
        text += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
    return text;
}

std::string typeInHead(const MemberText& member) {
    if (member.type == "text") return "bytes";
    if (member.type == "word" || member.type == "uint16") return "uint32";
    return member.type;
}
std::string typeInRecord(const MemberText& member) {
    std::string type = member.type;
    if (type == "bool" || type == "word" || type == "text") type = "uint32";
    if (type == "Vector") type = "double[3]";
    if (type == "Rotation") type = "double[4]";
    if (type == "Place") type = "double[2]";
    if (member.count > 1) type += fmt::format("[{}]", member.count);
    return type;
}

std::string remarksOf(const MemberText& member) {
    std::string text = member.help;
    const auto add = [&](const std::string& more) {
        if (!more.empty()) text += (text.empty() ? "" : "; ") + more;
    };
    add(member.unit);
    add(member.bounds);
    std::string words;
    for (std::size_t i = 0; i < member.words.size(); ++i)
        words += fmt::format("{}{}: {}", i == 0 ? "" : ", ", i, member.words[i]);
    add(words);
    add(member.when);
    return text;
}

/// With its remarks behind it, or above it where they would not fit.
std::string lineOf(const std::string& indent, const std::string& line, const std::string& remarks) {
    if (remarks.empty()) return indent + line + "\n";
    if (indent.size() + line.size() + remarks.size() + 5 <= kWidest)
        return fmt::format("{}{}  // {}\n", indent, line, remarks);
    return fmt::format("{0}// {1}\n{0}{2}\n", indent, remarks, line);
}

class SchemaPrinter {
public:
    void print(std::string_view name, std::string_view help, const std::vector<MemberText>& members,
               bool within = false) {
        for (const MemberText& member : members)
            if (!member.isPart && !member.members.empty() && printed_.insert(member.type).second)
                print(member.type, "", member.members, true);
        if (!help.empty()) text_ += fmt::format("// {}.\n", help);
        if (members.empty()) {
            text_ += fmt::format("message {} {{}}\n", name);
            return;
        }
        text_ += fmt::format("message {} {{\n", name);
        std::size_t part = 0;
        for (const MemberText& member : members)
            if (member.isPart)
                printPart(member, part, within);
            else
                text_ += lineOf("  ",
                                fmt::format("{}{} {} = {};",
                                            member.many       ? "repeated "
                                            : member.optional ? "optional "
                                                              : "",
                                            typeInHead(member), member.name, member.number),
                                remarksOf(member));
        text_ += "}\n";
    }
    void add(const std::string& text) { text_ += text; }
    [[nodiscard]] std::string& text() { return text_; }

private:
    void printPart(const MemberText& member, std::size_t& part, bool within) {
        const std::string which = member.isRest ? "further parts"
                                  : within      ? "a part for each"
                                                : fmt::format("part {}", part++);
        const std::string remarks = remarksOf(member);
        std::string what =
            member.isRest || member.type == "bytes"
                ? "bytes"
                : fmt::format("{} of {} bytes", member.optional ? "nothing, or one" : "each", member.bytes);
        if (!member.isRest && member.members.empty() && member.many) what = member.type;
        text_ += fmt::format("  // {}: {}, {}{}{}\n", which, member.name, what, remarks.empty() ? "" : ": ", remarks);
        bool texts = false;
        std::size_t at = 0;
        printRecord("", member.members, at, texts);
        if (texts) text_ += fmt::format("  // part {}: the texts of these, one behind the other\n", part++);
    }
    void printRecord(const std::string& before, const std::vector<MemberText>& members, std::size_t& at, bool& texts) {
        for (const MemberText& member : members) {
            if (!member.members.empty()) {
                printRecord(before + member.name + ".", member.members, at, texts);
                continue;
            }
            const bool isText = member.type == "text";
            texts = texts || isText;
            std::string remarks = remarksOf(member);
            if (isText) remarks = "bytes of the text" + (remarks.empty() ? "" : ": " + remarks);
            if (member.type == "bool") remarks = "0 or 1" + (remarks.empty() ? "" : ": " + remarks);
            const std::string what = member.type == "reserved"
                                         ? fmt::format("{} bytes, zero", member.bytes)
                                         : fmt::format("{} {}{}", typeInRecord(member), before, member.name);
            text_ += fmt::format("  //   {:>3}  {}{}{}\n", at, what, remarks.empty() ? "" : "  ", remarks);
            at += member.bytes;
        }
    }

    std::string text_;
    std::set<std::string> printed_;
};

std::string helpOf(const RequestText& request) {
    std::string text = fmt::format("{}. Role {}; answered {}by {}", request.info.help, nameOf(request.info.role),
                                   request.info.answered == Answered::kLater ? "later " : "", request.answer);
    if (request.info.changes != Changes::kNothing)
        text += fmt::format("; changes the {}", nameOf(request.info.changes));
    return text;
}

}  // namespace

std::string applicationSchema() {
    SchemaPrinter printer;
    printer.add(
        "// What applications ask and what they are told: heads, with bulk as parts behind them "
        "(common/codec/Parts.h).\n"
        "// Printed from the descriptions in common/request (`tessera-ctl requests --proto`); do not change it by "
        "hand.\n"
        "// Texts are UTF-8. Numbers are never reused. Records of parts are little-endian; the first number is a "
        "byte's place.\n"
        "// clang-format off\n"
        "syntax = \"proto3\";\n"
        "package tessera.proto.application;\n\n"
        "message Vector {\n  double x = 1;\n  double y = 2;\n  double z = 3;\n}\n"
        "message Rotation {\n  double w = 1;\n  double x = 2;\n  double y = 3;\n  double z = 4;\n}\n\n// ---- "
        "requests\n\n");
    std::string heads;
    for (const RequestText& request : allRequests()) {
        printer.print(request.info.name, helpOf(request), request.members);
        heads += fmt::format("    {} {} = {};\n", request.info.name, snake(request.info.name), request.info.number);
    }
    std::string former;
    for (const int number : kFormerRequests) former += fmt::format("{}{}", former.empty() ? "" : ", ", number);
    printer.add(
        fmt::format("message RequestHead {{\n  reserved {};\n  oneof what {{\n{}  }}\n}}\n\n// ---- answers, and what "
                    "is told of frames\n\n",
                    former, heads));
    heads.clear();
    for (const ToldText& answer : allAnswers()) {
        printer.print(answer.info.name, answer.info.help, answer.members);
        heads += fmt::format("    {} {} = {};\n", answer.info.name, snake(answer.info.name), answer.info.answer);
    }
    printer.add(fmt::format("message AnswerHead {{\n  oneof what {{\n{}  }}\n}}\n", heads));
    heads.clear();
    for (const ToldText& notice : allNotices()) {
        if (notice.info.answer == 0) printer.print(notice.info.name, notice.info.help, notice.members);
        heads += fmt::format("    {} {} = {};\n", notice.info.name, snake(notice.info.name), notice.info.notice);
    }
    printer.add(fmt::format("message NoticeHead {{\n  oneof what {{\n{}  }}\n}}\n", heads));
    return std::move(printer.text());
}

}  // namespace tessera
