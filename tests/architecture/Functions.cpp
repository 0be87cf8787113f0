#include "tests/architecture/Functions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>
#include <tuple>
#include <utility>

namespace tessera::architecture {

namespace {

bool isWordChar(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_';
}
bool isSpace(char c) {
    return std::isspace(static_cast<unsigned char>(c));
}

/// Words before a parenthesis that is no function's.
bool takesParentheses(std::string_view word) {
    static const std::set<std::string_view> kWords{"alignas",  "decltype", "noexcept",
                                                   "requires", "explicit", "__attribute__"};
    return kWords.contains(word);
}
bool isKeyword(std::string_view word) {
    static const std::set<std::string_view> kWords{
        "if",    "for",      "while",   "switch",   "return",   "sizeof", "static_assert", "catch",
        "throw", "new",      "delete",  "bool",     "void",     "int",    "double",        "float",
        "char",  "unsigned", "long",    "short",    "auto",     "const",  "class",         "struct",
        "enum",  "union",    "defined", "typename", "template", "using",  "signed",        "static"};
    return kWords.contains(word);
}

/// Preprocessor lines are blanked: a macro's braces need not match.
std::string withoutDirectives(std::string code) {
    for (std::size_t at = 0; at < code.size();) {
        std::size_t end = std::min(code.find('\n', at), code.size());
        if (const std::size_t first = code.find_first_not_of(" \t", at); first < end && code[first] == '#') {
            while (end < code.size() && code[end - 1] == '\\') end = std::min(code.find('\n', end + 1), code.size());
            for (std::size_t i = at; i < end; ++i)
                if (code[i] != '\n') code[i] = ' ';
        }
        at = end + 1;
    }
    return code;
}

struct Declarator {
    std::string name;
    std::size_t at = 0;  ///< in the head
    std::string owner;   ///< the class before ::
};

/// The function that a head (what stands before ; or {) declares. Its name is the first word before a parenthesis that
/// is outside of <>, () and []. Of an operator or destructor the name is empty.
std::optional<Declarator> declaratorIn(std::string_view head) {
    int angles = 0, others = 0;
    for (std::size_t i = 0; i < head.size();) {
        const char c = head[i];
        if (isWordChar(c)) {
            std::size_t end = i;
            while (end < head.size() && isWordChar(head[end])) ++end;
            const std::string_view word = head.substr(i, end - i);
            std::size_t next = end;
            while (next < head.size() && isSpace(head[next])) ++next;
            const bool beforeParenthesis = next < head.size() && head[next] == '(';
            if (word == "operator") return Declarator{};
            if (beforeParenthesis && takesParentheses(word)) {
                int open = 0;
                for (; next < head.size(); ++next) {
                    open += head[next] == '(' ? 1 : head[next] == ')' ? -1 : 0;
                    if (open == 0) break;
                }
                i = next + 1;
                continue;
            }
            if (beforeParenthesis && angles == 0 && others == 0) {
                std::size_t first = next + 1;
                while (first < head.size() && isSpace(head[first])) ++first;
                if (isKeyword(word) || (first < head.size() && (head[first] == '*' || head[first] == '&')))
                    return std::nullopt;  // a pointer to a function
                std::size_t before = i;
                while (before > 0 && isSpace(head[before - 1])) --before;
                if (before > 0 && head[before - 1] == '~') return Declarator{};
                static const std::regex kOwner(R"((\w+)\s*(<[^()]*>)?\s*::\s*$)");
                std::match_results<std::string_view::const_iterator> match;
                Declarator out{std::string(word), i, {}};
                const std::string_view left = head.substr(0, i);
                if (std::regex_search(left.begin(), left.end(), match, kOwner)) out.owner = match[1].str();
                return out;
            }
            i = end;
            continue;
        }
        if (c == '<') ++angles;
        if (c == '>' && (i == 0 || head[i - 1] != '-')) angles = std::max(0, angles - 1);
        if (c == '(' || c == '[') ++others;
        if (c == ')' || c == ']') --others;
        if (c == '=' && angles == 0 && others == 0) return std::nullopt;  // a value
        ++i;
    }
    return std::nullopt;
}

bool hasWord(std::string_view text, std::string_view word) {
    for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
        const std::size_t end = at + word.size();
        if ((at == 0 || !isWordChar(text[at - 1])) && (end == text.size() || !isWordChar(text[end]))) return true;
    }
    return false;
}

/// The name of the class whose body a { after this head opens.
std::optional<std::string> classIn(std::string_view head) {
    static const std::regex kClass(
        R"(\b(?:class|struct|union)\s+(?:alignas\([^)]*\)\s*)?(\w+)\s*(?:<[^{]*>)?\s*(?:final\s*)?(?::[^:][^]*)?$)");
    std::match_results<std::string_view::const_iterator> match;
    if (!std::regex_search(head.begin(), head.end(), match, kClass)) return std::nullopt;
    return match[1].str();
}

}  // namespace

