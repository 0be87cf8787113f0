#include "tests/architecture/Rules.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <set>

namespace tessera::architecture {

namespace fs = std::filesystem;

namespace {

constexpr int kScreenLines = 60;

bool startsWith(const std::string& text, const std::string& prefix) {
    return text.compare(0, prefix.size(), prefix) == 0;
}

bool isGenerated(const std::string& path) {
    return path.size() > 5 && path.compare(path.size() - 5, 5, ".pb.h") == 0;
}

std::string moduleOf(const std::string& includePath) {
    if (isGenerated(includePath)) return "proto";
    const fs::path path = includePath;
    // Shaders stand in a folder of their own below their module's.
    return (path.extension() == ".glsl" ? path.parent_path() : path).parent_path().generic_string();
}

bool owns(const Layers::Owned& owned, const std::string& module) {
    return owned.owners.contains(module) || owned.owners.contains("*");
}

std::string listed(const std::set<std::string>& names) {
    return fmt::format("{}", fmt::join(names, ", "));
}

/// The first cycle that a depth-first search finds, as the path from a thing to itself; empty for none.
template <typename Edges>
std::vector<std::string> findCycle(const std::vector<std::string>& things, const Edges& edgesOf) {
    enum class State { kNew, kOpen, kDone };
    std::map<std::string, State> state;
    std::vector<std::string> path;
    const std::function<bool(const std::string&)> visit = [&](const std::string& thing) {
        state[thing] = State::kOpen;
        path.push_back(thing);
        for (const std::string& next : edgesOf(thing)) {
            if (state[next] == State::kOpen) {
                path.erase(path.begin(), std::find(path.begin(), path.end(), next));
                path.push_back(next);
                return true;
            }
            if (state[next] == State::kNew && visit(next)) return true;
        }
        path.pop_back();
        state[thing] = State::kDone;
        return false;
    };
    for (const std::string& thing : things) {
        if (state[thing] == State::kNew && visit(thing)) return path;
    }
    return {};
}

/// Standard C++ headers have neither folder nor extension.
bool isStandard(const std::string& path) {
    return path.find('/') == std::string::npos && path.find('.') == std::string::npos;
}

}  // namespace

Findings checkIncludes(const fs::path& root, const std::vector<SourceFile>& files, const Layers& layers) {
    Findings findings;
    std::set<std::string> unnamed;
    for (const SourceFile& file : files) {
        const auto module = layers.modules.find(file.folder);
        if (module == layers.modules.end()) {
            if (unnamed.insert(file.folder).second) {
                findings.push_back(
                    {file.path, 1, fmt::format("folder {} has code but no line in {}", file.folder, layers.file)});
            }
            continue;
        }
        for (const Include& include : file.includes) {
            if (!include.quoted) continue;
            const std::string target = moduleOf(include.path);
            if (!isGenerated(include.path) && !fs::exists(root / include.path)) {
                findings.push_back({file.path, include.line,
                                    fmt::format("\"{}\" is not a path from the root of the tree", include.path)});
            } else if (target != file.folder && !module->second.mayInclude.contains(target)) {
                findings.push_back(
                    {file.path, include.line,
                     fmt::format("{} may not include {} (\"{}\"); allowed: {} ({}:{})", file.folder, target,
                                 include.path, listed(module->second.mayInclude), layers.file, module->second.line)});
            }
        }
    }
    return findings;
}

Findings checkThirdParty(const std::vector<SourceFile>& files, const Layers& layers) {
    Findings findings;
    for (const SourceFile& file : files) {
        for (const Include& include : file.includes) {
            if (include.quoted) continue;
            const auto isPrefix = [&](const std::string& prefix) { return startsWith(include.path, prefix); };
            const auto owned = std::find_if(layers.thirdParty.begin(), layers.thirdParty.end(),
                                            [&](const auto& o) { return isPrefix(o.what); });
            if (owned != layers.thirdParty.end()) {
                if (owns(*owned, file.folder)) continue;
                findings.push_back({file.path, include.line,
                                    fmt::format("<{}> is for {} alone ({}:{})", include.path, listed(owned->owners),
                                                layers.file, owned->line)});
            } else if (!isStandard(include.path) &&
                       std::none_of(layers.system.begin(), layers.system.end(), isPrefix)) {
                findings.push_back(
                    {file.path, include.line, fmt::format("<{}> has no owner in {}", include.path, layers.file)});
            }
        }
    }
    return findings;
}

Findings checkAcyclic(const std::vector<SourceFile>& files, const Layers& layers) {
    Findings findings;
    std::map<std::string, const SourceFile*> byPath;
    std::vector<std::string> paths;
    for (const SourceFile& file : files) {
        byPath[file.path] = &file;
        paths.push_back(file.path);
    }
    const auto includesOf = [&](const std::string& path) {
        std::vector<std::string> next;
        for (const Include& include : byPath.at(path)->includes) {
            if (include.quoted && byPath.contains(include.path)) next.push_back(include.path);
        }
        return next;
    };
    if (const std::vector<std::string> cycle = findCycle(paths, includesOf); !cycle.empty()) {
        int line = 1;
        for (const Include& include : byPath.at(cycle[0])->includes) {
            if (cycle.size() > 1 && include.path == cycle[1]) line = include.line;
        }
        findings.push_back({cycle[0], line, fmt::format("includes go in a circle: {}", fmt::join(cycle, " -> "))});
    }

    std::vector<std::string> modules;
    for (const auto& [name, module] : layers.modules) modules.push_back(name);
    const auto allowedFrom = [&](const std::string& name) {
        std::vector<std::string> next;
        for (const std::string& other : layers.modules.at(name).mayInclude) {
            if (layers.modules.contains(other) && other != name) next.push_back(other);
        }
        return next;
    };
    if (const std::vector<std::string> cycle = findCycle(modules, allowedFrom); !cycle.empty()) {
        findings.push_back({layers.file, layers.modules.at(cycle[0]).line,
                            fmt::format("allowed includes go in a circle: {}", fmt::join(cycle, " -> "))});
    }
    return findings;
}

Findings checkReach(const std::vector<SourceFile>& files, const std::string& folder,
                    const std::vector<std::string>& known, double percent) {
    std::map<std::string, const SourceFile*> byPath;
    for (const SourceFile& file : files) byPath[file.path] = &file;
    std::map<std::string, int> reached;  // by header: lines of .cpp files
    int all = 0;
    for (const SourceFile& file : files) {
        if (!file.path.ends_with(".cpp")) continue;
        all += file.lines;
        std::set<std::string> seen;
        for (std::vector<const SourceFile*> open{&file}; !open.empty();) {
            const SourceFile& next = *open.back();
            open.pop_back();
            for (const Include& include : next.includes) {
                const auto found = byPath.find(include.path);
                if (include.quoted && found != byPath.end() && seen.insert(include.path).second)
                    open.push_back(found->second);
            }
        }
        for (const std::string& header : seen)
            if (byPath.at(header)->folder == folder) reached[header] += file.lines;
    }
    Findings findings;
    for (const auto& [header, lines] : reached) {
        const double share = 100.0 * lines / all;
        if (share > percent && std::ranges::find(known, header) == known.end())
            findings.push_back(
                {header, 1, fmt::format("{:.0f} % of the code includes it; at most {:.0f} may", share, percent)});
    }
    return findings;
}

Findings checkSides(const std::vector<SourceFile>& files, const Layers& layers) {
    const auto sideOf = [](const std::string& path) { return path.substr(0, path.find('/')); };
    const auto forbidden = [&](const std::string& from, const std::string& to) {
        const std::string a = sideOf(from), b = sideOf(to);
        return (a == "server" && b == "client") || (a == "client" && b == "server") ||
               (a == "common" && (b == "server" || b == "client" || b == "deploy"));
    };
    Findings findings;
    for (const SourceFile& file : files) {
        for (const Include& include : file.includes) {
            if (include.quoted && forbidden(file.path, include.path)) {
                findings.push_back({file.path, include.line,
                                    fmt::format("{} never includes {} (\"{}\")", sideOf(file.path),
                                                sideOf(include.path), include.path)});
            }
        }
    }
    for (const auto& [name, module] : layers.modules) {
        for (const std::string& other : module.mayInclude) {
            if (forbidden(name, other))
                findings.push_back({layers.file, module.line, fmt::format("{} must not be allowed {}", name, other)});
        }
    }
    return findings;
}

Findings checkWords(const std::vector<SourceFile>& files, const Layers& layers) {
    const auto isWord = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; };
    Findings findings;
    for (const SourceFile& file : files) {
        for (const Layers::Owned& word : layers.words) {
            if (owns(word, file.folder)) continue;
            for (std::size_t at = file.code.find(word.what); at != std::string::npos;
                 at = file.code.find(word.what, at + 1)) {
                const std::size_t end = at + word.what.size();
                if ((at > 0 && isWord(file.code[at - 1])) || (end < file.code.size() && isWord(file.code[end])))
                    continue;
                const auto line =
                    1 + std::count(file.code.begin(), file.code.begin() + static_cast<std::ptrdiff_t>(at), '\n');
                findings.push_back({file.path, static_cast<int>(line),
                                    fmt::format("{} is for {} ({}:{})", word.what,
                                                word.owners.empty() ? "nobody" : listed(word.owners) + " alone",
                                                layers.file, word.line)});
            }
        }
    }
    return findings;
}

