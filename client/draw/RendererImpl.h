/// The inside of a Renderer, for the files that it consists of: drawing a list (ListDrawing.cpp), light and what is transparent over
/// the whole screen (ScreenPasses.cpp), and pictures of all cells (Renderer.cpp).
#pragma once

#include <map>
#include <memory>
#include <set>
#include <vector>

#include "client/draw/DepthQueries.h"
#include "client/draw/DrawCalls.h"
#include "client/draw/LightBuffers.h"
#include "client/draw/Renderer.h"
#include "client/draw/ScreenCells.h"
#include "client/draw/ShadowMaps.h"
#include "client/draw/TileBuffers.h"

namespace tessera {

// Texture units, as the shaders have them: those of materials are no others', as a sampler stays bound to its unit.
inline constexpr GLuint kFirstMapUnit = 3, kDetailUnit = kFirstMapUnit + kImageMaps,
                 kLightUnit = kDetailUnit + 1, kListUnit = kLightUnit + 1,
                 kSurroundingsUnit = kListUnit + 1, kShadowUnit = kSurroundingsUnit + 1;

struct Renderer::Impl {
    Impl(Surface& onSurface, GlFunctions functions, RendererOptions o);
    ~Impl();

    [[nodiscard]] Expected<void> begin(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                       const PixelRect& rect);
    [[nodiscard]] Expected<void> beginCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell,
                                           TileBuffers& buffers);
    /// What is to be drawn of a list, seen from here.
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera);
    [[nodiscard]] Expected<void> drawShadows(const Aspect& aspect, std::size_t index);
    void setUp(const FrameBlock& block, const PixelRect& viewport, GLuint framebuffer);
    [[nodiscard]] Expected<void> drawCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell);
    [[nodiscard]] Expected<void> drawCells(const DrawList& list, const ScreenCamera& camera, const PixelRect& rect,
                                           const PixelRows& rows);
    /// Into rows of `rect`, from below.
    void readBack(GLuint framebuffer, const CellPart& cell, const PixelRect& rect, GLenum format, GLenum type,
                  std::size_t bytesPerPixel, void* rows);
    /// The colours of a cell's picture, to where they belong in that of `rect`.
    void readColors(const CellPart& cell, const PixelRect& rect, const PixelRows& rows);
    [[nodiscard]] Expected<GLuint> program(const ProgramKind& kind);
    [[nodiscard]] Expected<void> useProgram(const ProgramKind& kind);
    /// The program for something of this list; for one of its calls.
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use) const;
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use, const DrawCall& call) const;
    [[nodiscard]] Expected<void> issue(std::size_t first, std::size_t last, ProgramKind::Use use);
    void bindLook(std::uint32_t index, std::uint8_t maps);
    [[nodiscard]] Expected<void> drawOverScreen(const ProgramKind& kind);
    /// Compiles, for all that is set now, what the next draw would need if the scene's lights were others.
    [[nodiscard]] Expected<void> prepareForShadows(const ProgramKind& kind);
    [[nodiscard]] Expected<void> prepareForOtherLights(const ProgramKind& kind);
    [[nodiscard]] Expected<void> lightSurfaces();
    [[nodiscard]] Expected<void> copyToSamples();
    [[nodiscard]] Expected<void> blendTransparent();
    void bindSurfaces();
    /// Whether the cell may show anything transparent.
    [[nodiscard]] bool blends() const;

    Surface& surface;
    GlFunctions gl;
    RendererOptions options;
    std::map<ProgramKind, Program> programs;  ///< made when first needed
    std::set<ProgramKind> prepared;           ///< `otherwiseLit`: made for all lights
    GLuint vertexArray = 0, emptyArray = 0;
    GLuint itemBuffer = 0, sortedBuffer = 0, lookBuffer = 0, frameBuffer = 0, materialBuffer = 0, materialTexture = 0;
    std::unique_ptr<MeshBuffers> meshes;
    TextureCache textures;
    TileBuffers tile, ids;
    LightBuffers lights;
    EnvironmentTexture surroundings;
    ShadowMaps shadows;
    std::unique_ptr<DepthQueries> depths;  ///< made when a culler asks

    // Of the list being drawn.
    DrawCalls calls;
    // Of the cell being drawn, by call: which runs of triangles it may show, of all that are.
    struct Span {
        std::uint32_t first = 0, end = 0;
    };
    std::vector<Span> inCell;
    std::vector<TriangleRun> runs;
    std::vector<GLsizei> counts;
    std::vector<const void*> offsets;
    std::vector<GLint> baseVertices;
    bool readsFromTop = false;       ///< GL hands rows out from the top
    std::vector<std::uint8_t> rgbx;  ///< of `draw`
    Duration readBackTime{};
    std::uint64_t triangles = 0, lightsLeftOut = 0, shadowsLeftOut = 0;
    PixelRect scissor;
    GLuint surfacesNow = 0;  ///< the framebuffer that `setUp` has bound
    ProgramKind scene;  ///< what all programs of the list share
};

}  // namespace tessera
