/// The files of a wall's keys, as `tessera-keys` writes them and `--keys DIR` of every program reads them.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/tls/TlsContext.h"

namespace tessera {

/// What was issued: a line of the file "issued".
struct IssuedKey {
    std::string serial;
    Identity holder;
    DateTime until;
    bool revoked = false;
};

/// In DIR: authority.pem (its key; where keys are made; authority.begun until the rest is there), authority.crt (its
/// certificate), server.pem, host-NAME.pem, person-NAME.pem (key and certificate of each), issued (what was made, what
/// has been revoked), tokens (hashes of words), panel-HASH (panels that tokens are of). All of mode 0600 in a folder of
/// mode 0700; others may read authority.crt. Files are replaced whole, and by one program at a time.
class KeyFolder {
public:
    explicit KeyFolder(std::string path);

    [[nodiscard]] const std::string& path() const { return path_; }
    [[nodiscard]] static std::string fileOf(const Identity& holder);  ///< "host-left.pem"

    /// kNotFound: there is none; kRefused: others may read it.
    [[nodiscard]] Expected<std::string> readOwn(const std::string& file) const;
    /// kNotFound, kRefused as `readOwn`; kBadInput: it is none.
    [[nodiscard]] Expected<Authority> authority() const;
    [[nodiscard]] Expected<std::string> authorityCertificate() const;
    /// In the order in which they were made. kNotFound: the file is not there, and nobody knows who was revoked.
    /// kBadInput: a line is none, or the last one is missing.
    [[nodiscard]] Expected<std::vector<IssuedKey>> issued() const;

    /// Words that let in somebody for a time; those that have ended, too. kBadInput: a line is none.
    [[nodiscard]] Expected<std::vector<KeptToken>> tokens() const;

    /// What a panel of this text is called here.
    [[nodiscard]] static std::string panelName(std::string_view text);

    /// Of the server of this wall, with the serials that have been revoked. A token whose panel is not there, or is
    /// another one, is left out.
    [[nodiscard]] Expected<TlsKeys> ofServer() const;
    /// For a server's keys that stay where the whole cannot be read: who is revoked by now is added, and tokens that
    /// are gone by now go. Nobody is let in by it who was not. Returns what is wrong with these two files, for people.
    [[nodiscard]] std::vector<std::string> takeRevoked(TlsKeys& keys) const;
    [[nodiscard]] Expected<TlsKeys> ofHost(const std::string& name) const;
    /// `name` empty: the only one there is. kUsage: there are several. kNotFound: there is none.
    [[nodiscard]] Expected<TlsKeys> ofPerson(const std::string& name) const;

    /// Keys as one text, for a pipe; and read from one, whose end is not waited for: what follows means nothing here.
    /// kBadInput: they are none. kNetwork: none came within `patience`.
    [[nodiscard]] static std::string bundleOf(const TlsKeys& keys);
    [[nodiscard]] static Expected<TlsKeys> readBundle(int descriptor, std::chrono::milliseconds patience);

    /// Nobody else writes until it goes. Makes the folder. kRefused: it is somebody else's, or others may look into it.
    class Writer {
    public:
        [[nodiscard]] static Expected<Writer> open(const KeyFolder& folder);
        ~Writer();
        Writer(Writer&& other) noexcept : path_(std::move(other.path_)), lock_(std::exchange(other.lock_, -1)) {}
        Writer& operator=(Writer&&) = delete;

        [[nodiscard]] Expected<void> write(const std::string& file, std::string_view text) const;
        [[nodiscard]] Expected<void> write(const std::vector<IssuedKey>& issued) const;
        /// What was written as `file` becomes `to`, whatever was there.
        [[nodiscard]] Expected<void> rename(const std::string& file, const std::string& to) const;
        /// Panels that none of them is of go.
        [[nodiscard]] Expected<void> writeTokens(const std::vector<KeptToken>& tokens) const;
        /// Before a token of it. Returns its name.
        [[nodiscard]] Expected<std::string> writePanel(std::string_view text) const;

    private:
        Writer(std::string path, int lock) : path_(std::move(path)), lock_(lock) {}
        std::string path_;
        int lock_ = -1;
    };

private:
    [[nodiscard]] Expected<std::string> read(const std::string& file, unsigned nobodyElse,
                                             std::string_view might) const;
    [[nodiscard]] Expected<TlsKeys> of(const std::string& file, const std::string& lacking) const;

    std::string path_;
};

}  // namespace tessera
