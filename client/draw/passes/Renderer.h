/// Draws draw lists with OpenGL 4.5, in the coordinates of the whole wall, so that seams are exact.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/draw/shaders/PersonText.h"
#include "client/draw/surface/Surface.h"
#include "client/render/DrawList.h"
#include "client/render/cull/VisibilityDevice.h"
#include "client/render/scene/SceneContents.h"
#include "common/base/Clock.h"
#include "common/base/TimeSource.h"
#include "common/image/Picture.h"
#include "common/scene/Aspect.h"
#include "common/wall/LightHistogram.h"
#include "common/wall/View.h"

namespace tessera {

struct MeshSize;

struct RendererOptions {
    int samples = 4;                          ///< per pixel: 1 or 4
    const TimeSource* time = &machineTime();  ///< for what is reported
    /// Of GL's memory, as it is allocated, for meshes, images and voxels together with what pictures are drawn in:
    /// framebuffers and maps of shadows, which stay while they are used. 0: memoryForGl. Above it gives way what is not
    /// drawn, then what is needed again last (SharedBudget.h). What one draw needs is there as long as GL has memory,
    /// and a quarter of this is for meshes, images and voxels whatever pictures take.
    std::size_t memoryBytes = 0;
    /// Of one buffer of meshes; 0, and at most: as much as the surface draws from. What does not fit into it beside
    /// what else a draw needs is left out, and counted in DrawCounts::skipped.
    std::size_t mostBufferBytes = 0;
    /// Of meshes, and of images or voxels alone; 0: what the others leave of `memoryBytes`.
    std::size_t meshBudgetBytes = 0, textureBudgetBytes = 0;
    /// Samples of an image, at most, where it is seen at a grazing angle: 1 to 16. A step of detail may want fewer. 0:
    /// 16 on a GPU; 1 on Mesa's software, where more take ten times as long.
    int anisotropy = 0;
    /// Of the maps of shadows: above it those go that nobody needs now.
    std::size_t shadowBudgetBytes = std::size_t{1} << 29;
    /// False: every pixel looks at every light. The same picture, to the bit, and slow: what clusters are tested
    /// against.
    bool clusterLights = true;
    /// False: every pixel goes through every pass, and rays through volumes sample what is empty too. The same picture,
    /// to the bit, and slow: what `ScreenBlocks` and `VolumeBricks` are tested against.
    bool leaveOutEmpty = true;
    /// A picture is drawn anew without the dearest of persons' programs with loops once those have taken so long in its
    /// frame (LoopWatch.h). Never with 0.
    std::chrono::milliseconds programsMost{500};
    /// Called between any two things that are drawn or uploaded, and programs that are made: drawing gets on. May be
    /// empty.
    std::function<void()> onStep = {};
};

/// What became of the last list drawn.
struct DrawCounts {
    std::uint64_t items = 0;
    std::uint64_t skipped = 0;      ///< geometry gone, arrays absent, refused by checkMesh, no memory of GL
    std::uint64_t triangles = 0;    ///< given to GL, in each cell
    std::uint64_t glCalls = 0;      ///< that draw items, in each cell and pass; one may draw many
    std::uint64_t states = 0;       ///< program, material or sides were others than those before, in each cell and pass
    std::uint64_t memoryBytes = 0;  ///< of GL, as RendererOptions::memoryBytes counts it
    std::uint64_t memoryBudget = 0;  ///< that it may take
    // Since the renderer was made:
    std::uint64_t bufferCopies = 0;    ///< whole buffers of meshes, to larger or smaller ones
    std::uint64_t lightsPrepared = 0;  ///< for GL, of a list for a camera
    std::uint64_t looksUploaded = 0;   ///< given to GL anew, its shadows' included
    std::uint64_t untextured = 0;      ///< drawn without their image, which is absent or not of its size
    std::uint64_t lightsLeftOut = 0;   ///< beyond DrawList::kMaxLights
    std::uint64_t shadowsLeftOut = 0;  ///< lights that ask for shadows and get none (DrawList::shadowsLeftOut)
    std::uint64_t scopesLeftOut = 0;   ///< lights that shine on nothing (DrawList::scopesLeftOut)
    std::string
        trouble;  ///< why the surroundings' image is not used, or a person's program; empty: nothing of the kind
    std::uint64_t programs = 0;  ///< that there are
    std::uint64_t compiled = 0;  ///< since the renderer was made
    Duration readBack{};         ///< from GL's finished pictures to the one that `draw` returns
    std::uint64_t pixels = 0;    ///< in blocks that items may show in, in each cell: all others are surely background
};

/// GL resources of one surface; lives on the surface's thread.
class Renderer {
public:
    [[nodiscard]] static Expected<std::unique_ptr<Renderer>> create(Surface& surface, RendererOptions options);
    ~Renderer();

