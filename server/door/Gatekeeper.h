/// Who is let in: by a key or a token, from pages of this door alone.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/AccessToken.h"
#include "common/base/Entrant.h"
#include "common/base/Error.h"
#include "common/base/SourceAddress.h"
#include "common/tls/KeyRing.h"
#include "server/door/HttpMessage.h"

namespace tessera {

/// Who reaches a door. Without both: this machine alone.
struct DoorReach {
    CurrentKeys keys = {};  ///< the server's: what is said is sealed, and pages are https
    bool open = false;      ///< from other machines, with nothing sealed
    std::function<DateTime()> now = std::chrono::system_clock::now;  ///< by which tokens end
    std::chrono::milliseconds look{250};  ///< between two looks at whether keys and tokens are others
};

/// A panel that the server itself serves, and the token that lets in to it alone: until it is renewed, or the server
/// ends.
struct DoorPanel {
    std::string word, name, title;  ///< name: `Entrant::panel`
};

/// Of one door.
///
/// A page from elsewhere that a browser shows could call a door on its machine: the browser then says where the page is
/// from (Origin), or has taken a name for the door that its owner has pointed at loopback (Host). Both are looked at
/// before the token. Where other machines reach the door it may be called by this machine's addresses and by the names
/// in its certificate, too: nobody else can let a name of theirs stand for it.
class Gatekeeper {
public:
    /// `owner`: whose tokens they are.
    Gatekeeper(AccessTokens tokens, std::uint16_t port, DoorReach reach = {}, std::string owner = {},
               std::vector<DoorPanel> panels = {})
        : tokens_(std::move(tokens)),
          port_(port),
          reach_(std::move(reach)),
          owner_(std::move(owner)),
          panels_(std::move(panels)) {}

    /// Who it is, and as what it comes in: by its key, or without one by its token. Else what is wrong with it: 421 for
    /// a strange Host, 403 for a strange Origin, or a key that lets nobody in, 401 without a token. The token stands in
    /// Authorization ("Bearer T"), or for pages and sockets in the query.
    [[nodiscard]] tl::expected<Entrant, HttpAnswer> entrantOf(const HttpRequest& request,
                                                              const HttpTarget& target) const;
    /// Returns the token that lets a request in; empty: it comes in otherwise.
    [[nodiscard]] std::string tokenIn(const HttpRequest& request, const HttpTarget& target) const;
    /// Whether a token lets somebody in now.
    [[nodiscard]] bool knows(std::string_view token) const { return entrantBy(token).has_value(); }
    /// Lets in by these tokens from now on, and by no others.
    void renew(AccessTokens tokens, std::vector<DoorPanel> panels) {
        tokens_ = std::move(tokens);
        panels_ = std::move(panels);
    }
    /// Whether it comes by a word, be it a wrong one.
    [[nodiscard]] static bool showsWord(const HttpRequest& request, const HttpTarget& target) {
        return !request.key && !wordsIn(request, target).empty();
    }
    /// Without key and token: where the request comes from.
    [[nodiscard]] std::optional<HttpAnswer> strangers(const HttpRequest& request) const;

private:
    [[nodiscard]] static std::vector<std::string_view> wordsIn(const HttpRequest& request, const HttpTarget& target);
    [[nodiscard]] std::optional<Entrant> entrantBy(std::string_view word) const;
    [[nodiscard]] std::optional<Entrant> visitorBy(std::string_view word) const;
    [[nodiscard]] bool isHere(std::string_view authority) const;
    [[nodiscard]] bool isOurs(const std::string& host) const;

    AccessTokens tokens_;
    std::uint16_t port_;
    DoorReach reach_;
    std::string owner_;
    std::vector<DoorPanel> panels_;
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

/// The same for each. Of more than kMost, who has asked nothing for longest is forgotten.
template <typename Who>
class RatesOf {
public:
    static constexpr std::size_t kMost = 256;
    RatesOf(double perSecond, double atOnce) : perSecond_(perSecond), atOnce_(atOnce) {}
    [[nodiscard]] bool take(const Who& who, std::chrono::steady_clock::time_point now) {
        const auto known = std::ranges::find_if(rates_, [&](const auto& one) {
            if constexpr (requires { who.isSameAs(who); })
                return one.first.isSameAs(who);
            else
                return one.first == who;
        });
        if (known != rates_.end()) {
            rates_.splice(rates_.end(), rates_, known);
        } else {
            if (rates_.size() == kMost) rates_.pop_front();
            rates_.emplace_back(who, RateLimit(perSecond_, atOnce_));
        }
        return rates_.back().second.take(now);
    }

private:
    double perSecond_, atOnce_;
    std::list<std::pair<Who, RateLimit>> rates_;  ///< who has asked last stands last
};
using RatesOfPeople = RatesOf<Entrant>;           ///< wherever from
using RatesOfStrangers = RatesOf<SourceAddress>;  ///< without a token

/// `{"error":…}` as an answer: code and message for programs and people.
[[nodiscard]] HttpAnswer errorAnswer(int status, std::string_view code, std::string_view message);

}  // namespace tessera
