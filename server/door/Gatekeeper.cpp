#include "server/door/Gatekeeper.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/json/Json.h"
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

}  // namespace

std::optional<HttpAnswer> Gatekeeper::strangers(const HttpRequest& request) const {
    if (!isHere(inLowerCase(request.host)))
        return errorAnswer(421, "refused",
                           "the door is asked by another name than this machine's own: its link has the right one");
    constexpr std::string_view kScheme = "http://";
    const std::string origin = inLowerCase(request.origin);
    if (origin.empty() || (origin.starts_with(kScheme) && isHere(std::string_view(origin).substr(kScheme.size()))))
        return std::nullopt;
    return errorAnswer(403, "refused", "a page from elsewhere may not ask this door");
}

tl::expected<Role, HttpAnswer> Gatekeeper::roleOf(const HttpRequest& request, const HttpTarget& target) const {
    if (std::optional<HttpAnswer> stranger = strangers(request)) return tl::unexpected(std::move(*stranger));
    constexpr std::string_view kBearer = "bearer ";
    if (inLowerCase(std::string_view(request.authorization).substr(0, kBearer.size())) == kBearer)
        if (const auto role = tokens_.roleOf(std::string_view(request.authorization).substr(kBearer.size())))
            return *role;
    const auto said = target.query.find("token");
    if (said != target.query.end() && (target.path == "/" || target.path == "/socket" || target.path == "/link"))
        if (const auto role = tokens_.roleOf(said->second)) return *role;
    HttpAnswer answer = errorAnswer(
        401, "refused", "a token is needed: the server prints its link with it, and keeps it in a file of its user's");
    answer.fields.emplace_back("WWW-Authenticate", "Bearer");
    return tl::unexpected(std::move(answer));
}

bool Gatekeeper::isHere(std::string_view authority) const {
    const Expected<Address> address = parseAddress(authority);
    // Without a port it is 80's.
    if (!address) return port_ == 80 && (authority == "localhost" || authority == "127.0.0.1" || authority == "[::1]");
    return address->port == port_ && address->isLoopback();
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
