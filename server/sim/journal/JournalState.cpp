#include "server/sim/journal/JournalState.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "common/scene/FieldTable.h"

namespace tessera {

Expected<void> JournalState::take(JournalRecord record) {
    return std::visit(
        [&](auto&& what) -> Expected<void> {
            if constexpr (std::is_same_v<std::decay_t<decltype(what)>, journal::Array>)
                return {};  // the reader keeps them
            else
                return take(std::move(what));
        },
        std::move(record));
}

Expected<void> JournalState::take(journal::Opening opening) {
    if (opening.schema != schemaHash())
        return fail(
            ErrorCode::kUnsupported,
            fmt::format("{} wrote it with other scene types than this program has; go on with that version, save "
                        "the scene there (tessera-ctl save) and begin another journal with it",
                        opening.program));
    // (A snapshot's says where its own state leads.)
    if (opening.sequence != sequence || opening.stateHash != scene.stateHash())
        return fail(
            ErrorCode::kBadInput,
            fmt::format("it goes on from list {} and state {}; what is before it ends at list {} and state {}",
                        opening.sequence.value, toHex(opening.stateHash), sequence.value, toHex(scene.stateHash())));
    // Connections are counted anew by every server, and gestures are named by them.
    if (opening.epoch != epoch) history.endGestures();
    epoch = std::max(epoch, opening.epoch);
    scenes = std::move(opening.scenes);
    number = opening.number;
    program = std::move(opening.program);
    schema = opening.schema;
    format = opening.format;
    before = opening.before;
    return {};
}

Expected<void> JournalState::take(journal::Frame frame) {
    if (frame.list) {
        if (frame.sequence != sequence.next())
            return fail(ErrorCode::kBadInput,
                        fmt::format("it is of list {}, behind list {}", frame.sequence.value, sequence.value));
        if (const Expected<void> applied = scene.apply(*frame.list); !applied)
            return failWith(fmt::format("list {}", frame.sequence.value), applied.error());
        sequence = frame.sequence;
    }
    if (frame.sequence != sequence || frame.stateHash != scene.stateHash())
        return fail(ErrorCode::kBadInput,
                    fmt::format("the state after list {} is {}, not {} as it says", frame.sequence.value,
                                toHex(scene.stateHash()), toHex(frame.stateHash)));
    for (const HistoryEvent& event : frame.history)
        if (!history.take(event)) return fail(ErrorCode::kBadInput, "it undoes, redoes or finishes what is not there");
    history.sweep();
    if (frame.display) display = std::move(*frame.display);
    if (!frame.start) nextFrame = std::max(nextFrame, frame.frame.next());
    begun = true;
    return {};
}

Expected<void> JournalState::take(const journal::Frames& frames) {
    nextFrame = frames.next;
    return {};
}

Expected<void> JournalState::take(const journal::Numbers& taken) {
    if (taken.behind < sequence)
        return fail(ErrorCode::kBadInput,
                    fmt::format("lists go on behind {}, and list {} has been", taken.behind.value, sequence.value));
    sequence = taken.behind;
    numbers = taken;
    return {};
}

Expected<void> JournalState::take(journal::View taken) {
    view = std::move(taken.state);
    return {};
}

Expected<void> JournalState::take(const journal::Raised& raised) {
    epoch = std::max(epoch, raised.epoch);
    return {};
}

Expected<void> JournalState::take(journal::Step step) {
    if (!history.keep(std::move(step.kept)))
        return fail(ErrorCode::kBadInput, "it does not fit behind those before it");
    return {};
}

Expected<void> JournalState::take(journal::State state) {
    if (begun || sequence) return fail(ErrorCode::kBadInput, "a state stands only in a snapshot, and once");
    if (const Expected<void> applied = scene.apply(*state.list); !applied) return failWith("scene", applied.error());
    if (scene.stateHash() != state.stateHash)
        return fail(ErrorCode::kBadInput, fmt::format("its state is {}, not {} as it says", toHex(scene.stateHash()),
                                                      toHex(state.stateHash)));
    begun = state.begun;
    sequence = state.sequence;
    nextFrame = state.nextFrame;
    display = std::move(state.display);
    return {};
}

std::vector<std::string> JournalState::sceneFiles() const {
    std::vector<std::string> files = scenes;
    if (!placing().empty()) files.pop_back();
    return files;
}

std::string JournalState::placing() const {
    return !scenes.empty() && scenes.back().starts_with("--") ? scenes.back() : std::string();
}

void JournalState::forEachRecord(const std::function<bool(JournalRecord)>& write) && {
    std::vector<EditHistory::Kept> steps = std::exchange(history, EditHistory()).kept();
    for (EditHistory::Kept& step : steps)
        if (!write(journal::Step{.kept = std::exchange(step, {})})) return;
    if (view && !write(journal::View{*view})) return;
    if (numbers && !write(journal::Numbers{.nextId = numbers->nextId, .lastList = numbers->lastList, .behind = {}}))
        return;
    journal::State state{.begun = begun,
                         .nextFrame = nextFrame,
                         .sequence = sequence,
                         .stateHash = scene.stateHash(),
                         .list = std::make_shared<const ChangeList>(snapshot(scene)),
                         .display = std::move(display)};
    scene = Aspect();
    (void)write(std::move(state));
}

}  // namespace tessera
