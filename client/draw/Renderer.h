/// Draws draw lists with OpenGL 4.5, in the coordinates of the whole wall, so that seams are exact.
#pragma once

#include <memory>
#include <vector>

#include "client/draw/Surface.h"
#include "client/image/Picture.h"
#include "client/render/DrawList.h"
#include "common/scene/Aspect.h"
#include "common/wall/View.h"

namespace tessera {

struct RendererOptions {
    int samples = 4;  ///< per pixel: 1 or 4
};

/// GL resources of one surface; lives on the surface's thread.
class Renderer {
public:
    [[nodiscard]] static Expected<std::unique_ptr<Renderer>> create(Surface& surface, RendererOptions options);
    ~Renderer();

    /// Draws the part `rect` of the screen's picture. The aspect gives geometry, materials and images by id; meshes and
    /// textures are cached by content. Returns when the image is complete in memory.
    [[nodiscard]] Expected<Picture> draw(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                         const PixelRect& rect);
    /// Node ids of what is visible at each pixel (one sample at the centre; 0: nothing), rows from the top. The proof of
    /// cullers; slow.
    [[nodiscard]] Expected<std::vector<std::uint64_t>> drawNodeIds(const Aspect& aspect, const DrawList& list,
                                                                   const ScreenCamera& camera, const PixelRect& rect);
    /// Hash of a small lit test image: hosts with different ones cannot share a wall seam-exactly.
    [[nodiscard]] Expected<std::uint64_t> pixelProbe();

private:
    Renderer();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
