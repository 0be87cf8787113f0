/// One side of TLS 1.3: what it proves itself with, and whom it believes.
#pragma once

#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/AccessToken.h"
#include "common/tls/Certificate.h"

struct ssl_ctx_st;

namespace tessera {

/// A word that lets in somebody without a certificate, as it is kept: nobody can read it there.
struct KeptToken {
    std::string hash;  ///< SHA-256 of the word, hexadecimal
    AccessPass pass;
    DateTime until;
};

/// When the newest key of a holder ends.
struct KeyEnd {
    Identity holder;
    DateTime until;
};

/// Within that time people are told.
inline constexpr std::chrono::days kEndsSoon{30};
/// "the key of the host 'left' of the wall 'cave' ends on 2026-12-24 20:16 UTC, in 12 days: …"
[[nodiscard]] std::string toText(const KeyEnd& end, DateTime now);

/// What a side has, as read from files.
struct TlsKeys {
    std::string own = {};        ///< PEM of its key and certificate; empty: it dials with a token instead
    std::string authority = {};  ///< PEM of the wall's authority's certificate; empty: the pinned one
    std::string pinned = {};     ///< SHA-256 of the authority's certificate, hexadecimal: for links that carry it
    std::set<std::string> revoked = {};              ///< serials that let nobody in any more
    std::vector<KeptToken> tokens = {};              ///< of a server
    std::map<std::string, std::string> panels = {};  ///< that tokens are of: texts by their names
    std::vector<std::string> faults = {};            ///< of tokens that let nobody in for that: for people
    std::vector<KeyEnd> ends = {};                   ///< of those that were issued and not revoked
    std::string ownFile = {}, authorityFile = {};    ///< where the first two were read: for people; empty: in no file
};

/// Immutable but for the tickets of sessions that may be resumed; any thread. For links that are accepted and for
/// those that are dialled.
///
/// Who dials believes a server whose certificate this wall's authority made, whatever its address. Who accepts lets
/// anybody finish the handshake and says afterwards what is wrong with them (`Credential::fault`): a program that is
/// refused is told so in words, not with the number of an alert. Tickets end with their context: whoever comes after a
/// change of keys is looked at whole.
class TlsContext {
public:
    /// kBadInput: a key, certificate or fingerprint is none, or they do not belong together.
    [[nodiscard]] static Expected<std::shared_ptr<const TlsContext>> make(TlsKeys keys);
    ~TlsContext();
    TlsContext(const TlsContext&) = delete;
    TlsContext& operator=(const TlsContext&) = delete;

    /// None: it has no key of its own, and so accepts nobody.
    [[nodiscard]] const std::optional<Certificate>& own() const { return own_; }
    [[nodiscard]] bool mayAccept() const { return own_ && own_->holder->kind == Identity::Kind::kServer; }
    /// Of the wall's authority, hexadecimal.
    [[nodiscard]] const std::string& authorityFingerprint() const { return authority_; }
    /// Its certificate, PEM; empty: it is known by its fingerprint alone.
    [[nodiscard]] const std::string& authorityCertificate() const { return authorityPem_; }
    /// Why a certificate lets nobody in now; empty: it does. Chains have been looked at in the handshake.
    /// `otherClock`: what the other side's says; zero: it did not tell.
    [[nodiscard]] std::string faultOf(const Certificate& certificate, DateTime now, DateTime otherClock) const;

    /// Whom this word lets in now. Takes as long whatever it is.
    [[nodiscard]] std::optional<AccessPass> passOf(std::string_view word, DateTime now) const;
    /// The text of a panel that tokens are of (AccessPass::panel); null: there is none.
    [[nodiscard]] std::shared_ptr<const std::string> panelOf(const std::string& name) const;
    /// The first to end comes first; its own is among them.
    [[nodiscard]] const std::vector<KeyEnd>& ends() const { return ends_; }

    [[nodiscard]] std::vector<KeyEnd> endsSoon(DateTime now) const;
    [[nodiscard]] const std::vector<std::string>& faults() const { return faults_; }  ///< TlsKeys::faults

    /// For TlsChannel.
    [[nodiscard]] ssl_ctx_st* native() const;

private:
    friend class TlsChannel;
    friend struct TlsCallbacks;
    struct Impl;
    TlsContext();

    std::unique_ptr<Impl> impl_;
    std::optional<Certificate> own_;
    std::string authority_;
    std::set<std::string> revoked_;
    std::vector<KeptToken> tokens_;
    std::map<std::string, std::shared_ptr<const std::string>> panels_;
    std::vector<KeyEnd> ends_;
    std::vector<std::string> faults_;
    std::string authorityPem_;
};

}  // namespace tessera
