#include "server/tools/keys/Tokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <set>

#include "common/access/ChosenTokens.h"
#include "common/access/LocalWalls.h"
#include "common/access/WallProtection.h"
#include "server/panel/Panel.h"
#include "server/tools/keys/Holders.h"
#include "server/tools/keys/KeyVerbs.h"

namespace tessera {
namespace {

/// Returns the tokens of a folder by their number and names, for people.
std::string countOf(const std::vector<KeptToken>& tokens) {
    std::set<std::string> names;
    for (const KeptToken& token : tokens) names.insert(token.pass.name);
    if (tokens.empty()) return "no tokens";
    return fmt::format("{} token{} ('{}')", tokens.size(), tokens.size() == 1 ? "" : "s", fmt::join(names, "', '"));
}

/// Ends what was handed out of the wall of these keys.
Expected<std::string> revokeLinksOf(const KeyFolder& folder) {
    std::error_code ignored;
    if (!std::filesystem::exists(folder.path() + "/issued", ignored))
        return fail(ErrorCode::kNotFound,
                    fmt::format("{}/issued is not there: links are revoked in the folder that the server reads",
                                folder.path()));
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    const Expected<std::vector<KeptToken>> tokens = folder.tokens();
    // The step that can fail without having ended anything comes first.
    if (const Expected<void> marked = renewLinksMark(folder.path()); !marked) return tl::unexpected(marked.error());
    if (const Expected<void> written = writer->writeTokens({}); !written)
        return failWith("links have ended, tokens have not", written.error());
    if (const Expected<TlsKeys> keys = folder.ofServer(); keys)
        if (const auto context = TlsContext::make(*keys); context)
            if (const Expected<void> forgotten = forgetStoppedWalls((*context)->authorityFingerprint()); !forgotten)
                return tl::unexpected(forgotten.error());
    if (const Expected<void> ended = ChosenTokens::endIn(folder, *writer); !ended) return tl::unexpected(ended.error());
    return fmt::format("revoked {} of {}, and all links and tokens that a server with these keys has handed out\n",
                       tokens ? countOf(*tokens) : "a damaged list of tokens", folder.path());
}

/// Ends what was handed out of walls that have no keys.
Expected<std::string> revokeLocalLinks() {
    const Expected<std::vector<LocalWall>> walls = endLocalLinks();
    if (!walls) return tl::unexpected(walls.error());
    std::vector<std::string> running;
    for (const LocalWall& wall : *walls) running.push_back(fmt::format("{} ({})", wall.wall, toString(wall.server)));
    const Expected<std::vector<std::string>> folders = runFolders();
    return fmt::format("revoked all links and tokens of this user's walls without keys ({}); {}\n",
                       fmt::join(folders.value_or(std::vector<std::string>()), ", "),
                       running.empty() ? "none runs now" : fmt::format("these run now: {}", fmt::join(running, ", ")));
}

}  // namespace

Expected<std::string> revokeLinks(const KeysArguments& arguments) {
    std::error_code ignored;
    const bool inFolder = arguments.keysNamed || std::filesystem::exists(arguments.keys, ignored);
    Expected<std::string> said = inFolder ? revokeLinksOf(KeyFolder(arguments.keys)) : std::string();
    if (!said) return said;
    if (!arguments.keysNamed) {
        const Expected<std::string> local = revokeLocalLinks();
        if (!local) return tl::unexpected(local.error());
        *said += *local;
        if (!inFolder) *said += "walls with keys keep theirs: --keys DIR names their folder\n";
    }
    return fmt::format(
        "{}Servers that run end them within a second, and close what came in with them. A file of --token-file needs "
        "another token.\nnext: tessera-ctl link --role ROLE prints a new link{}\n",
        *said, inFolder ? "; tessera-keys token NAME --role ROLE makes a new token" : "");
}

Expected<std::vector<KeptToken>> tokensIn(const KeyFolder& folder, DateTime now) {
    Expected<std::vector<KeptToken>> tokens = folder.tokens();
    if (tokens) std::erase_if(*tokens, [&](const KeptToken& each) { return each.until + std::chrono::days(1) < now; });
    return tokens;
}

Expected<std::string> revokeTokens(const KeyFolder& folder, const KeyFolder::Writer& writer, const std::string& name) {
    std::string bare = name;
    for (const std::string_view before : {"token/", "person/"})
        if (name.starts_with(before)) bare = name.substr(before.size());
    Expected<std::vector<KeptToken>> tokens = folder.tokens();
    if (!tokens) return tl::unexpected(tokens.error());
    const std::size_t count = std::erase_if(*tokens, [&](const KeptToken& each) { return each.pass.name == bare; });
    if (count == 0) return std::string();
    if (const Expected<void> written = writer.writeTokens(*tokens); !written) return tl::unexpected(written.error());
    return fmt::format("revoked {} token{} of '{}'\n", count, count == 1 ? "" : "s", bare);
}

Expected<std::string> issueToken(const KeysArguments& arguments) {
    constexpr std::size_t kMostTokens = 1000;
    const std::string& name = arguments.holders.front();
    if (const Expected<void> good = checkHolderName(name); !good) return tl::unexpected(good.error());
    if (arguments.role.empty() && arguments.panel.empty())
        return fail(ErrorCode::kUsage, "say what it lets in to: --role ROLE, or --panel FILE");
    std::string panel;
    if (!arguments.panel.empty()) {
        Expected<std::string> text = readPanelFile(arguments.panel);
        if (!text) return tl::unexpected(text.error());
        if (const Expected<Panel> read = parsePanel(*text, arguments.panel); !read) return tl::unexpected(read.error());
        panel = std::move(*text);
    }
    const KeyFolder folder(arguments.keys);
    // A folder that is not there would be made: a token lets in nobody where there is no server's key.
    if (const Expected<std::string> authority = folder.authorityCertificate(); !authority)
        return tl::unexpected(authority.error());
    const Expected<KeyFolder::Writer> writer = KeyFolder::Writer::open(folder);
    if (!writer) return tl::unexpected(writer.error());
    const DateTime now = std::chrono::system_clock::now();
    Expected<std::vector<KeptToken>> tokens = tokensIn(folder, now);
    if (!tokens) return tl::unexpected(tokens.error());
    if (tokens->size() >= kMostTokens)
        return fail(ErrorCode::kLimit, fmt::format("{} tokens hold already, the most there may be", kMostTokens));
    const std::string word = freshToken();
    const Role role = arguments.role == "viewer"                             ? Role::kViewer
                      : arguments.role == "editor" || arguments.role.empty() ? Role::kEditor
                                                                             : Role::kOperator;
    const Expected<std::string> panelName = panel.empty() ? std::string() : writer->writePanel(panel);
    if (!panelName) return tl::unexpected(panelName.error());
    const auto serves = std::chrono::duration_cast<std::chrono::seconds>(
        std::chrono::duration<double, std::ratio<3600>>(arguments.hours));
    tokens->push_back({.hash = hashOfToken(word), .pass = {name, role, *panelName}, .until = now + serves});
    if (const Expected<void> written = writer->writeTokens(*tokens); !written) return tl::unexpected(written.error());
    return fmt::format(
        "token of '{}', {}, until {}. It is shown this once: give it in TESSERA_TOKEN, or in a\n"
        "file that --token-file names.\n{}\n",
        name, panel.empty() ? nameOf(role) : std::string_view("of a panel"), toText(tokens->back().until), word);
}

}  // namespace tessera
