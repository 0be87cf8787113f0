#include "server/tools/keys/KeysCommand.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>

#include "common/base/Nearest.h"
#include "common/base/Version.h"
#include "common/options/Options.h"
#include "server/tools/keys/KeyVerbs.h"

namespace tessera {
namespace {

// What the verbs take.

std::string emptyFault(const std::string& text) {
    return text.empty() ? "is empty" : "";
}

void takeOut(Options& options, KeysArguments& in) {
    options
        .option("--out", in.out,
                "The key goes there, for another machine, with the\nauthority's certificate; it is not kept here")
        .typeName("DIR")
        .check(emptyFault);
}

void takeNames(Options& options, KeysArguments& in) {
    options
        .option("--names", in.names,
                "Host names and addresses by which browsers know\nthe server (this machine's name, "
                "localhost,\n127.0.0.1, ::1)")
        .typeName("A,B,...")
        .check(emptyFault);
}

Option takeHolder(Options& options, KeysArguments& in, const std::string& help) {
    return options.option("NAME", in.holders, help).expected(1);
}

void takeInit(Options& options, KeysArguments& in) {
    options.option("--wall", in.wall, "Wall file, or a shipped wall's name").typeName("W").check(emptyFault).required();
    takeNames(options, in);
}

void takeHost(Options& options, KeysArguments& in) {
    takeHolder(options, in, "Of the host in the wall").required();
    takeOut(options, in);
}

Option takeRole(Options& options, KeysArguments& in) {
    return options.option("--role", in.role, "viewer, editor or operator")
        .typeName("ROLE")
        .oneOf({"viewer", "editor", "operator"}, ShowValues::kInErrorsAlone);
}

void takePerson(Options& options, KeysArguments& in) {
    takeHolder(options, in, "Of the person").required();
    takeRole(options, in).required();
    takeOut(options, in);
}

void takeToken(Options& options, KeysArguments& in) {
    constexpr double kShortest = 0.001, kLongest = 87'600;
    takeHolder(options, in, "Whose it is, to revoke it by").required();
    const Option role = takeRole(options, in);
    options.option("--panel", in.panel, "It reaches the fields of this panel alone; instead\nof a role")
        .typeName("FILE")
        .check(emptyFault)
        .excludes(role);
    options.option("--hours", in.hours, "For so long it holds (8)").typeName("H").range(kShortest, kLongest);
}

void takeRevoke(Options& options, KeysArguments& in) {
    const Option holder =
        takeHolder(options, in, "Of the host or person; host/NAME or person/NAME\nwhere both are called so");
    options
        .flag("--links", in.links,
              "All tokens, and links of tessera-ctl link, end;\nwithout --keys those of this user's walls "
              "without\nkeys, too")
        .excludes(holder);
}

void takeRenew(Options& options, KeysArguments& in) {
    const Option holders = options.option("NAME", in.holders, "Of hosts and people; server: the server's");
    options.flag("--all", in.all, "All that have not been revoked").excludes(holders);
    takeOut(options, in);
    takeNames(options, in);
}

void takeAuthority(Options& options, KeysArguments& in) {
    options.option("FILE", in.file, "Where it goes; -: to the standard output").check(emptyFault).required();
}

struct Verb {
    std::string name, description;
    void (*take)(Options&, KeysArguments&);  ///< null: it takes nothing
    Expected<std::string> (*run)(const KeysArguments&);
};

const std::array<Verb, 8>& verbs() {
    static const std::array<Verb, 8> all{
        {{"init", "Makes a wall's authority and its server's certificate.", takeInit, initKeys},
         {"host", "Makes a key of a render host.", takeHost, issueHost},
         {"person", "Makes a key of a person.", takePerson, issuePerson},
         {"token",
          "Makes a word that lets in somebody without a key, for some hours. It is shown\nonce, and kept as a hash.",
          takeToken, issueToken},
         {"list", "Says what has been made, and what of it is good.", nullptr, listKeys},
         {"revoke",
          "Lets a host or person in no more, by any of their keys or tokens; or ends all\n"
          "tokens and links that were handed out.",
          takeRevoke, revokeKeys},
         {"renew",
          "Makes another key. What was made before stays good until it ends. Without\n"
          "names: for all whose key ends within 30 days, or has ended, and has not been\nrevoked.",
          takeRenew, renewKeys},
         {"authority", "Writes the authority's certificate into a file, for browsers.", takeAuthority,
          exportAuthority}}};
    return all;
}

Option takeKeys(Options& options, KeysArguments& in) {
    return options.option("--keys", in.keys, "Folder of the keys (keys, in the current folder)")
        .typeName("DIR")
        .check(emptyFault);
}

/// What stands before a verb, or instead of one.
Expected<std::string> runWithoutVerb(const std::vector<std::string>& words) {
    KeysArguments unused;
    Options options("tessera-keys",
                    "Makes, renews and revokes the keys of a wall: its programs and people prove\n"
                    "with them who they are.\n\n"
                    "  init --wall W               the wall's authority, its server's certificate\n"
                    "  host NAME                   a key of a render host\n"
                    "  person NAME --role ROLE     a key of a person\n"
                    "  token NAME --role ROLE      a word that lets in without a key, for hours;\n"
                    "                              --panel FILE: to the fields of a panel alone\n"
                    "  list                        what has been made, and what of it is good\n"
                    "  revoke NAME                 lets a host or person in no more\n"
                    "  revoke --links              ends tokens and links that were handed out\n"
                    "  renew [NAME...]             other keys, for what ends soon or is named\n"
                    "  authority FILE              the authority's certificate, for browsers\n\n"
                    "tessera-keys VERB --help says more of each.",
                    versionText("tessera-keys"));
    takeKeys(options, unused);
    std::string none;
    options.option("VERB", none, "One of these, and what belongs to it").required();
    Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead) return fail(instead.error().code, instead.error().message + "; see --help");
    return instead->value_or("");
}

/// The number of words: there is none.
std::size_t placeOfVerb(const std::vector<std::string>& words) {
    for (std::size_t i = 0; i < words.size(); ++i) {
        if (words[i] == "--keys" || words[i] == "--completion")
            ++i;
        else if (!words[i].starts_with('-'))
            return i;
    }
    return words.size();
}

Expected<std::string> run(std::vector<std::string> words) {
    const std::size_t place = placeOfVerb(words);
    if (place == words.size()) return runWithoutVerb(words);
    const auto verb = std::ranges::find(verbs(), words[place], &Verb::name);
    if (verb == verbs().end()) {
        std::vector<std::string> known;
        for (const Verb& each : verbs()) known.push_back(each.name);
        const std::string nearest = nearestName(words[place], known);
        return fail(ErrorCode::kUsage,
                    fmt::format("there is no verb '{}'{}; see --help", words[place],
                                nearest.empty() ? "" : fmt::format(" (did you mean '{}'?)", nearest)));
    }
    words.erase(words.begin() + static_cast<std::ptrdiff_t>(place));
    KeysArguments arguments;
    Options options("tessera-keys " + verb->name, verb->description, versionText("tessera-keys"));
    if (verb->take != nullptr) verb->take(options, arguments);
    const Option named = takeKeys(options, arguments);
    const Expected<std::optional<std::string>> instead = options.read(words);
    if (!instead)
        return fail(instead.error().code,
                    fmt::format("{}: {}; see {} --help", verb->name, instead.error().message, verb->name));
    if (*instead) return **instead;
    arguments.keysNamed = named.given();
    // As shells complete them: "keys/" is named as "keys" is in what is said, and is not its own parent.
    for (std::string* folder : {&arguments.keys, &arguments.out})
        while (folder->size() > 1 && folder->ends_with('/')) folder->pop_back();
    return verb->run(arguments);
}

}  // namespace

int runKeys(const std::vector<std::string>& words) {
    Expected<std::string> said = run(words);
    if (said && (std::fwrite(said->data(), 1, said->size(), stdout) != said->size() || std::fflush(stdout) != 0))
        said = fail(ErrorCode::kFailed, "what there is to say cannot be written to stdout");
    if (said) return 0;
    fmt::print(stderr, "tessera-keys: {}\n", said.error().message);
    return exitCode(said.error().code);
}

}  // namespace tessera