Findings checkReadmes(const fs::path& root, const std::vector<SourceFile>& files,
                      const std::vector<std::string>& folders) {
    std::set<std::string> all(folders.begin(), folders.end());
    for (const SourceFile& file : files) all.insert(file.folder);
    Findings findings;
    for (const std::string& folder : all) {
        const std::string path = folder + "/README.md";
        std::ifstream in(root / path);
        if (!in) {
            findings.push_back(
                {path, 1,
                 "is missing: what the folder is for, what to read first, what it must not know, how it is tested"});
            continue;
        }
        int lines = 0;
        for (std::string line; std::getline(in, line);) ++lines;
        if (lines < 3) findings.push_back({path, 1, "says nothing"});
        if (lines > kScreenLines)
            findings.push_back(
                {path, kScreenLines, fmt::format("has {} lines, more than a screen of {}", lines, kScreenLines)});
    }
    return findings;
}

Findings checkLengths(const std::vector<SourceFile>& files, int mostLines) {
    Findings findings;
    for (const SourceFile& file : files) {
        if (file.lines > mostLines)
            findings.push_back(
                {file.path, mostLines,
                 fmt::format("has {} lines: at most {} are allowed; it holds two ideas", file.lines, mostLines)});
    }
    return findings;
}

Findings checkColumns(const fs::path& root, const std::vector<std::string>& paths, int mostColumns) {
    const auto begins = [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) != 0x80u; };  // a character
    Findings findings;
    for (const std::string& path : paths) {
        std::ifstream in(root / path);
        int lineNumber = 0;
        for (std::string line; std::getline(in, line);) {
            ++lineNumber;
            const auto columns = std::ranges::count_if(line, begins);
            if (columns > mostColumns)
                findings.push_back(
                    {path, lineNumber, fmt::format("has {} columns: at most {} are allowed", columns, mostColumns)});
        }
    }
    return findings;
}

