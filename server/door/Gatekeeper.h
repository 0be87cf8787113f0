/// Who is let in: by a token, from pages of this door alone.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "common/base/AccessToken.h"
#include "common/base/Error.h"
#include "server/door/HttpMessage.h"

namespace tessera {

/// Of one door on loopback.
///
/// A page from elsewhere that a browser shows could call a door on its machine: the browser then says where the page is
/// from (Origin), or has taken a name for the door that its owner has pointed at loopback (Host). Both are looked at
/// before the token.
class Gatekeeper {
public:
    Gatekeeper(AccessTokens tokens, std::uint16_t port) : tokens_(std::move(tokens)), port_(port) {}

    /// As what it comes in. Else what is wrong with it: 421 for a strange Host, 403 for a strange Origin, 401 without a
    /// token. The token stands in Authorization ("Bearer T"), or for the page and the socket in the query.
    [[nodiscard]] tl::expected<Role, HttpAnswer> roleOf(const HttpRequest& request, const HttpTarget& target) const;
    /// Without a token: where the request comes from.
    [[nodiscard]] std::optional<HttpAnswer> strangers(const HttpRequest& request) const;

private:
    [[nodiscard]] bool isHere(std::string_view authority) const;

    AccessTokens tokens_;
    std::uint16_t port_;
};

/// So many at once, and so many in a second.
class RateLimit {
public:
    RateLimit(double perSecond, double atOnce) : perSecond_(perSecond), atOnce_(atOnce), left_(atOnce) {}
    [[nodiscard]] bool take(std::chrono::steady_clock::time_point now);

private:
    double perSecond_, atOnce_, left_;
    std::chrono::steady_clock::time_point last_{};
};

/// `{"error":…}` as an answer: code and message for programs and people.
[[nodiscard]] HttpAnswer errorAnswer(int status, std::string_view code, std::string_view message);

}  // namespace tessera
