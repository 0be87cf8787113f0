/// Certificates of a wall, and the authority that makes them.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/Error.h"
#include "common/base/Identity.h"

struct evp_pkey_st;
struct x509_st;

namespace tessera {

using DateTime = std::chrono::system_clock::time_point;

/// "2026-11-26 20:16 UTC"
[[nodiscard]] std::string toText(DateTime time);

/// SHA-256, hexadecimal.
[[nodiscard]] std::string hashOfToken(std::string_view word);

/// What stands in one.
struct Certificate {
    std::optional<Identity> holder;  ///< none: an authority's, or somebody else's than Tessera's
    std::string serial;              ///< hexadecimal
    std::string fingerprint;         ///< SHA-256 of the whole, hexadecimal
    DateTime from, until;
    std::vector<std::string> names = {};  ///< host names and addresses by which browsers know a server

    /// kBadInput: the first certificate in this PEM cannot be read, or there is none.
    [[nodiscard]] static Expected<Certificate> read(std::string_view pem);
    [[nodiscard]] static Certificate of(const x509_st& certificate);
};

/// A wall's own authority: who holds its key can let in anybody. Immutable.
class Authority {
public:
    static constexpr std::chrono::days kLives{3650};  ///< an authority
    static constexpr std::chrono::days kServes{397};  ///< a certificate: no browser wants one for longer
    static constexpr std::chrono::hours kBefore{1};   ///< for clocks that are a little behind

    /// ECDSA over P-256 (browsers know no Ed25519), for this wall alone.
    [[nodiscard]] static Authority make(const std::string& wall, DateTime now);
    /// From what `pem` wrote. kBadInput: it is something else.
    [[nodiscard]] static Expected<Authority> read(std::string_view pem);
    ~Authority();
    Authority(Authority&&) noexcept;
    Authority& operator=(Authority&&) noexcept;

    /// The wall that all its certificates are for.
    [[nodiscard]] const std::string& wall() const { return wall_; }
    [[nodiscard]] const Certificate& certificate() const { return told_; }
    /// Key and certificate: nobody else's to read.
    [[nodiscard]] std::string pem() const;
    [[nodiscard]] std::string certificatePem() const;

    struct Issued {
        Certificate certificate;
        std::string pem;  ///< a fresh key, and the certificate: nobody else's to read
    };
    /// `names`: host names and addresses that browsers may know a server by. kBadInput: one of them is neither, or the
    /// holder is of another wall. kRefused: the authority has ended.
    [[nodiscard]] Expected<Issued> issue(const Identity& holder, const std::vector<std::string>& names, DateTime now,
                                         std::chrono::seconds serves = kServes) const;

private:
    struct Parts;
    explicit Authority(std::unique_ptr<Parts> parts);

    std::unique_ptr<Parts> parts_;
    std::string wall_;
    Certificate told_;
};

}  // namespace tessera
