/// What can be taken back, and what was taken back and can be done again.
#pragma once

#include <deque>
#include <vector>

#include "common/change/ChangeList.h"

namespace tessera {

/// Edits in a row of one gesture (a drag) are one step. `by` tells whose gestures these are.
struct Gesture {
    std::uint64_t by = 0, id = 0;  ///< id 0: none
    bool operator==(const Gesture&) const = default;
};

/// Inverses of the edits of people and applications. Bounded in steps and in the memory that their lists hold; of what is too
/// much the oldest goes, the newest step stays however large it is. Not thread-safe.
class EditHistory {
public:
    struct Limits {
        std::size_t steps = 256;
        std::uint64_t bytes = std::uint64_t{512} << 20;  ///< arrays that the lists name included; of both directions together
    };
    EditHistory() : EditHistory(Limits()) {}
    explicit EditHistory(const Limits& limits) : limits_(limits) {}

    /// A new edit, by the list that leads back from it. Nothing can be done again after it.
    void edited(ChangeList inverse, Gesture gesture = {});

    [[nodiscard]] std::size_t undoDepth() const { return back_.size(); }
    [[nodiscard]] std::size_t redoDepth() const { return forth_.size(); }
    /// The list that takes the newest step back, or does again what was taken back last; null: there is none. It stays until the
    /// call below says that it has been applied, with the list that leads back from it.
    [[nodiscard]] ChangeListPtr undoList();
    [[nodiscard]] ChangeListPtr redoList();
    void undone(ChangeList inverse);
    void redone(ChangeList inverse);

    /// Memory held, as it is counted.
    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

private:
    struct Held {
        ChangeListPtr list;
        std::uint64_t bytes = 0;
    };
    /// Lists in the order in which they were made: the last one is applied first.
    struct Step {
        std::vector<Held> lists;
        Gesture gesture;
    };
    [[nodiscard]] Held hold(ChangeList list);
    void letGo(const Step& step);
    /// False where the last two of its lists cannot be one.
    bool mergeLast(Step& step);
    [[nodiscard]] ChangeListPtr newest(std::deque<Step>& steps);
    void bound();

    Limits limits_;
    std::deque<Step> back_, forth_;  ///< the newest last
    std::uint64_t bytes_ = 0;
};

/// Bytes of memory that a list holds, those of the arrays that it names included.
[[nodiscard]] std::uint64_t memoryOf(const ChangeList& list);

}  // namespace tessera
