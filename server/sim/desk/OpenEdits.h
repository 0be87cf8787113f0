/// Edits, from their asking to their outcome.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/sim/desk/DeskSurroundings.h"
#include "server/sim/frame/Frame.h"

namespace tessera {

struct ReloadPlan;

/// What a list takes of a frame: its changes, and the references in them.
[[nodiscard]] std::size_t weightOf(const ChangeList& list);

/// The book of all edits that are open: proposals, steps of undo, loads, copies. Each has a ticket until its outcome is
/// known and told to its asker, once. One that names blobs goes into a frame when every live host has them. One of many
/// parts goes into as many frames, part by part, those of the first one first. Frame thread only.
class OpenEdits {
public:
    /// A start scene is loaded without a question; its ticket is `kStartScene`, which no other edit has.
    static constexpr std::uint64_t kStartScene = 0;

    struct Open {
        Asker asker;
        Edit edit = {};             ///< waiting for blobs or a frame; its ticket is the book's to set
        std::uint64_t removed = 0;  ///< objects that it takes away, for its answer
        std::uint64_t created = 0;  ///< objects that it makes, for its answer
        ObjectId copy = {};         ///< the placeholder whose id its answer tells; none: those of all placeholders
        Proposal proposal = {};     ///< whose arrays are being put together
        std::size_t bytes = 0;      ///< of the proposal, or that a copy holds once it is made
        bool isCopy = false;        ///< one that is made beside the frames
        std::uint64_t upload = 0;   ///< whose room it takes (Uploads::handedOver); 0: none
        bool isLoad = false;
        std::string loadedFrom = {};         ///< of a load: its file, as it was asked for
        TimePoint since = {};                ///< of a load: when it was
        ObjectId below = {};                 ///< of a load: the node that it goes below; none: whoever looks after it
        std::string belowName = {};          ///< and its path when the load was asked for
        ObjectId content = {};               ///< of what an Inline holds: its core; nobody asked
        answer::Loaded loaded = {};          ///< of a load: its answer; `node` is a placeholder until the commit
        std::vector<ChangeList> parts = {};  ///< of a load, or a large copy, that takes several frames
        std::size_t nextPart = 0;
        ObjectId firstMade = {};                  ///< of a reload in parts: the id of the first object that it makes
        std::vector<Blob> announced = {};         ///< can be fetched until its outcome is known
        bool isEverywhere = false;                ///< all hosts have those
        std::shared_ptr<ReloadPlan> reload = {};  ///< of a file that is taken in again: its lists, instead of `parts`
        /// Of what a file has brought: ids are given to it in a row from this one on.
        std::function<void(ObjectId first)> given = {};
        /// What is done when its outcome is known, instead of an answer; the error says why it was refused.
        std::function<ServerActions(const std::optional<Error>& refused)> ended = {};
    };

    OpenEdits(const DeskSurroundings& around, const DeskLimits& limits) : around_(around), limits_(limits) {}
    OpenEdits(const OpenEdits&) = delete;
    OpenEdits& operator=(const OpenEdits&) = delete;

    [[nodiscard]] std::uint64_t newTicket() { return nextTicket_++; }
    void open(std::uint64_t ticket, Open open);
    /// Null: its outcome is known, or nobody wants it any more.
    [[nodiscard]] Open* find(std::uint64_t ticket);
    /// It goes into a frame when every live host has what it names. While no edit is taken it is refused.
    [[nodiscard]] ServerActions queue(std::uint64_t ticket, std::vector<Blob> named, TimePoint now);
    /// All of that at once.
    [[nodiscard]] ServerActions enter(Open open, std::vector<Blob> named, TimePoint now);
    [[nodiscard]] ServerActions refuse(std::uint64_t ticket, const Error& why);
    void blobsEverywhere(std::uint64_t ticket);
    /// Hosts still fetch what it names: nothing of it is in a frame.
    [[nodiscard]] bool waitsForHosts(std::uint64_t ticket) const;
    /// No part of it is in a frame: it can be refused.
    [[nodiscard]] bool hasNotBegun(std::uint64_t ticket) const;
    /// Why a load cannot go where it was to go, if that is so.
    [[nodiscard]] std::optional<Error> whyNowhere(const Open& open) const;
    /// This deed of the audit log is open.
    [[nodiscard]] bool has(ConnectionId connection, std::uint64_t deed) const;

    struct Count {
        std::size_t edits = 0, bytes = 0;
    };
    /// Of one application.
    [[nodiscard]] Count countOf(ConnectionId connection) const;
    /// Loads whose parts appear, or wait for hosts or for others' parts.
    struct Appearing {
        std::uint64_t ticket = 0;
        const Open* open = nullptr;
        bool isSent = false;         ///< no host still fetches what it names
        std::optional<double> part;  ///< of the parts, 0 to 1; none: nothing of it is in a frame
    };
    [[nodiscard]] std::vector<Appearing> appearing() const;
    /// Of copies that were made beside the frames.
    [[nodiscard]] std::size_t copiedBytes() const;

    /// Edits on their way are carried out: they were asked for. Their answers go nowhere. Where those who come and go
    /// leave too many behind, because no frame takes them, the newest do not count. `isPresent`: who is there.
    void forgetLeftBehind(const std::function<bool(ConnectionId)>& isPresent);

    /// The whole edits for the frame that is about to be made.
    [[nodiscard]] std::vector<Edit> takeEdits();
    /// And a part beside them: one in a frame, and none beside a step, which may take several frames itself.
    void takePart(std::vector<Edit>& edits);
    /// Parts that nobody wants: freed some at a time.
    void drop(std::vector<ChangeList> parts);
    /// What has become of the edits of a frame.
    [[nodiscard]] ServerActions committed(std::vector<EditOutcome> outcomes);

private:
    using Opens = std::map<std::uint64_t, Open>;  ///< by ticket

    /// To whoever asked, or to who orders what Inlines hold.
    [[nodiscard]] ServerActions tell(const Open& open, const Expected<ApplicationAnswer>& outcome);
    /// The part of a reload for the frame that is about to be made.
    [[nodiscard]] Edit nextPartOf(Open& open) const;
    /// The audit log is told what it writes, before that is done.
    void note(const Open& open, const Edit& edit) const;
    /// Its outcome is known, or nobody wants it. What comes behind it.
    Opens::iterator close(Opens::iterator open);

    const DeskSurroundings& around_;
    const DeskLimits& limits_;
    std::uint64_t nextTicket_ = kStartScene + 1;
    Opens open_;
    std::vector<std::uint64_t> ready_;   ///< tickets whose edits go into the next frame
    std::deque<std::uint64_t> loading_;  ///< tickets whose parts do, one at a time, those of the first one first
    std::vector<ChangeList> dropped_;    ///< parts that were refused
};

}  // namespace tessera
