/// Meshes, images and voxels under one limit of GL's memory.
#pragma once

#include <cstddef>

#include "client/draw/store/MeshBuffers.h"
#include "client/draw/store/TextureCache.h"
#include "client/draw/store/UseClock.h"
#include "client/draw/store/VolumeTextures.h"

namespace tessera {

/// Before each draw it lets go of what all stores together have too much of, the last needed first (UseClock.h): what
/// nobody draws any more goes before what somebody draws, whatever it is. Belongs to the renderer's thread.
class SharedBudget {
public:
    /// Of meshes, and of images or voxels alone; 0: what the others leave.
    struct Own {
        std::size_t meshes = 0, textures = 0;
    };
    SharedBudget(UseClock& clock, MeshBuffers& meshes, TextureCache& textures, VolumeTextures& volumes, const Own& own)
        : clock_(clock), meshes_(meshes), textures_(textures), volumes_(volumes), own_(own) {}

    struct Limit {
        std::size_t bytes = 0;   ///< of all
        std::size_t others = 0;  ///< that do not give way, of those: what pictures are drawn in
        std::size_t there = 0;   ///< with what all have taken: GlMemory::there
        bool hard = false;       ///< GlMemory::hard
    };
    /// The stores have a quarter of the limit at least, whatever the others take.
    void set(const Limit& limit);
    /// Call before the first `find` of a draw, in any store.
    void beginDraw();
    /// The same of depths alone, and nothing gives way: programs may be made ahead with images of the last picture, and
    /// the next picture sees to the rest.
    void beginDepths();

    /// When nothing is drawn any more: what the last picture did not need goes now, where all take too much.
    void rest();

private:
    /// What all take beyond their limits goes: what nobody draws, or, `all`, what is not needed now.
    void shedToLimits(bool all);
    /// Of all stores.
    [[nodiscard]] std::size_t room() const;
    /// Of each store what the others have left.
    void divide();

    UseClock& clock_;
    MeshBuffers& meshes_;
    TextureCache& textures_;
    VolumeTextures& volumes_;
    Own own_;
    Limit limit_;
};

}  // namespace tessera
