#include "common/access/ServerTokens.h"

#include <utility>

namespace tessera {

Expected<ServerTokens> ServerTokens::make(ServerTokensOptions options,
                                          const std::function<void(const std::string&)>& warn) {
    ServerTokens made(std::move(options));
    const ServerTokensOptions& wanted = made.options_;
    LocalWallWish wish{.wall = wanted.wall, .listen = wanted.listen, .group = wanted.group};
    if (!wanted.tokenFile.empty()) {
        Expected<std::string> token = readToken(wanted.tokenFile);
        if (!token) return tl::unexpected(token.error());
        wish.given = std::move(*token);
    }
    made.marksFolder_ = wanted.keysFolder.empty() ? runFolder().value_or("") : wanted.keysFolder;
    const Expected<WallProtection> protection = made.protectionNow();
    if (!protection) return tl::unexpected(protection.error());
    made.protection_ = *protection;
    wish.protection = protection->text();
    if (!wish.given.empty())
        if (const Expected<void> used = made.chosen_.use(wish.given, made.server_, *protection); !used)
            return failWith("--token-file " + wanted.tokenFile, used.error());
    if (const Expected<void> ended = made.chosen_.endOthers(made.server_, *protection); !ended)
        warn(ended.error().message);
    Expected<std::unique_ptr<LocalWallPlace>> place = LocalWallPlace::take(wish);
    if (!place && (wish.given.empty() || !wish.group.empty()))
        return fail(place.error().code,
                    place.error().message +
                        "; the token that lets this user's programs in has no place (--token-file FILE names one)");
    if (place)
        made.place_ = std::move(*place);
    else
        warn(place.error().message +
             (made.marksFolder_.empty() ? "; tessera-keys revoke --links does not reach this server" : ""));
    made.tokens_ = made.place_ ? made.place_->tokens() : AccessTokens::fresh();
    if (!wish.given.empty()) made.tokens_.of(Role::kOperator) = wish.given;
    made.tokens_.door = freshToken();
    return made;
}

/// Returns how the wall is protected now. A mark that is gone is none that somebody has renewed, so links hold.
Expected<WallProtection> ServerTokens::protectionNow() const {
    WallProtection now{.authority = options_.authority ? options_.authority() : "",
                       .insecure = options_.insecure,
                       .mark = protection_.mark};
    if (marksFolder_.empty()) return now;
    const Expected<std::optional<std::string>> mark = readLinksMark(marksFolder_);
    if (!mark) return tl::unexpected(mark.error());
    if (*mark) now.mark = **mark;
    return now;
}

Expected<bool> ServerTokens::look() {
    const Expected<WallProtection> now = protectionNow();
    if (!now) return tl::unexpected(now.error());
    if (now->text() == protection_.text()) return endChosen();
    protection_ = *now;
    mustEndChosen_ = true;
    Expected<void> written;
    if (place_) {
        place_->setAuthority(protection_.authority);
        written = place_->renewFor(protection_.text());
    }
    // The door's own token is nobody's: its connections go on.
    const std::string ofDoor = std::exchange(tokens_, place_ ? place_->tokens() : AccessTokens::fresh()).door;
    tokens_.door = ofDoor;
    if (!written) return tl::unexpected(written.error());
    return true;
}

/// Keeps the end of a token that a person chose, on the look after it ended: a file that is locked delays no end.
Expected<bool> ServerTokens::endChosen() {
    if (!mustEndChosen_) return false;
    if (const Expected<void> ended = chosen_.endOthers(server_, protection_); !ended)
        return tl::unexpected(ended.error());
    mustEndChosen_ = false;
    return false;
}

Expected<void> ServerTokens::tell(const Address& server, const std::optional<Address>& console) {
    if (!place_) return {};
    place_->setAuthority(protection_.authority);
    return place_->tell(server, console);
}

}  // namespace tessera