    /// Says that another frame begins, of one draw or several: so that budgets know what belongs together (UseClock.h).
    /// Where nobody says so each draw is a frame.
    void beginFrame();
    /// Brings to GL, ahead of need, what this drawable needs of mesh, voxels and images of its material: about
    /// `bytes` of mesh or voxels, or one image. Pictures do not depend on it, and nothing is thrown out for it.
    struct Prepared {
        std::size_t bytes = 0;  ///< uploaded; 0: all of it is there, or cannot be
        bool full = false;      ///< a budget has no room for the rest
    };
    [[nodiscard]] Expected<Prepared> prepare(const Aspect& aspect, const SceneContent& content, std::size_t bytes);
    /// Makes room in one step for meshes that take so much (DrawForms.h), as far as the budget goes.
    [[nodiscard]] Expected<void> expectMeshes(const MeshSize& more);
    /// Draws the part `rect` of the screen's picture, cell by cell (ScreenCells.h). The aspect gives geometry,
    /// materials and images by id; meshes and textures are cached by content. Returns when the image is complete in
    /// memory. What cannot be drawn is left away and counted. kBadInput: the rectangle does not lie on the screen;
    /// kFailed: GL gave up.
    [[nodiscard]] Expected<Picture> draw(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                         const PixelRect& rect);
    /// The same for somebody who may want it no longer: once `unwanted` is true the rest is left, and there is no
    /// picture. Asked between any two things that are drawn, passes over the screen and programs to be made; one of
    /// these is not broken off. It belongs to somebody else's frame: what persons' programs take counts by itself.
    [[nodiscard]] Expected<std::optional<Picture>> drawWhileWanted(const Aspect& aspect, const DrawList& list,
                                                                   const ScreenCamera& camera, const PixelRect& rect,
                                                                   const std::function<bool()>& unwanted);
    /// The same, straight to where it will be looked at: no copy in between.
    [[nodiscard]] Expected<void> drawInto(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                          const PixelRect& rect, const PixelRows& rows);
    /// Node ids of what is visible at each pixel (one sample at the centre; 0: nothing), rows from the top. The proof
    /// of cullers; slow. Transparent items hide what is behind them here: leave them out of the list to see that.
    [[nodiscard]] Expected<std::vector<std::uint64_t>> drawNodeIds(const Aspect& aspect, const DrawList& list,
                                                                   const ScreenCamera& camera, const PixelRect& rect);
    /// Makes one more thing that pictures may need if lights or surroundings become others than those of what was drawn
    /// last, a program mostly; call it when nothing else is to do. It takes some milliseconds, where Mesa has it in no
    /// cache a tenth of a second. What is needed before it was made is made by `draw`. False: nothing is left.
    [[nodiscard]] bool prepare();
    /// Whether something is left of that.
    [[nodiscard]] bool mayPrepare() const;
    /// Whom cullers ask what is hidden, by the depths that pictures will have. Valid until the renderer goes.
    [[nodiscard]] VisibilityDevice& visibility();
    /// Hash of a small lit test image: hosts with different ones cannot share a wall seam-exactly.
    [[nodiscard]] Expected<std::uint64_t> pixelProbe();
    /// Of the last `draw` or `drawNodeIds`.
    [[nodiscard]] DrawCounts lastCounts() const;
    /// Of the last picture, where its list's environment is metered: how bright what is solid in it is, but for what
    /// lies in `elsewhere`, rectangles of the screen. Else nothing is counted.
    [[nodiscard]] LightHistogram lastLight(std::span<const PixelRect> elsewhere) const;
    /// Programs that have held this renderer up and are good all the same, as far as this scene says: materials are
    /// drawn without them. One whose verdict or text becomes another is drawn with again.
    [[nodiscard]] std::vector<HeldUpBy> heldUpBy(const Aspect& aspect);
    /// Another number when persons' programs are drawn otherwise than before, though no list is: one has been refused,
    /// is left out, or is drawn with again (`heldUpBy`). Pictures of before may show it, or the shadow that it made, or
    /// lack both. Programs that are forgotten, as nobody draws with them, change nothing.
    [[nodiscard]] std::uint64_t programChanges() const;
    /// Of meshes and textures, as uploaded.
    [[nodiscard]] std::size_t residentBytes() const;
    /// Of what pictures are drawn in: framebuffers, which reach as far as a cell at most, maps of shadows, and the
    /// depths that cullers ask.
    [[nodiscard]] std::size_t bufferBytes() const;
    /// Of meshes, given to GL since this began.
    [[nodiscard]] std::uint64_t uploadedMeshBytes() const;
    /// The same of images, with their mipmaps.
    [[nodiscard]] std::uint64_t uploadedTextureBytes() const;

private:
    Renderer();
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace tessera
