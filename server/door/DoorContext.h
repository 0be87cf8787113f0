/// What all that come through a door share. The door's thread alone.
#pragma once

#include <boost/asio/io_context.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "common/base/Clock.h"
#include "common/base/Descriptors.h"
#include "common/base/FailedLogins.h"
#include "common/net/Crowd.h"
#include "server/door/AnswerLanes.h"
#include "server/door/Beside.h"
#include "server/door/Door.h"
#include "server/door/DoorHandshakes.h"
#include "server/door/DoorLink.h"
#include "server/door/Gatekeeper.h"
#include "server/door/SceneCopies.h"
#include "server/door/UploadFolder.h"
#include "server/door/WallPictures.h"

namespace tessera {

struct DoorLimits {
    std::size_t maxConnections = withinDescriptors(256, 4);  ///< at once, all kinds together
    /// Each is an application at the server, which takes 64 of them. Each has two descriptors more, of its link.
    std::size_t maxSockets = withinDescriptors(48, 8);
    std::size_t maxHttpLinks = 8;  ///< of people whose requests come over HTTP: applications, too
    std::size_t maxHeadBytes = std::size_t{16} << 10;
    std::size_t maxTextBytes = std::size_t{4} << 20;        ///< of a body, or a message in text
    std::size_t maxBinaryBytes = std::size_t{64} << 20;     ///< of a binary frame
    std::size_t maxBinariesBytes = std::size_t{256} << 20;  ///< of one request together
    /// Of a socket: what it has not taken, a piece for each request without an answer. Above it, it is not read.
    std::size_t maxHeldBytes = std::size_t{16} << 20;
    /// Of all sockets: above it only those are read for whom nothing is held, and one for whom much waits, and that has
    /// taken nothing for `stalledAfter`, is sent away.
    std::size_t maxHeldOfAllBytes = std::size_t{64} << 20;
    std::chrono::seconds stalledAfter{2};
    /// Binaries of all sockets, until their requests are answered: whoever brings more is sent away.
    std::size_t maxBroughtBytes = std::size_t{512} << 20;
    std::size_t maxUnsentBytes = std::size_t{32} << 20;  ///< of a socket: a reader that is slower is sent away
    double socketPerSecond = 2000, httpPerSecond = 200;  ///< of a socket; of a person, a stranger's address
    std::chrono::seconds headWait{10}, idle{60}, answerWait{130};
    std::size_t maxUploads = 8;          ///< files that come at once
    std::chrono::seconds pieceWait{20};  ///< 256 KiB of a file have to come, or to be taken, within it
    /// So long each may take to show its token before it gives way to others; these wait in the backlog meanwhile.
    std::chrono::milliseconds patience{100};
};

struct DoorContext;

/// A connection of the door. Its door sends it away before it goes itself.
class Guest {
public:
    explicit Guest(DoorContext& context);
    virtual ~Guest();
    Guest(const Guest&) = delete;
    Guest& operator=(const Guest&) = delete;
    /// Closes its connection at once: what it waits for ends with an error.
    virtual void leave() = 0;
    /// It has not shown a token yet, and others want in: it is told so, as far as that takes no time, and closed.
    virtual void giveWay() { leave(); }
    /// Bytes that wait for it while it takes none.
    [[nodiscard]] virtual std::size_t stalled(TimePoint) { return 0; }
    /// Whether it has said something that has not been read yet.
    [[nodiscard]] virtual bool waitsToBeRead() { return false; }
    /// Why its key lets nobody in any more; empty: it does, or it has shown none.
    [[nodiscard]] virtual std::string faultOfKey(const TlsContext&) const { return {}; }
    /// It is to go, and told why where it can be; nothing that it says counts from now on.
    virtual void sendAway(const std::string&) { leave(); }
    bool sentAway = false;            ///< its door has done so
    std::string token;                ///< that it came with last; empty: it came otherwise
    std::optional<Entrant> who = {};  ///< as whom it came last; none: it has shown nothing yet
    bool isSocket = false;            ///< else HTTP
    bool isUploading = false;
    SourceAddress source = {};
    std::optional<Crowd<Guest*>::Place> silent = {};  ///< it has not shown a token yet: where it stands among those
    bool gone = false;                                ///< it gives way, and has still to hear of it

private:
    DoorContext& context_;
};

struct DoorContext {
    DoorContext(DoorOptions o, std::uint16_t port)
        : options(std::move(o)), gate(options.tokens, port, options.reach, options.owner, options.panels) {}

    // What is left in `io` holds of these.
    std::size_t brought = 0;  ///< bytes, of all sockets: `DoorLimits::maxBroughtBytes`
    FailedLogins failedLogins;
    AnswerLanes lanes{io};
    boost::asio::io_context io{1};
    DoorOptions options;
    DoorLimits limits;
    Gatekeeper gate;
    RatesOfPeople httpRates{limits.httpPerSecond, 2 * limits.httpPerSecond};
    RatesOfStrangers strangersRates{limits.httpPerSecond, 2 * limits.httpPerSecond};
    std::function<void()> onRoom;  ///< a guest has gone
    std::set<Guest*> guests;
    std::size_t gone = 0;  ///< of the guests
    Crowd<Guest*> silent{limits.patience};
    DoorHandshakes handshakes{io};
    std::size_t sockets = 0;  ///< of the guests
    std::size_t held = 0;     ///< bytes, of all sockets: `DoorLimits::maxHeldBytes`

