/// From a draw list to what GL is told: numbers for uniform blocks, and draw calls in the list's order. No GL calls but
/// those of the caches.
#pragma once

#include <map>
#include <vector>

#include "client/draw/MeshBuffers.h"
#include "client/draw/Program.h"
#include "client/draw/Renderer.h"
#include "client/draw/TextureCache.h"

namespace tessera {

/// One draw call. Its ItemBlock has the same index.
struct DrawCall {
    MeshRange mesh;
    GLuint texture = 0;
    bool doubleSided = false;
    bool mirrored = false;
    const DrawItem* item = nullptr;  ///< of the list that is drawn
};

/// Kept from draw to draw for its memory.
class DrawCalls {
public:
    /// Everything is relative to the eye, composed in double, then rounded: the same numbers on every tile of a screen.
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera, MeshBuffers& meshes,
                 TextureCache& textures);

    [[nodiscard]] const std::vector<DrawCall>& calls() const { return calls_; }
    /// Calls from here on are transparent.
    [[nodiscard]] std::size_t opaqueCount() const { return opaqueCount_; }
    [[nodiscard]] const std::vector<ItemBlock>& items() const { return items_; }
    [[nodiscard]] const std::vector<MaterialTexels>& materials() const { return materials_; }
    [[nodiscard]] const DrawCounts& counts() const { return counts_; }

private:
    struct TexelsLess {
        bool operator()(const MaterialTexels& a, const MaterialTexels& b) const;
    };
    void collect(const Aspect& aspect, const std::vector<DrawItem>& items, const ScreenCamera& camera,
                 MeshBuffers& meshes, TextureCache& textures);
    std::uint32_t materialIndex(const Material& material);

    std::vector<DrawCall> calls_;
    std::vector<ItemBlock> items_;
    std::size_t opaqueCount_ = 0;
    std::vector<MaterialTexels> materials_;
    std::map<MaterialTexels, std::uint32_t, TexelsLess> materialIndices_;
    DrawCounts counts_;
};

[[nodiscard]] FrameBlock makeFrameBlock(const DrawList& list, const ScreenCamera& camera);

}  // namespace tessera
