#include "common/access/ChosenTokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <set>
#include <utility>

#include "common/tls/Certificate.h"

namespace tessera {
namespace {

constexpr const char* kFile = "chosen-tokens";
constexpr std::string_view kLastLine = "end", kHasEnded = "ended";
constexpr std::size_t kHashDigits = 64, kServerDigits = 16;

/// The server and the protection that a token serves.
struct TokenUse {
    std::string server;      ///< `nameOf`
    std::string protection;  ///< `WallProtection::text`
};

/// A line "HASH SERVER PROTECTION" of a token that serves, or "HASH ended".
struct ChosenToken {
    std::string hash;
    std::optional<TokenUse> use;  ///< none: it has ended
};

/// Returns digits that stand for a server: its names may have spaces.
std::string nameOf(const NamedServer& server) {
    return hashOfToken(server.wall + "\n" + server.listen).substr(0, kServerDigits);
}

bool isHash(std::string_view word, std::size_t digits) {
    return word.size() == digits && word.find_first_not_of("0123456789abcdef") == word.npos;
}

std::optional<ChosenToken> tokenIn(std::string_view line) {
    const std::string_view hash = line.substr(0, line.find(' '));
    if (!isHash(hash, kHashDigits) || hash.size() == line.size()) return std::nullopt;
    const std::string_view rest = line.substr(hash.size() + 1);
    if (rest == kHasEnded) return ChosenToken{std::string(hash), std::nullopt};
    const std::string_view server = rest.substr(0, rest.find(' '));
    if (!isHash(server, kServerDigits) || server.size() + 1 >= rest.size()) return std::nullopt;
    return ChosenToken{std::string(hash), TokenUse{std::string(server), std::string(rest.substr(server.size() + 1))}};
}

std::string pathIn(const KeyFolder& folder) {
    return folder.path() + "/" + kFile;
}

Expected<std::vector<ChosenToken>> readFrom(const KeyFolder& folder) {
    const Expected<std::string> text = folder.readOwn(kFile);
    if (!text && text.error().code == ErrorCode::kNotFound) return std::vector<ChosenToken>();
    if (!text) return tl::unexpected(text.error());
    std::vector<ChosenToken> tokens;
    for (std::size_t at = 0, number = 1; at < text->size(); ++number) {
        const std::size_t end = std::min(text->find('\n', at), text->size());
        const std::string_view line = std::string_view(*text).substr(at, end - at);
        at = end + 1;
        if (line == kLastLine && at == text->size()) return tokens;
        std::optional<ChosenToken> token = tokenIn(line);
        if (!token)
            return fail(ErrorCode::kBadInput,
                        fmt::format("{}:{}: is damaged: write another token into every file of --token-file, then "
                                    "remove this one",
                                    pathIn(folder), number));
        tokens.push_back(std::move(*token));
    }
    return fail(ErrorCode::kBadInput,
                fmt::format("{}: its last line is missing: write another token into every file of --token-file, then "
                            "remove this one",
                            pathIn(folder)));
}

Expected<void> writeTo(const KeyFolder::Writer& writer, const std::vector<ChosenToken>& tokens) {
    std::string text;
    for (const ChosenToken& token : tokens)
        text += token.use ? fmt::format("{} {} {}\n", token.hash, token.use->server, token.use->protection)
                          : fmt::format("{} {}\n", token.hash, kHasEnded);
    return writer.write(kFile, fmt::format("{}{}\n", text, kLastLine));
}

/// Ends tokens by what they serve for. Returns whether there was one.
bool endWhere(std::vector<ChosenToken>& tokens, const std::function<bool(const TokenUse&)>& ends) {
    std::set<std::string> ended;
    for (const ChosenToken& token : tokens)
        if (token.use && ends(*token.use)) ended.insert(token.hash);
    // A token that several servers used has ended for all of them.
    std::erase_if(tokens, [&](const ChosenToken& token) { return ended.contains(token.hash); });
    for (const std::string& hash : ended) tokens.push_back({hash, std::nullopt});
    return !ended.empty();
}

Expected<void> endInFolder(const KeyFolder& folder, const std::function<bool(const TokenUse&)>& ends) {
    // Most servers have no such token: they need no folder that can be written.
    Expected<std::vector<ChosenToken>> tokens = readFrom(folder);
    if (!tokens) return tl::unexpected(tokens.error());
    if (!endWhere(*tokens, ends)) return {};
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    tokens = readFrom(folder);  // another server may have written meanwhile
    if (!tokens) return tl::unexpected(tokens.error());
    (void)endWhere(*tokens, ends);
    return writeTo(*writer, *tokens);
}

Expected<void> checkServes(const std::vector<ChosenToken>& tokens, const std::string& hash,
                           const WallProtection& protection) {
    const auto hasEnded = [&](const ChosenToken& token) {
        return token.hash == hash && (!token.use || !protection.continues(token.use->protection));
    };
    if (std::ranges::none_of(tokens, hasEnded)) return {};
    return fail(ErrorCode::kUsage,
                "its token has ended: its links were revoked, or a wall used it under another protection; write "
                "another one into it, such as $(tr -dc A-Za-z0-9 < /dev/urandom | head -c 43)");
}

Expected<void> useIn(const KeyFolder& folder, const ChosenToken& used, const WallProtection& protection) {
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    Expected<std::vector<ChosenToken>> tokens = readFrom(folder);
    if (!tokens) return tl::unexpected(tokens.error());
    if (const Expected<void> serves = checkServes(*tokens, used.hash, protection); !serves) return serves;
    std::erase_if(*tokens, [&](const ChosenToken& token) {
        return token.hash == used.hash && token.use->server == used.use->server;
    });
    if (tokens->size() >= ChosenTokens::kMostLines)
        return fail(ErrorCode::kLimit,
                    fmt::format("{0} keeps {1} tokens, the most there may be: start without --token-file, or remove "
                                "{0} once nobody has one of these tokens",
                                pathIn(folder), ChosenTokens::kMostLines));
    tokens->push_back(used);
    // A line that was there already is written, too: this shows that the end can be kept.
    return writeTo(*writer, *tokens);
}

}  // namespace

std::string stateFolder() {
    if (const char* said = std::getenv("XDG_STATE_HOME"); said != nullptr && said[0] == '/')
        return std::string(said) + "/tessera";
    if (const char* home = std::getenv("HOME"); home != nullptr && home[0] == '/')
        return std::string(home) + "/.local/state/tessera";
    return {};
}

ChosenTokens::ChosenTokens(const std::string& keysFolder) {
    if (!keysFolder.empty()) folders_.emplace_back(keysFolder);
    const std::string state = stateFolder();
    hasState_ = !state.empty();
    if (hasState_) folders_.emplace_back(state);
}

Expected<void> ChosenTokens::use(const std::string& token, const NamedServer& server,
                                 const WallProtection& protection) const {
    const auto notKept = [](ErrorCode code, const std::string& why) {
        return fail(code, fmt::format("the end of its token cannot be kept: {}; set XDG_STATE_HOME to a folder of "
                                      "yours that stays, or start without --token-file",
                                      why));
    };
    if (!hasState_) return notKept(ErrorCode::kRefused, "neither XDG_STATE_HOME nor HOME names one");
    const ChosenToken used{hashOfToken(token), TokenUse{nameOf(server), protection.text()}};
    // A token that is refused by one folder is not written into the other.
    for (const KeyFolder& folder : folders_)
        if (const Expected<std::vector<ChosenToken>> tokens = readFrom(folder); tokens)
            if (const Expected<void> serves = checkServes(*tokens, used.hash, protection); !serves) return serves;
    for (const KeyFolder& folder : folders_) {
        const Expected<void> kept = useIn(folder, used, protection);
        if (kept) continue;
        const ErrorCode code = kept.error().code;
        const bool hasCure = code == ErrorCode::kUsage || code == ErrorCode::kLimit || code == ErrorCode::kBadInput;
        return hasCure ? kept : notKept(code, kept.error().message);
    }
    return {};
}

Expected<void> ChosenTokens::endOthers(const NamedServer& server, const WallProtection& protection) const {
    const std::string name = nameOf(server);
    Expected<void> all;
    for (const KeyFolder& folder : folders_) {
        const Expected<void> ended = endInFolder(
            folder, [&](const TokenUse& use) { return use.server == name && !protection.continues(use.protection); });
        if (!ended) all = ended;
    }
    return all;
}

Expected<void> ChosenTokens::endIn(const KeyFolder& keys, const KeyFolder::Writer& writer) {
    Expected<std::vector<ChosenToken>> tokens = readFrom(keys);
    if (!tokens) return tl::unexpected(tokens.error());
    return endWhere(*tokens, [](const TokenUse&) { return true; }) ? writeTo(writer, *tokens) : Expected<void>();
}

Expected<void> ChosenTokens::endWithoutKeys() {
    const std::string state = stateFolder();
    if (state.empty()) return {};
    return endInFolder(KeyFolder(state), [](const TokenUse& use) { return !WallProtection::hasKeys(use.protection); });
}

}  // namespace tessera
