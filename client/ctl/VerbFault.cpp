#include "client/ctl/VerbFault.h"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <string_view>

#include "common/base/Nearest.h"

namespace tessera {
namespace {

/// The first word that stands neither for an option nor for the value of one; empty: there is none.
std::string firstWord(const CLI::App& app, const std::vector<std::string>& words) {
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (!words[i].starts_with('-')) return words[i];
        const CLI::Option* option = app.get_option_no_throw(words[i]);
        if (option != nullptr && option->get_items_expected_max() > 0) ++i;
    }
    return {};
}

}  // namespace

std::string verbFault(const CLI::App& app, const std::vector<std::string>& words) {
    std::vector<std::string> known;
    for (const CLI::App* verb : app.get_subcommands([](const CLI::App*) { return true; }))
        known.push_back(verb->get_name());
    if (const std::string said = firstWord(app, words); !said.empty()) {
        const std::string nearest = nearestName(said, known);
        return fmt::format("there is no verb '{}'{}; see tessera-ctl --help", said,
                           nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest));
    }
    std::string first = "say what to do. First of all:\n";
    for (const char* verb : {"status", "link", "tree", "load", "snapshot"})
        first += fmt::format("  tessera-ctl {:<10}  {}\n", verb, app.get_subcommand(verb)->get_description());
    return first + "see tessera-ctl --help for all verbs, tessera-ctl VERB --help for each";
}

std::string optionMeant(const CLI::App& verb, const std::vector<std::string>& words) {
    std::vector<std::string> known;
    for (const CLI::App* app = &verb; app != nullptr; app = app->get_parent())
        for (const CLI::Option* option : app->get_options())
            for (const std::string& name : option->get_lnames()) known.push_back("--" + name);
    for (const std::string& word : words) {
        const std::string said = word.substr(0, word.find('='));
        if (!said.starts_with("--") || std::ranges::find(known, said) != known.end()) continue;
        const std::string nearest = nearestName(said, known);
        return nearest.empty() ? nearest : fmt::format(" (did you mean '{}'?)", nearest);
    }
    return {};
}

std::vector<std::string> withVerbFirst(const CLI::App& app, std::vector<std::string> words) {
    if (words.empty() || !words[0].starts_with('-')) return words;
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i].starts_with('-')) {
            const CLI::Option* option = app.get_option_no_throw(words[i]);
            if (option != nullptr && option->get_items_expected_max() > 0) ++i;
            continue;
        }
        // Any other word is the value of an option that the verb knows.
        if (app.get_subcommands([&](const CLI::App* verb) { return verb->get_name() == words[i]; }).empty()) continue;
        const auto verb = words.begin() + static_cast<std::ptrdiff_t>(i);
        std::rotate(words.begin(), verb, verb + 1);
        break;
    }
    return words;
}

}  // namespace tessera
