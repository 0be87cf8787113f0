#include "client/replica/PictureWarnings.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "client/render/scene/LineWidths.h"

namespace tessera {

void PictureWarnings::tell(FrameNumber frame, const Aspect& aspect, const std::vector<const PaintedTile*>& tiles,
                           const std::set<ObjectId>& undrawn, const std::vector<HeldUpBy>& heldUp) {
    frame_ = frame;
    std::uint64_t skipped = 0, lights = 0, scopes = 0;
    NarrowedLines narrowed;
    std::string trouble;
    for (const PaintedTile* tile : tiles) {
        skipped += tile->skipped;
        lights = std::max(lights, tile->lightsLeftOut);
        scopes = std::max(scopes, tile->scopesLeftOut);
        if (!tile->trouble.empty()) trouble = tile->trouble;
        if (tile->narrowed.items > 0) narrowed = tile->narrowed;
    }
    if (std::exchange(skipped_, skipped) != skipped && skipped > 0)
        warn(fmt::format("{} items cannot be drawn (their meshes are damaged or absent, or GL has no memory for them)",
                         skipped));
    tellUndrawn(aspect, undrawn);
    if (std::exchange(lights_, lights) != lights && lights > 0)
        warn(fmt::format("{} lights beyond the first {} are left out", lights, DrawList::kMaxLights));
    if (std::exchange(scopes_, scopes) != scopes && scopes > 0)
        warn(fmt::format("{} lights are left out, as their scopes are beyond the first {} that lights name", scopes,
                         DrawList::kMaxScopes));
    tellNarrowed(aspect, narrowed);
    if (std::exchange(trouble_, trouble) != trouble && !trouble.empty()) warn(trouble);
    tellHeldUp(heldUp);
}

void PictureWarnings::warn(const std::string& text) {
    log_.warning(fmt::format("frame {}: {}", frame_.value, text), {.frame = frame_.value});
}

void PictureWarnings::tellUndrawn(const Aspect& aspect, const std::set<ObjectId>& undrawn) {
    if (undrawn == undrawn_) return;
    undrawn_ = undrawn;
    if (undrawn.empty()) return;
    const std::string others =
        undrawn.size() > 1 ? fmt::format(" (and {} things more)", undrawn.size() - 1) : std::string();
    warn(whyNotDrawn(aspect, *undrawn.begin()) + others);
}

void PictureWarnings::tellNarrowed(const Aspect& aspect, const NarrowedLines& narrowed) {
    if (std::exchange(narrowed_, narrowed.items > 0) || narrowed.items == 0) return;
    const std::string others =
        narrowed.items > 1 ? fmt::format(" (and those of {} things more)", narrowed.items - 1) : std::string();
    warn(
        fmt::format("the lines of {}{} are drawn {:.1f} pixels wide in place of {:g}: all lines of the screen would "
                    "cover {:.0f} million pixels, of which it has {:.0f}",
                    pathOf(aspect, narrowed.node), others, narrowed.drawnPx, narrowed.wantedPx,
                    narrowed.wantedPixels / 1e6, kMostLinePixels / 1e6));
}

void PictureWarnings::tellHeldUp(const std::vector<HeldUpBy>& heldUp) {
    for (const HeldUpBy& held : heldUp)
        if (heldUp_.insert(held.program).second)
            warn(fmt::format("SurfaceProgram #{} holds this host up ({:.0f} ms): drawn without it", held.program.value,
                             toMilliseconds(held.took)));
    if (heldUp.empty()) heldUp_.clear();
}

}  // namespace tessera