    /// The link by which somebody's requests over HTTP go, wherever from; dialled when it is first needed, and again
    /// when it has ended. Of many people that asks nothing now which has asked nothing for longest goes. Null: all do.
    [[nodiscard]] DoorLink* sharedLink(const Entrant& who) {
        Entrant anywhere = who;  // requests say themselves from where they come
        anywhere.from.clear();
        const auto known = std::ranges::find(shared_, anywhere, &Shared::who);
        if (known != shared_.end()) {
            shared_.splice(shared_.end(), shared_, known);
        } else if (shared_.size() < limits.maxHttpLinks) {
            shared_.push_back({std::move(anywhere), nullptr});
        } else {
            const auto idle = std::ranges::find_if(shared_, [](const Shared& one) { return one.link->open() == 0; });
            if (idle == shared_.end()) return nullptr;
            idle->link->close();
            shared_.erase(idle);
            shared_.push_back({std::move(anywhere), nullptr});
        }
        std::shared_ptr<DoorLink>& link = shared_.back().link;
        if (!link || link->ended()) link = dial("console", shared_.back().who, false);
        return link.get();
    }
    [[nodiscard]] std::shared_ptr<DoorLink> dial(const std::string& name, const Entrant& who, bool follow) {
        return DoorLink::dial({.address = options.server,
                               .name = name,
                               .access = [word = options.tokens.ofDoorFor(who)](const std::string&) { return word; },
                               .lists = follow},
                              wire);
    }

    DoorWire wire{io};
    WallPictures pictures{io};
    Beside beside{io};  ///< large answers
    SceneCopies copies{io};
    std::shared_ptr<Beside> disk = std::make_shared<Beside>(io);  ///< what files take

    [[nodiscard]] bool full() const { return guests.size() - gone >= limits.maxConnections; }
    /// It has still to show a token, or has been waited for by us: its time begins.
    void isSilent(Guest& guest) {
        const TimePoint now = std::chrono::steady_clock::now();
        if (guest.silent)
            silent.beginAgain(*guest.silent, now);
        else
            guest.silent = silent.add(guest.source, &guest, now);
    }
    void isKnown(Guest& guest) {
        if (guest.silent) silent.remove(*guest.silent);
        guest.silent.reset();
    }
    /// Whether one of this name may be among the connections, or sockets, beside those that are (`hasShare`).
    [[nodiscard]] bool hasPlaceFor(const Entrant& newcomer, const Guest& self, bool amongSockets) const {
        std::size_t own = 0, others = 0;
        for (const Guest* guest : guests) {
            if (guest == &self || guest->gone || (amongSockets && !guest->isSocket)) continue;
            if (!guest->who) continue;  // it gives way to whoever has shown something
            ++(guest->who->isSameAs(newcomer) ? own : others);
        }
        return hasShare(newcomer.by, own, others, amongSockets ? limits.maxSockets : limits.maxConnections);
    }

    /// Where too much is held, those go for whom most of it waits in vain.
    void relieve() {
        const TimePoint now = std::chrono::steady_clock::now();
        while (held > limits.maxHeldOfAllBytes) {
            const auto waits = [&](Guest* guest) { return guest->stalled(now); };
            const auto worst = std::ranges::max_element(guests, {}, waits);
            if (worst == guests.end() || (*worst)->stalled(now) == 0) return;
            (*worst)->leave();
        }
    }

    /// Sends away whom keys and tokens let in no more: both may have changed.
    void judgeAgain() {
        const std::shared_ptr<const TlsContext> keys = options.reach.keys ? options.reach.keys() : nullptr;
        const bool changed = keys != judgedBy_;
        judgedBy_ = keys;
        for (Guest* guest : std::set(guests)) {
            if (!guests.contains(guest)) continue;
            if (guest->sentAway) {
                guest->leave();  // it has had its time to hear why
                continue;
            }
            std::string fault = changed && keys ? guest->faultOfKey(*keys) : std::string();
            if (fault.empty() && !guest->token.empty() && !gate.knows(guest->token))
                fault = "its token has ended, or was revoked";
            if (fault.empty()) continue;
            guest->sentAway = true;
            guest->sendAway(fault);
        }
    }

    /// Nobody holds a handle of a guest from here on.
    void sendAllAway() {
        lanes.close();
        for (const Shared& one : shared_) one.link->close();
        shared_.clear();
        pictures.forget();
        for (Guest* guest : std::set(guests)) guest->leave();
    }

private:
    struct Shared {
        Entrant who;
        std::shared_ptr<DoorLink> link;
    };
    std::list<Shared> shared_;  ///< those that were asked last are last
    std::shared_ptr<const TlsContext> judgedBy_;
};

inline Guest::Guest(DoorContext& context) : context_(context) {
    context_.guests.insert(this);
}
inline Guest::~Guest() {
    context_.guests.erase(this);
    context_.isKnown(*this);
    if (gone) --context_.gone;
    if (context_.onRoom) context_.onRoom();
}

}  // namespace tessera
