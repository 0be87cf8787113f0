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

inline ServerActions getObjects(Desk& desk, const Asker& asker, const request::GetObjects& wish, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    answer::Objects objects = describe(simulation.scene(), wish.wish);
    objects.sequence = simulation.sequence();
    return desk.answer(asker, ApplicationAnswer(std::move(objects)));
}

inline ServerActions getTree(Desk& desk, const Asker& asker, const request::GetTree& wish, TimePoint) {
    const Simulation& simulation = desk.around.simulation;
    const Aspect& scene = simulation.scene();
    Expected<answer::TreePage> page = treePage(scene, wish.wish);
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
    Expected<answer::FoundPage> page = foundPage(simulation.scene(), wish.wish);
    if (!page) return desk.refuse(asker, page.error());
    page->sequence = simulation.sequence();
    return desk.answer(asker, ApplicationAnswer(std::move(*page)));
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
