/// Blobs that a coming list will name: who has to fetch them, and who has.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "common/session/Messages.h"
#include "common/session/Patience.h"

namespace tessera {

/// An announcement stays until a list has named its blobs or somebody forgets it, for hosts that join in between. A
/// host that was told of one owes it until it says that it holds the blobs. The hosts that were live then are waited
/// for: once none of these is left, the blobs are everywhere, which is said once.
///
/// Invariants: who is waited for owes it; what is everywhere is waited for by nobody; of more announcements than
/// `most` the oldest that is everywhere is forgotten. Pure; one owner.
class BlobAnnouncements {
public:
    using Token = std::uint64_t;

    BlobAnnouncements(std::size_t most, Duration deadline) : most_(most), deadline_(deadline) {}

    /// `told`: all hosts that are there; `awaited`: of these the live ones. Returns what is everywhere now.
    [[nodiscard]] std::vector<Token> announce(Token token, std::vector<BlobInfo> blobs,
                                              const std::vector<std::string>& told, std::set<std::string> awaited,
                                              TimePoint now);
    /// What this host has to be told of that it does not owe yet; from now on it does. It is not waited for.
    [[nodiscard]] std::vector<message::BlobNotice> owedNow(const std::string& host);
    [[nodiscard]] bool owes(const std::string& host) const;
    /// It holds the blobs.
    void held(const std::string& host, Token token);
    /// It is not in the barrier any more.
    void notAwaited(const std::string& host);
    /// It comes anew, and owes nothing.
    void comesAnew(const std::string& host);

    /// Those that are everywhere since this was asked last.
    [[nodiscard]] std::vector<Token> everywhere();
    void forget(Token token);
    /// A list has named these.
    void named(const std::vector<BlobInfo>& blobs);

    /// The caller stood still.
    void excuse(Duration time);
    /// Hosts that are waited for and have not fetched in time.
    [[nodiscard]] std::set<std::string> late(TimePoint now) const;
    [[nodiscard]] TimePoint nextDeadline() const;

private:
    struct Announcement {
        Token token = 0;
        std::vector<BlobInfo> blobs;
        std::set<std::string> awaited;
        Patience fetching;
        bool everywhere = false;
    };
    std::size_t most_;
    Duration deadline_;
    std::deque<Announcement> announcements_;
    std::map<std::string, std::set<Token>> owed_;  ///< by host
};

}  // namespace tessera
