#include "server/door/Gatekeeper.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/json/Json.h"
#include "common/net/OwnAddress.h"
#include "common/net/Transport.h"

namespace tessera {
namespace {

/// Of what has no case: names of hosts and of schemes (RFC 9110, 4.2.3 and 11.1).
std::string inLowerCase(std::string_view text) {
    std::string low(text);
    for (char& c : low)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return low;
}

/// The names in a key are the authority's word: a token counts for nothing beside it.
tl::expected<Entrant, HttpAnswer> entrantByKey(const Credential& key, const std::string& from) {
    if (!key.fault.empty()) return tl::unexpected(errorAnswer(403, "refused", key.fault));
    if (key.identity.kind == Identity::Kind::kPerson)
        return Entrant{key.identity.role, Entrant::By::kKey, key.identity.name, from};
    return tl::unexpected(
        errorAnswer(403, "refused", fmt::format("the key is of {}, and lets in no person", describe(key.identity))));
}

}  // namespace

std::optional<HttpAnswer> Gatekeeper::strangers(const HttpRequest& request) const {
    if (!isHere(inLowerCase(request.host)))
        return errorAnswer(
            421, "refused",
            fmt::format("the door is asked by another name than this machine's own: its link has the right one{}",
                        reach_.keys ? ", and `tessera-keys renew server --names A,B` gives it others" : ""));
    const std::string_view kScheme = reach_.keys ? "https://" : "http://";
    const std::string origin = inLowerCase(request.origin);
    if (origin.empty() || (origin.starts_with(kScheme) && isHere(std::string_view(origin).substr(kScheme.size()))))
        return std::nullopt;
    return errorAnswer(403, "refused", "a page from elsewhere may not ask this door");
}

tl::expected<Entrant, HttpAnswer> Gatekeeper::entrantOf(const HttpRequest& request, const HttpTarget& target) const {
    if (std::optional<HttpAnswer> stranger = strangers(request)) return tl::unexpected(std::move(*stranger));
    if (request.key) return entrantByKey(*request.key, request.from);
    for (const std::string_view word : wordsIn(request, target))
        if (std::optional<Entrant> who = entrantBy(word)) {
            who->from = request.from;
            return *std::move(who);
        }
    HttpAnswer answer = errorAnswer(
        401, "refused",
        showsWord(request, target)
            ? "the token is not this server's, or has ended: `tessera-ctl link` prints a link with another one"
            : "a token is needed: the server prints its link with it, and keeps it in a file of its user's");
    answer.fields.emplace_back("WWW-Authenticate", "Bearer");
    return tl::unexpected(std::move(answer));
}

/// Those that are said: in Authorization, and for pages and sockets in the query.
std::vector<std::string_view> Gatekeeper::wordsIn(const HttpRequest& request, const HttpTarget& target) {
    constexpr std::string_view kBearer = "bearer ";
    std::vector<std::string_view> words;
    const std::string_view said = request.authorization;
    if (inLowerCase(said.substr(0, kBearer.size())) == kBearer) words.push_back(said.substr(kBearer.size()));
    const auto asked = target.query.find("token");
    if (asked != target.query.end() &&
        (target.path == "/" || target.path == "/api.html" || target.path == "/socket" || target.path == "/link"))
        words.push_back(asked->second);
    return words;
}

std::optional<Entrant> Gatekeeper::entrantBy(std::string_view word) const {
    if (const std::optional<Role> role = tokens_.roleOf(word)) return Entrant{*role, Entrant::By::kWord, owner_};
    if (std::optional<Entrant> visitor = visitorBy(word)) return visitor;
    const std::shared_ptr<const TlsContext> keys = reach_.keys ? reach_.keys() : nullptr;
    const std::optional<AccessPass> pass = keys ? keys->passOf(word, reach_.now()) : std::optional<AccessPass>();
    return pass ? std::optional(Entrant{pass->role, Entrant::By::kPass, pass->name, {}, pass->panel}) : std::nullopt;
}

/// By a word of a panel that the server itself serves.
std::optional<Entrant> Gatekeeper::visitorBy(std::string_view word) const {
    for (const DoorPanel& panel : panels_)
        if (sameToken(panel.word, word)) return Entrant{Role::kEditor, Entrant::By::kPass, "visitor", {}, panel.name};
    return std::nullopt;
}

std::string Gatekeeper::tokenIn(const HttpRequest& request, const HttpTarget& target) const {
    if (request.key) return {};
    for (const std::string_view token : wordsIn(request, target))
        if (knows(token)) return std::string(token);
    return {};
}

bool Gatekeeper::isHere(std::string_view authority) const {
    // Without a port it is the scheme's.
    const std::string whole = fmt::format("{}:{}", authority, reach_.keys ? 443 : 80);
    const Expected<Address> said = parseAddress(authority);
    const Expected<Address> address = said ? said : parseAddress(whole);
    return address && address->port == port_ && (address->isLoopback() || isOurs(address->host));
}

/// In lower case.
bool Gatekeeper::isOurs(const std::string& host) const {
    if (const std::shared_ptr<const TlsContext> keys = reach_.keys ? reach_.keys() : nullptr; keys && keys->own())
        for (const std::string& name : keys->own()->names)
            if (inLowerCase(name) == host || plainAddress(name) == plainAddress(host)) return true;
    return (reach_.keys || reach_.open) && isOwnAddress(host);
}

bool RateLimit::take(std::chrono::steady_clock::time_point now) {
    const double passed = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    left_ = std::min(atOnce_, left_ + passed * perSecond_);
    if (left_ < 1) return false;
    left_ -= 1;
    return true;
}

HttpAnswer errorAnswer(int status, std::string_view code, std::string_view message) {
    return {.status = status, .body = jsonText({{"error", {{"code", code}, {"message", message}}}}) + "\n"};
}

}  // namespace tessera
