#include "server/sim/desk/LoadRequests.h"

#include <optional>
#include <utility>

#include <fmt/format.h>

#include "common/base/Utf8.h"
#include "server/sim/desk/Surroundings.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::size_t kMostNoteBytes = 500;
}  // namespace

ServerActions LoadRequests::ask(const Asker& asker, const std::string& path, ObjectId parent, const Placing& placing,
                                bool reload) {
    const auto refuse = [&](Error why) { return around_.answers().to(asker, tl::unexpected(std::move(why))); };
    if (const std::optional<Error> why = around_.whyNoEdit()) return refuse(*why);
    if (reload)
        if (std::optional<ServerActions> begun =
                reloads_.ask(asker, path, parent, placing.said() || placing.pointRadius || !placing.variants.empty()))
            return *std::move(begun);
    const ObjectId below = parent ? parent : kRootNode;
    if (!around_.simulation.scene().get<Node>(below))
        return refuse({ErrorCode::kNotFound, fmt::format("there is no node #{} to load below", below.value)});
    const std::uint64_t ticket = edits_.newTicket();
    if (!around_.loader.order({.ticket = ticket, .node = below, .path = path, .placing = placing}))
        return refuse({ErrorCode::kLimit, "too many files wait to be loaded already"});
    edits_.open(ticket, {.asker = asker,
                         .isLoad = true,
                         .loadedFrom = path,
                         .since = around_.time.now(),
                         .below = below,
                         .belowName = pathOf(around_.simulation.scene(), below)});
    return {};
}

void LoadRequests::loadContent(Preparation order) {
    const std::uint64_t ticket = order.ticket = edits_.newTicket();
    const ObjectId core = order.content->core;
    std::string path = order.path;
    if (!around_.loader.order(std::move(order))) {
        around_.inlines->ended(core, std::nullopt);  // it is ordered again
        return;
    }
    edits_.open(ticket, {.asker = {},
                         .edit = {.undoable = false},
                         .isLoad = true,
                         .loadedFrom = std::move(path),
                         .since = around_.time.now(),
                         .content = core});
}

answer::Loads LoadRequests::underWay(const Asker& asker, const std::function<std::string(ConnectionId)>& nameOf,
                                     TimePoint now) const {
    const std::size_t most = ApplicationLimits().maxPageNodes;
    answer::Loads told;
    const auto add = [&](std::uint64_t ticket, const OpenEdits::Open* open, LoadState state) {
        if (told.loads.size() == most) return;
        state.load = ticket;
        if (open != nullptr && open->asker.connection) state.person = nameOf(open->asker.connection);
        state.yours = open != nullptr && open->asker.connection == asker.connection;
        told.loads.push_back(std::move(state));
    };
    for (const OpenEdits::Appearing& one : edits_.appearing())
        add(one.ticket, one.open,
            {.path = one.open->loadedFrom,
             .stage = one.part     ? "appearing"
                      : one.isSent ? "waiting"
                                   : "sending",
             .part = one.part.value_or(-1),
             .seconds = toMilliseconds(now - one.open->since) / 1000});
    for (const Loader::UnderWay& one : around_.loader.underWay()) {
        const ImportWatch::Progress progress = one.watch->progress();
        add(one.ticket, edits_.find(one.ticket),
            {.path = one.path,
             .stage = std::string(wordFor(progress.stage)),
             .part = progress.part,
             .seconds = toMilliseconds(now - one.since) / 1000});
    }
    return told;
}

Expected<ServerActions> LoadRequests::cancel(std::uint64_t load, const std::string& by) {
    if (load == OpenEdits::kStartScene)
        return fail(ErrorCode::kRefused,
                    "load 0 is the scene that the server begins with, which is not cancelled (stop the server to end "
                    "it); `loads` tells which others are on their way");
    const Error why{ErrorCode::kFailed, by.empty() ? "cancelled" : "cancelled by " + by};
    if (around_.loader.cancel(load, why)) {
        // One that waits behind slow ones need not wait to be told so.
        const OpenEdits::Open* open = edits_.find(load);
        if (open == nullptr || open->content) return ServerActions();
        return edits_.refuse(load, {why.code, open->loadedFrom + ": " + why.message});
    }
    const OpenEdits::Open* const made = edits_.find(load);
    if (made == nullptr)
        return fail(ErrorCode::kNotFound, fmt::format("no load {} is on its way; `loads` tells which are", load));
    if (made->isLoad && edits_.hasNotBegun(load))
        return edits_.refuse(load, {why.code, made->loadedFrom + ": " + why.message});
    return fail(ErrorCode::kRefused, "it appears already; an undo takes it back");
}

ServerActions LoadRequests::loaded(Preparation made, TimePoint now) {
    if (std::optional<std::string> note = surroundingsNote(around_.simulation.scene(), made))
        made.notes.push_back(*std::move(note));
    if (around_.say) {
        for (const std::string& note : made.notes)
            around_.say(note.starts_with(made.path) ? note : made.path + ": " + note, false);
        if (made.refused && made.content) around_.say(fmt::format("{}: {}", made.path, made.refused->message), true);
    }
    OpenEdits::Open* const open = edits_.find(made.ticket);
    if (!open) return {};
    if (made.refused) return edits_.refuse(made.ticket, *made.refused);
    if (const std::optional<Error> why = edits_.whyNowhere(*open)) return edits_.refuse(made.ticket, *why);
    open->loaded = {.node = made.top, .objects = made.objects, .triangles = made.triangles};
    for (const std::string& note : made.notes) {
        if (open->loaded.notes.size() == answer::Loaded::kMostNotes) break;
        open->loaded.notes.emplace_back(cutUtf8(note, kMostNoteBytes));
    }
    open->edit.objects = made.objects;
    if (std::optional<FileInScene> file = FileInScene::of(made))
        open->given = [this, file = *std::move(file), held = made.held](ObjectId first) {
            held->standsFrom(first);
            reloads_.remember(file);
        };
    open->parts = std::move(made.lists);
    return edits_.queue(made.ticket, std::move(made.arrays), now);
}

}  // namespace tessera
