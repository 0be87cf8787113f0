#include "server/tools/keys/Tokens.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "server/panel/Panel.h"
#include "server/tools/keys/Holders.h"
#include "server/tools/keys/KeyVerbs.h"

namespace tessera {

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
