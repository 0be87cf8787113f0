/// Keys of a wall for tests, made once: whom it lets in, and whom it does not.
#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <string>

#include "common/tls/Certificate.h"
#include "common/tls/TlsContext.h"

namespace tessera::test {

class WallOfKeys {
public:
    explicit WallOfKeys(std::string wall = "cave")
        : wall_(std::move(wall)), authority_(Authority::make(wall_, std::chrono::system_clock::now())) {}

    [[nodiscard]] const Authority& authority() const { return authority_; }
    [[nodiscard]] Identity server() const { return {.wall = wall_, .kind = Identity::Kind::kServer, .name = {}}; }
    [[nodiscard]] Identity host(const std::string& name) const {
        return {.wall = wall_, .kind = Identity::Kind::kHost, .name = name};
    }
    [[nodiscard]] Identity person(const std::string& name, Role role) const {
        return {.wall = wall_, .kind = Identity::Kind::kPerson, .name = name, .role = role};
    }
    [[nodiscard]] Authority::Issued issue(const Identity& holder, std::chrono::seconds agoIssued = {},
                                          std::chrono::seconds serves = Authority::kServes) const {
        auto issued = authority_.issue(holder, {}, std::chrono::system_clock::now() - agoIssued, serves);
        EXPECT_TRUE(issued) << issued.error().message;
        return std::move(*issued);
    }
    [[nodiscard]] TlsKeys keysWith(const std::string& own) const {
        TlsKeys keys;
        keys.own = own;
        keys.authority = authority_.certificatePem();
        return keys;
    }
    [[nodiscard]] TlsKeys keysOf(const Identity& holder) const { return keysWith(issue(holder).pem); }
    /// Of somebody with a link: the authority's fingerprint, and a key of their own or none.
    [[nodiscard]] TlsKeys pinned(const std::string& own = {}) const {
        TlsKeys keys;
        keys.own = own;
        keys.pinned = authority_.certificate().fingerprint;
        return keys;
    }

private:
    std::string wall_;
    Authority authority_;
};

inline std::shared_ptr<const TlsContext> contextOf(TlsKeys keys) {
    auto made = TlsContext::make(std::move(keys));
    EXPECT_TRUE(made) << made.error().message;
    return made ? *made : nullptr;
}

}  // namespace tessera::test
