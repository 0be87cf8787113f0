#include "common/options/Completion.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <string_view>
#include <vector>

namespace tessera {
namespace {

/// What one option takes behind its name.
enum class Takes : std::uint8_t { kNothing, kWord, kPath, kOneOf };

struct OptionWords {
    std::vector<std::string> names;  ///< with their dashes
    std::string help;                ///< on one line
    std::string value;               ///< as --help names it
    Takes takes = Takes::kNothing;
    std::vector<std::string> choices;
};

std::vector<std::string> parted(std::string_view text, char at) {
    std::vector<std::string> parts;
    while (true) {
        const std::size_t end = text.find(at);
        parts.emplace_back(text.substr(0, end));
        if (end == std::string_view::npos) return parts;
        text.remove_prefix(end + 1);
    }
}

std::string onOneLine(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
}

bool isWord(const std::string& text) {
    return !text.empty() &&
           std::ranges::all_of(text, [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_'; });
}

/// "y|z", or "K:{auto,off}" as CLI11 has it.
std::vector<std::string> choicesOf(const std::string& type) {
    std::vector<std::string> found;
    if (const std::size_t open = type.find('{'), close = type.find('}', open); close != std::string::npos)
        found = parted(std::string_view(type).substr(open + 1, close - open - 1), ',');
    else if (type.find('|') != std::string::npos)
        found = parted(type, '|');
    return std::ranges::all_of(found, isWord) ? found : std::vector<std::string>();
}

OptionWords wordsOf(const CLI::Option& option) {
    OptionWords words;
    for (const std::string& name : option.get_lnames()) words.names.push_back("--" + name);
    for (const std::string& name : option.get_snames()) words.names.push_back("-" + name);
    words.help = onOneLine(option.get_description());
    if (option.get_items_expected_max() == 0) return words;
    const std::string type = option.get_type_name();
    words.value = type.substr(0, type.find(':'));
    words.choices = choicesOf(type);
    static const std::vector<std::string> paths = {"FILE", "DIR", "S", "W", "PROGRAM", "IN", "OUT", "FOLDER", "PATH"};
    words.takes = !words.choices.empty()                                 ? Takes::kOneOf
                  : std::ranges::find(paths, words.value) != paths.end() ? Takes::kPath
                                                                         : Takes::kWord;
    return words;
}

std::vector<OptionWords> optionsOf(const CLI::App& app) {
    std::vector<OptionWords> options;
    for (const CLI::Option* option : app.get_options())
        if (!option->get_positional() && !option->get_group().empty()) options.push_back(wordsOf(*option));
    return options;
}

/// Within single quotes of a shell.
std::string inQuotes(std::string_view text) {
    std::string out = "'";
    for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return out + "'";
}

std::string allNames(const std::vector<OptionWords>& options) {
    std::vector<std::string> names;
    for (const OptionWords& option : options) names.insert(names.end(), option.names.begin(), option.names.end());
    return fmt::format("{}", fmt::join(names, " "));
}

std::string functionName(const std::string& program) {
    std::string name = "_" + program;
    std::replace(name.begin(), name.end(), '-', '_');
    return name;
}

// ---- bash

/// Lines of a `case` over the word before; `verb`: only where that verb has been said.
void addBashValues(std::string& out, const std::vector<OptionWords>& options, std::string_view verb) {
    for (const OptionWords& option : options) {
        if (option.takes == Takes::kNothing) continue;
        std::vector<std::string> patterns;
        for (const std::string& name : option.names) patterns.push_back(fmt::format("{}:{}", verb, name));
        out += fmt::format("    {})", fmt::join(patterns, "|"));
        if (option.takes == Takes::kOneOf)
            out += fmt::format(" COMPREPLY=($(compgen -W '{}' -- \"$word\"))", fmt::join(option.choices, " "));
        if (option.takes == Takes::kPath) out += " compopt -o filenames; COMPREPLY=($(compgen -f -- \"$word\"))";
        out += option.takes == Takes::kWord ? " COMPREPLY=(); return;;\n" : "; return;;\n";
    }
}

std::string bash(const CLI::App& app, const std::vector<const CLI::App*>& verbs) {
    const std::string program = app.get_name(), name = functionName(program);
    std::vector<std::string> verbNames;
    for (const CLI::App* verb : verbs) verbNames.push_back(verb->get_name());
    std::string out =
        fmt::format("# Words of {} for bash: source this, or keep it as bash-completion/completions/{}.\n{}() {{\n",
                    program, program, name);
    out += "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]} verb= options i\n";
    if (!verbs.empty())
        out += fmt::format(
            "  for ((i = 1; i < COMP_CWORD; i++)); do\n"
            "    case \" {} \" in *\" ${{COMP_WORDS[i]}} \"*) verb=${{COMP_WORDS[i]}}; break;; esac\n  done\n",
            fmt::join(verbNames, " "));
    const std::vector<OptionWords> own = optionsOf(app);
    out += "  case $verb:$before in\n";
    for (const CLI::App* verb : verbs) addBashValues(out, optionsOf(*verb), verb->get_name());
    addBashValues(out, own, verbs.empty() ? "" : "*");
    out += "  esac\n  case $verb in\n";
    for (const CLI::App* verb : verbs)
        out += fmt::format("    {}) options='{}';;\n", verb->get_name(), allNames(optionsOf(*verb)));
    out += fmt::format("    *) options='{}{}{}';;\n  esac\n", fmt::join(verbNames, " "), verbs.empty() ? "" : " ",
                       allNames(own));
    out += fmt::format("  case $verb:$word in\n    {}*:-*) COMPREPLY=($(compgen -W \"$options\" -- \"$word\"));;\n",
                       verbs.empty() ? "" : ":*|");
    return out + fmt::format("  esac\n}}\ncomplete -o default -F {} {}\n", name, program);
}

// ---- zsh

std::string forZsh(std::string text) {
    std::string out;
    for (const char c : text) {
        if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
        out += c;
    }
    return out;
}

std::string zshArguments(const std::vector<OptionWords>& options, const std::string& indent) {
    std::string out;
    for (const OptionWords& option : options)
        for (const std::string& name : option.names) {
            std::string spec = fmt::format("*{}[{}]", name, forZsh(option.help));
            if (option.takes != Takes::kNothing) spec += ":" + forZsh(option.value) + ":";
            if (option.takes == Takes::kPath) spec += "_files";
            if (option.takes == Takes::kOneOf) spec += fmt::format("({})", fmt::join(option.choices, " "));
            out += fmt::format("{}{} \\\n", indent, inQuotes(spec));
        }
    return out + indent + "'*:file:_files'\n";
}

std::string zsh(const CLI::App& app, const std::vector<const CLI::App*>& verbs) {
    const std::string program = app.get_name(), name = functionName(program);
    std::string out = fmt::format("#compdef {}\n{}() {{\n", program, name);
    if (!verbs.empty()) {
        out += "  local -a verbs\n  verbs=(\n";
        for (const CLI::App* verb : verbs)
            out += fmt::format("    {}\n", inQuotes(verb->get_name() + ":" + onOneLine(verb->get_description())));
        out +=
            "  )\n  local i verb=\n  for ((i = 2; i < CURRENT; i++)); do\n"
            "    (( ${verbs[(I)${words[i]}:*]} )) && { verb=${words[i]}; break; }\n  done\n  case $verb in\n";
        for (const CLI::App* verb : verbs)
            out += fmt::format("    {}) _arguments \\\n{}      return;;\n", verb->get_name(),
                               zshArguments(optionsOf(*verb), "      "));
        out += "  esac\n  [[ ${words[CURRENT]} == -* ]] || _describe verb verbs\n";
    }
    out += "  _arguments \\\n" + zshArguments(optionsOf(app), "    ") + "}\n";
    return out + fmt::format("if [ \"$funcstack[1]\" = {} ]; then {} \"$@\"; else compdef {} {}; fi\n", name, name,
                             name, program);
}

// ---- fish

void addFish(std::string& out, const std::string& program, const std::vector<OptionWords>& options,
             const std::string& when) {
    for (const OptionWords& option : options) {
        out += fmt::format("complete -c {}", program);
        if (!when.empty()) out += fmt::format(" -n {}", inQuotes(when));
        for (const std::string& name : option.names)
            out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
        if (option.takes == Takes::kPath) out += " -rF";
        if (option.takes == Takes::kWord) out += " -x";
        if (option.takes == Takes::kOneOf)
            out += fmt::format(" -xa {}", inQuotes(fmt::format("{}", fmt::join(option.choices, " "))));
        out += fmt::format(" -d {}\n", inQuotes(option.help));
    }
}

std::string fish(const CLI::App& app, const std::vector<const CLI::App*>& verbs) {
    const std::string program = app.get_name();
    std::string out = fmt::format("# Words of {} for fish.\n", program);
    addFish(out, program, optionsOf(app), "");
    for (const CLI::App* verb : verbs) {
        out += fmt::format("complete -c {} -n __fish_use_subcommand -a {} -d {}\n", program, verb->get_name(),
                           inQuotes(onOneLine(verb->get_description())));
        addFish(out, program, optionsOf(*verb), "__fish_seen_subcommand_from " + verb->get_name());
    }
    return out;
}

std::string completionScript(const CLI::App& app, const std::string& name) {
    const std::vector<const CLI::App*> verbs = app.get_subcommands([](const CLI::App*) { return true; });
    return name == "zsh" ? zsh(app, verbs) : name == "fish" ? fish(app, verbs) : bash(app, verbs);
}

}  // namespace

void addCompletion(CLI::App& app) {
    const auto print = [&app](const std::string& name) { throw CLI::CallForVersion(completionScript(app, name), 0); };
    app.add_option_function<std::string>("--completion", print,
                                         "Print the script by which a shell completes\nthese words")
        ->type_name("bash|zsh|fish")
        ->check(CLI::IsMember({"bash", "zsh", "fish"}).description(""))
        ->trigger_on_parse();
}

}  // namespace tessera
