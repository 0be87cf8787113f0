/// Requests that look at the scene. For Deeds.cpp alone.
#pragma once

#include <algorithm>

#include <fmt/format.h>

#include "common/base/HashText.h"
#include "common/cores/Movie.h"
#include "server/sim/desk/DeedTable.h"
#include "server/sim/desk/SceneAnswers.h"
#include "server/sim/frame/Simulation.h"

namespace tessera::scene_deeds {

/// What is answered between two frames: some tens of microseconds. The rest is found beside them.
inline constexpr DescribeLimits kDescribedAtOnce{.maxLooks = 4096, .maxBytes = std::size_t{32} << 10};
inline constexpr std::size_t kObjectAtOnce = std::size_t{32} << 10;
inline constexpr PageLimits kFoundAtOnce{.maxLookedAt = 1024, .maxSiblings = 2048, .maxWork = 20'000};

/// Of the newest scene, or as it is later.
template <typename Answer>
Expected<ApplicationAnswer> asOf(Sequence sequence, Expected<Answer> found) {
    if (!found) return tl::unexpected(found.error());
    found->sequence = sequence;
    return ApplicationAnswer(std::move(*found));
}

inline ServerActions getObjects(Desk& desk, const Asker& asker, const request::GetObjects& wish, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    const bool aside = desk.around.lookBeside != nullptr;
    Expected<answer::Objects> objects =
        describe(simulation.scene(), wish.wish, aside ? kDescribedAtOnce : DescribeLimits());
    if (objects || !aside) return desk.answer(asker, asOf(simulation.sequence(), std::move(objects)));
    std::size_t bytes = 0;
    for (const std::string& name : wish.wish.names) bytes += sizeof(std::string) + name.size();
    return desk.answerBeside(asker, bytes, [wanted = wish.wish](const Aspect& scene, Sequence at) {
        return asOf(at, describe(scene, wanted));
    });
}

inline ServerActions getTree(Desk& desk, const Asker& asker, const request::GetTree& wish, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    const Aspect& scene = simulation.scene();
    // Lengths of films are known here alone; and Movies are small.
    const bool aside = desk.around.lookBeside && wish.wish.coreType != typeOf<Movie>();
    PageLimits limits;
    if (aside) limits.maxObjectBytes = kObjectAtOnce;
    Expected<answer::TreePage> page = treePage(scene, wish.wish, limits);
    if (!page && page.error().code == ErrorCode::kLimit && aside)
        return desk.answerBeside(
            asker, sizeof(ObjectId) * (wish.wish.after.size() + wish.wish.cores.size()),
            [wanted = wish.wish](const Aspect& now, Sequence at) { return asOf(at, treePage(now, wanted)); });
    if (!page) return desk.refuse(asker, page.error());
    if (wish.wish.coreType == typeOf<Movie>() && desk.around.filmLength)
        for (const TreeNode& told : page->nodes) {
            const ObjectId core = scene.get<Node>(told.node)->core;
            if (const double seconds = desk.around.filmLength(core); seconds > 0)
                page->lengths.push_back({core, seconds});
        }
    page->sequence = simulation.sequence();
    return desk.answer(asker, ApplicationAnswer(std::move(*page)));
}

inline ServerActions find(Desk& desk, const Asker& asker, const request::FindNodes& wish, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    const bool aside = desk.around.lookBeside != nullptr;
    Expected<answer::FoundPage> page = foundPage(simulation.scene(), wish.wish, aside ? kFoundAtOnce : PageLimits());
    const bool whole = page && page->next.empty() && std::ranges::none_of(page->nodes, [](const ObjectInfo& node) {
                           return node.path.starts_with('#');
                       });
    if (whole || !page || !aside) return desk.answer(asker, asOf(simulation.sequence(), std::move(page)));
    return desk.answerBeside(
        asker, wish.wish.expression.size() + sizeof(ObjectId) * wish.wish.after.size(),
        [wanted = wish.wish](const Aspect& scene, Sequence at) { return asOf(at, foundPage(scene, wanted)); });
}

/// A piece is small enough to be copied between two frames.
inline ServerActions getArray(Desk& desk, const Asker& asker, const request::GetArray& wish, TimePoint) {
    const std::optional<BlobId> id = hashOfText(wish.blob);
    if (!id) return desk.refuse(asker, {ErrorCode::kBadInput, "blob: an array's name is 32 hexadecimal digits"});
    const Blob array = desk.around.blobs.find(*id);
    if (!array.resident())
        return desk.refuse(asker, {ErrorCode::kNotFound, "blob: nothing holds an array of that name any more"});
    if (wish.offset > array.sizeBytes())
        return desk.refuse(asker,
                           {ErrorCode::kBadInput, fmt::format("offset: the array has {} bytes", array.sizeBytes())});
    const std::uint64_t most = wish.length == 0 ? ApplicationLimits().maxPieceBytes : wish.length;
    Bytes piece(static_cast<std::size_t>(std::min(most, array.sizeBytes() - wish.offset)));
    array.read(wish.offset, piece);
    return desk.answer(asker, ApplicationAnswer(answer::ArrayPiece{array.sizeBytes(), ByteSlice(std::move(piece))}));
}

inline constexpr DeedTable kRows{&getObjects, &getTree, &find, &getArray};

}  // namespace tessera::scene_deeds
