/// What goes into a frame of the authority, and what comes out of it.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/math/NodeMove.h"
#include "common/request/EditRequests.h"
#include "server/collision/pipeline/StepResult.h"
#include "server/sim/commit/Committer.h"
#include "server/sim/commit/EditHistory.h"

namespace tessera {

/// A change that somebody wants.
struct Edit {
    std::uint64_t ticket = 0;  ///< comes back in the outcome
    ChangeList list;           ///< new objects carry placeholders; ignored for kUndo and kRedo
    enum class Kind : std::uint8_t {
        kChange,
        kUndo,  ///< take back the newest step instead
        kRedo,  ///< do again what was taken back last
        /// One of several lists that are one edit (LoadParts.h), all with one ticket. Placeholders count through all of
        /// them.
        kPart,
        kLastPart,
    };
    Kind kind = Kind::kChange;
    bool undoable = true;  ///< what the server itself does is not
    Gesture gesture = {};  ///< edits in a row of one gesture are taken back as one
    /// Of kChange, instead of a list: the way that a node is to go, worked out when the edit is made, from where the
    /// edits before it lead.
    std::optional<NodeMove> move = {};
    ObjectId node = {};         ///< that moves
    std::uint64_t objects = 0;  ///< of parts: how many objects all of them create, from kFirstPlaceholder up
    bool ofFile = false;        ///< of one that is not undoable: what a file says that is taken in again
};

/// It takes a step of the history back or does it again, whatever its list says.
[[nodiscard]] constexpr bool isStep(Edit::Kind kind) {
    return kind == Edit::Kind::kUndo || kind == Edit::Kind::kRedo;
}

/// What has become of an edit, as its application is told.
struct EditOutcome {
    std::uint64_t ticket = 0;
    Expected<answer::Committed> result = {};  ///< `ids`: of a last part the first pair, which the others follow
    bool underWay = false;                    ///< it takes several frames; its outcome follows
};

struct FrameResult {
    CommittedFrame commit;
    std::vector<EditOutcome> outcomes;  ///< of all edits, in their order; then of one that was under way
    std::vector<HistoryEvent> history;  ///< what happened to the history, in order
    std::vector<std::string> notes;     ///< of letters that are not as asked for (Typesetter)
    StepResult collision;
    double collisionMs = 0;
    /// What nobody needs any more: whoever frees it takes longer than a frame where arrays are large.
    std::vector<std::shared_ptr<const void>> unneeded;
    std::vector<std::string> remarks;  ///< for a person: animations that were paused, and why
};

}  // namespace tessera
