/// Who acts on the scene beside people: what a row of the table (Actors.cpp) says of one.
///
/// Three times in a frame somebody may speak, and each time the order is that of the rows: whoever speaks later has the
/// last word on a field.
/// - `say`, before the step, as edits that are nobody's step: what depends on views, clocks, files and processes.
///   Recordings have these edits, so nobody says them in a replay. People's edits come after them.
/// - `want`, first in the step: poses of Transforms, which collisions may stop, and values of other fields. Edits come
///   after it.
/// - `settle`, last in the step, when everything stands where it stands: what follows from that.
///
/// What happens in a step is a function of the scene and of the edits alone.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>
#include <vector>

#include "common/base/Clock.h"
#include "common/base/HistoryIds.h"
#include "common/wall/View.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/commit/EditHistory.h"
#include "server/sim/frame/Wishes.h"

namespace tessera {

/// A frame to come, for who says something before its step.
struct Occasion {
    const Aspect& scene;
    const View& view;  ///< of the frame before
    FrameNumber frame;
    bool first = false;         ///< nothing has moved yet
    bool stepUnderWay = false;  ///< a step is being taken back or done again over several frames
    TimePoint now;              ///< of the steady clock
};

/// By which whoever acts changes the scene within a step. What it applies is nobody's step.
class ServersHand {
public:
    ServersHand(Committer& committer, std::function<void(const ChangeList*)> applied)
        : committer_(committer), applied_(std::move(applied)) {}

    [[nodiscard]] const Aspect& scene() const { return committer_.scene(); }
    /// Refused, it leaves no trace.
    Expected<void> apply(ChangeList list);
    /// What must not fail; an empty list is nothing.
    void commit(ChangeList list);

    /// For who applies a list by itself, and what all who follow the scene are told then.
    [[nodiscard]] Committer& committer() { return committer_; }
    void applied(const ChangeList* list) const { applied_(list); }

private:
    Committer& committer_;
    std::function<void(const ChangeList*)> applied_;
};

/// A step under way.
struct ActorStage {
    ServersHand& hand;
    double seconds = 0;  ///< by which time goes on
    Wishes& wishes;
    std::vector<std::string>& remarks;  ///< for a person

    [[nodiscard]] const Aspect& scene() const { return hand.scene(); }
};

/// What has become of the wishes of a frame.
struct WishOutcome {
    std::unordered_set<ObjectId> granted;  ///< motions, animations: what they wanted of a Transform is so
    std::unordered_set<ObjectId> stopped;  ///< of those: something that they wanted is not
};

/// All functions may be empty, and are called on the frame thread. What they look at outlives the table.
struct Actor {
    std::string_view name;

    // What it follows: after each list applied to the scene, with that list; null: anything may have changed.
    enum class Each : bool { kList, kFrame };
    Each each = Each::kList;  ///< kFrame: it is told of a frame's lists as the one that the frame hands out
    std::function<void(const Aspect& scene, const ChangeList* list)> follow = {};

    // What it says.
    std::uint64_t ticket = 0;        ///< of the edits that carry it; nobody waits for them
    bool followsWhatIsSeen = false;  ///< they name nodes that are in the scene, some of which may still be on their way
    std::function<std::vector<ChangeList>(const Occasion& occasion)> say = {};
    std::function<void(ActorStage& stage)> want = {};
    std::function<void(ActorStage& stage, const StepResult& collisions)> settle = {};
    /// Something of the view, which is no part of the scene.
    std::function<void(View& view)> look = {};

    // What it hears of the outcome: adds what of its own goes on with what it wanted (a clock) to the list that moves
    // things.
    std::function<void(const Aspect& scene, const WishOutcome& outcome, ChangeListBuilder& list)> hear = {};

    // What it makes of others' lists.
    /// Of the scene's files, an edit or a part of a load, before it is applied: may add to it, or refuse it in words.
    /// `own`: what the load makes of which it is a part.
    struct Incoming {
        enum class From { kFiles, kPeople, kServer } from = From::kFiles;
        IdRange own = {};
    };
    std::function<Expected<void>(const Aspect& scene, ChangeList& list, const Incoming& incoming)> receive = {};
    /// Right before a list is applied: makes way for it, and says what is to follow once it has been. Nothing: nothing
    /// does.
    enum class ListOf {
        kEdit,
        kStep,
        kPartOfStep
    };  ///< what a file says that is taken in again makes way as a step does
    using Afterwards = std::function<void(ServersHand& hand)>;
    std::function<Afterwards(ServersHand& hand, const ChangeList& list, ListOf of)> before = {};
    /// Who plays and drives what a list writes: is paused by it, `playing` becoming false.
    struct Driver {
        ObjectId object;
        ObjectType type;
        FieldId playing;
    };
    std::function<void(const ChangeList& list, std::vector<Driver>& drivers)> drivers = {};

    // For people.
    std::function<std::vector<std::string>()> remarks = {};  ///< since the last call
    /// Before the first frame: what has still to come so that it is like the last one. Asked again and again.
    struct Awaited {
        std::size_t count = 0;
        std::string_view missing = {};  ///< what to say after the count where nobody waits any longer; empty: nothing
    };
    std::function<Awaited(const Aspect& scene, TimePoint now)> awaited = {};
};

}  // namespace tessera