std::vector<Function> functionsOf(const SourceFile& file) {
    const std::string code = withoutDirectives(file.code);
    std::vector<Function> functions;
    std::vector<std::string> scopes;  // of namespaces nothing, of classes their names
    std::size_t start = 0;            // of the head
    int parentheses = 0;
    const auto closing = [&](std::size_t at) {
        int open = 0;
        for (; at < code.size(); ++at) {
            open += code[at] == '{' ? 1 : code[at] == '}' ? -1 : 0;
            if (open == 0) break;
        }
        return at;
    };
    for (std::size_t i = 0; i < code.size(); ++i) {
        const char c = code[i];
        parentheses += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (parentheses != 0) continue;
        if (c == ':' && i + 1 < code.size() && code[i + 1] != ':') {
            const std::string_view left = std::string_view(code).substr(start, i - start);
            for (const std::string_view access : {"public", "protected", "private"})
                if (left.ends_with(access)) start = i + 1;
            continue;
        }
        if (c == '}') {
            if (!scopes.empty()) scopes.pop_back();
            start = i + 1;
            continue;
        }
        if (c != ';' && c != '{') continue;
        const std::string_view head = std::string_view(code).substr(start, i - start);
        const bool opens = c == '{';
        const std::optional<Declarator> declared = declaratorIn(head);
        if (opens && !declared) {
            if (hasWord(head, "namespace") || hasWord(head, "extern")) {
                scopes.emplace_back();
            } else if (const auto name = hasWord(head, "enum") ? std::nullopt : classIn(head)) {
                scopes.push_back(*name);
            } else {
                i = closing(i);  // an enumeration's or a variable's
                continue;        // up to its ;
            }
            start = i + 1;
            continue;
        }
        const bool isMade = declared && (declared->name.empty() || declared->owner == declared->name ||
                                         (!scopes.empty() && scopes.back() == declared->name));
        const bool isMacro = declared && std::none_of(declared->name.begin(), declared->name.end(), [](char x) {
                                 return std::islower(static_cast<unsigned char>(x));
                             });
        std::size_t end = i;
        if (opens) end = closing(i);
        if (declared && !isMade && !isMacro) {
            Function function{
                .name = declared->name, .overrides = hasWord(head, "override"), .at = start + declared->at};
            function.line = 1 + static_cast<int>(std::count(
                                    code.begin(), code.begin() + static_cast<std::ptrdiff_t>(function.at), '\n'));
            if (opens) {
                function.from = i;
                function.to = end;
            }
            functions.push_back(std::move(function));
        }
        i = end;
        // What a constructor's members are made of may stand in braces before its body.
        start = i + (i < code.size() ? 1 : 0);
    }
    return functions;
}

