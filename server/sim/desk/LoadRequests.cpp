#include "server/sim/desk/LoadRequests.h"

#include <utility>

#include <fmt/format.h>

#include "common/base/Utf8.h"
#include "server/sim/frame/Simulation.h"

namespace tessera {

namespace {
constexpr std::size_t kMostNoteBytes = 500;
}  // namespace

ServerActions LoadRequests::ask(const Asker& asker, const std::string& path, ObjectId parent, const Placing& placing) {
    const auto refuse = [&](Error why) { return answerTo(around_.session, asker, tl::unexpected(std::move(why))); };
    if (const std::optional<Error> why = around_.whyNoEdit()) return refuse(*why);
    const ObjectId below = parent ? parent : kRootNode;
    if (!around_.simulation.scene().get<Node>(below))
        return refuse({ErrorCode::kNotFound, fmt::format("there is no node #{} to load below", below.value)});
    const std::uint64_t ticket = edits_.newTicket();
    if (!around_.loader.order({.ticket = ticket, .path = path, .parent = below, .placing = placing}))
        return refuse({ErrorCode::kLimit, "too many files wait to be loaded already"});
    edits_.open(ticket, {.asker = asker, .isLoad = true});
    return {};
}

void LoadRequests::loadContent(InlineOrder order) {
    const std::uint64_t ticket = edits_.newTicket();
    const ObjectId core = order.core;
    LoadOrder wanted{.ticket = ticket, .path = order.file, .parent = order.node, .content = std::move(order)};
    if (!around_.loader.order(std::move(wanted))) {
        around_.inlines->ended(core, std::nullopt);  // it is ordered again
        return;
    }
    edits_.open(ticket, {.asker = {}, .edit = {.undoable = false}, .isLoad = true, .content = core});
}

ServerActions LoadRequests::loaded(LoadFinished finished, TimePoint now) {
    OpenEdits::Open* const open = edits_.find(finished.ticket);
    if (!open) return {};
    if (!finished.scene) return edits_.refuse(finished.ticket, finished.scene.error());
    const ImportedScene& scene = *finished.scene;
    open->loaded = {.node = scene.top, .objects = scene.nodes + scene.cores, .triangles = scene.triangles};
    for (const std::string& note : scene.notes) {
        if (open->loaded.notes.size() == answer::Loaded::kMostNotes) break;
        open->loaded.notes.emplace_back(cutUtf8(note, kMostNoteBytes));
    }
    open->edit.objects = finished.parts.objects;
    open->parts = std::move(finished.parts.lists);
    return edits_.queue(finished.ticket, std::move(finished.arrays), now);
}

}  // namespace tessera