Findings checkNamesAreUnique(const std::vector<SourceFile>& files) {
    static const std::regex kNamespace(R"(\bnamespace\b\s*([\w:]*)\s*$)"),
        kClass(R"(\b(?:class|struct)\s+(?:alignas\([^)]*\)\s*)?(\w+)\s*(?:final\s*)?(?::[^:].*)?$)");
    Findings findings;
    std::map<std::string, std::string> definedIn;
    for (const SourceFile& file : files) {
        // What encloses a brace: named and unnamed namespaces, and all else.
        std::vector<std::string> scopes;
        std::string head;  // since the last brace or semicolon
        int line = 1;
        for (const char c : file.code) {
            line += c == '\n' ? 1 : 0;
            if (c == '{') {
                std::smatch match;
                const bool global =
                    std::ranges::none_of(scopes, [](const std::string& scope) { return scope == "" || scope == "{"; });
                std::replace(head.begin(), head.end(), '\n', ' ');
                if (std::regex_search(head, match, kNamespace)) {
                    scopes.push_back(match[1]);
                } else {
                    if (global && std::regex_search(head, match, kClass)) {
                        const std::string name = fmt::format("{}::{}", fmt::join(scopes, "::"), match[1].str());
                        const auto [known, isNew] = definedIn.emplace(name, file.path);
                        if (!isNew && known->second != file.path)
                            findings.push_back(
                                {file.path, line, fmt::format("{} is defined in {} too", name, known->second)});
                    }
                    scopes.emplace_back("{");
                }
                head.clear();
            } else if (c == '}' || c == ';') {
                if (c == '}' && !scopes.empty()) scopes.pop_back();
                head.clear();
            } else {
                head += c;
            }
        }
    }
    return findings;
}

Findings checkLayersAreUsed(const std::vector<SourceFile>& files, const Layers& layers) {
    struct Used {
        std::set<std::string> modules;     ///< that a folder's files include
        std::set<std::string> thirdParty;  ///< headers
    };
    std::map<std::string, Used> folders;
    for (const SourceFile& file : files) {
        Used& used = folders[file.folder];
        for (const Include& include : file.includes) {
            if (include.quoted)
                used.modules.insert(moduleOf(include.path));
            else
                used.thirdParty.insert(include.path);
        }
    }
    const auto includes = [](const Used& used, const std::string& prefix) {
        return std::any_of(used.thirdParty.begin(), used.thirdParty.end(),
                           [&](const std::string& path) { return startsWith(path, prefix); });
    };
    Findings findings;
    for (const auto& [name, module] : layers.modules) {
        const auto folder = folders.find(name);
        if (folder == folders.end()) {
            findings.push_back({layers.file, module.line, fmt::format("{} is no folder with code", name)});
            continue;
        }
        for (const std::string& other : module.mayInclude)
            if (!folder->second.modules.contains(other))
                findings.push_back(
                    {layers.file, module.line, fmt::format("{} may include {}, and nothing in it does", name, other)});
    }
    for (const Layers::Owned& owned : layers.thirdParty) {
        if (std::none_of(folders.begin(), folders.end(),
                         [&](const auto& folder) { return includes(folder.second, owned.what); })) {
            findings.push_back({layers.file, owned.line, fmt::format("nobody includes {}", owned.what)});
            continue;
        }
        for (const std::string& owner : owned.owners) {
            const auto folder = folders.find(owner);
            if (owner != "*" && (folder == folders.end() || !includes(folder->second, owned.what)))
                findings.push_back({layers.file, owned.line,
                                    fmt::format("{} may include {}, and nothing in it does", owner, owned.what)});
        }
    }
    std::stable_sort(findings.begin(), findings.end(),
                     [](const Finding& a, const Finding& b) { return a.line < b.line; });
    return findings;
}

std::string report(const Findings& findings) {
    std::string text;
    for (const Finding& finding : findings)
        text += fmt::format("{}:{}: {}\n", finding.file, finding.line, finding.rule);
    return text;
}

}  // namespace tessera::architecture