std::vector<Uncalled> parseUncalled(const std::string& text, const std::string& listFile, Findings& findings) {
    std::vector<Uncalled> out;
    std::istringstream lines(text);
    static const std::regex kLine(R"((\S+) (\w+): (\S.*))");
    int number = 0;
    for (std::string line; std::getline(lines, line);) {
        ++number;
        if (line.empty() || line.starts_with('#')) continue;
        std::smatch match;
        if (std::regex_match(line, match, kLine))
            out.push_back({match[1], match[2], match[3], number});
        else
            findings.push_back({listFile, number, "a line is FILE NAME: REASON"});
    }
    return out;
}

Findings checkFunctionsAreCalled(const std::vector<SourceFile>& files, const std::vector<Uncalled>& known,
                                 const std::string& listFile) {
    std::map<std::string, std::vector<std::pair<std::string, int>>> declared;  // in headers: file and line by name
    std::set<std::string> called{"main"}, names, overriding, plain;
    std::map<std::string, std::set<std::string>> wordsIn;  // by function: names of functions; outside of all: ""
    std::vector<std::vector<Function>> functions;
    for (const SourceFile& file : files) {
        functions.push_back(functionsOf(file));
        for (const Function& function : functions.back()) {
            names.insert(function.name);
            // A definition outside of its class does not say that it overrides.
            if (function.overrides)
                overriding.insert(function.name);
            else if (function.from == function.to)
                plain.insert(function.name);
            if (file.path.ends_with(".h") && !function.overrides)
                declared[function.name].emplace_back(file.path, function.line);
        }
    }
    // Where no class here has it first, another's library calls it.
    std::ranges::set_difference(overriding, plain, std::inserter(called, called.end()));
    for (std::size_t f = 0; f < files.size(); ++f) {
        const std::string& code = files[f].code;
        std::set<std::size_t> ownNames;
        for (const Function& function : functions[f]) ownNames.insert(function.at);
        std::size_t next = 0;
        for (std::size_t at = 0; at < code.size();) {
            if (!isWordChar(code[at])) {
                ++at;
                continue;
            }
            std::size_t end = at;
            while (end < code.size() && isWordChar(code[end])) ++end;
            while (next < functions[f].size() && functions[f][next].to <= at && functions[f][next].at < at) ++next;
            const std::string word = code.substr(at, end - at);
            if (names.contains(word) && !ownNames.contains(at)) {
                const bool inside =
                    next < functions[f].size() && functions[f][next].from < at && at < functions[f][next].to;
                wordsIn[inside ? functions[f][next].name : std::string()].insert(word);
            }
            at = end;
        }
    }
    // From what is called on to what that calls.
    std::vector<std::string> open(called.begin(), called.end());
    const auto follow = [&](const std::string& caller) {
        for (const std::string& word : wordsIn[caller])
            if (called.insert(word).second) open.push_back(word);
    };
    const auto followAll = [&] {
        while (!open.empty()) {
            const std::string caller = std::move(open.back());
            open.pop_back();
            follow(caller);
        }
    };
    follow("");
    followAll();

    Findings findings;
    std::set<std::pair<std::string, std::string>> kept;
    const std::set<std::string> calledByProduct = called;
    for (const Uncalled& line : known) {
        const auto found = declared.find(line.name);
        if (found == declared.end() || std::none_of(found->second.begin(), found->second.end(),
                                                    [&](const auto& place) { return place.first == line.file; }))
            findings.push_back({listFile, line.line, fmt::format("{} declares no {}", line.file, line.name)});
        else if (calledByProduct.contains(line.name))
            findings.push_back({listFile, line.line, fmt::format("{} is called: it needs no line", line.name)});
        kept.emplace(line.file, line.name);
        follow(line.name);
    }
    followAll();
    for (const auto& [name, places] : declared) {
        if (called.contains(name)) continue;
        for (const auto& [file, line] : places)
            if (!kept.contains({file, name}))
                findings.push_back({file, line, fmt::format("no product code calls {}", name)});
    }
    std::stable_sort(findings.begin(), findings.end(), [](const Finding& a, const Finding& b) {
        return std::tie(a.file, a.line) < std::tie(b.file, b.line);
    });
    return findings;
}

}  // namespace tessera::architecture
