/// The inside of a Renderer, for the files that it consists of: drawing a list (ListDrawing.cpp), light and what is transparent over
/// the whole screen (ScreenPasses.cpp), and pictures of all cells (Renderer.cpp).
#pragma once

#include <map>
#include <memory>
#include <optional>
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
    /// Into rows of `rect`, from below.
    void readBack(GLuint framebuffer, const CellPart& cell, const PixelRect& rect, GLenum format, GLenum type,
                  std::size_t bytesPerPixel, void* rows);
    [[nodiscard]] Expected<GLuint> program(const ProgramKind& kind);
    [[nodiscard]] Expected<void> useProgram(const ProgramKind& kind);
    /// The program for something of this list; for one of its calls.
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use) const;
    [[nodiscard]] ProgramKind kindOf(ProgramKind::Use use, const DrawCall& call) const;
    [[nodiscard]] Expected<void> issue(std::size_t first, std::size_t last, ProgramKind::Use use);
    /// Program, material and sides for a call, where they are not what they were for the one before (or null).
    [[nodiscard]] Expected<void> setState(const DrawCall& call, const DrawCall* before, ProgramKind::Use use);
    /// So many records from here on, of one mesh.
    void drawInstances(std::size_t firstRecord, std::size_t instances);
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
    GLuint itemBuffer = 0, blockBuffer = 0, sortedBuffer = 0, lookBuffer = 0, frameBuffer = 0, materialBuffer = 0, materialTexture = 0;
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
    // Of the pass: calls that the cell may show, and their records, in order.
    std::vector<std::uint32_t> inPass;
    std::vector<ItemRecord> records;
    ProgramKind kindNow;
    std::optional<bool> sortedBound;  ///< which indices the vertex array has
    std::size_t recordsFrom = 0;      ///< the record that the vertex array has first
    std::vector<GLsizei> counts;
    std::vector<const void*> offsets;
    std::vector<GLint> baseVertices;
    std::uint64_t triangles = 0, glCalls = 0, states = 0, lightsLeftOut = 0, shadowsLeftOut = 0;
    PixelRect scissor;
    GLuint surfacesNow = 0;  ///< the framebuffer that `setUp` has bound
    ProgramKind scene;  ///< what all programs of the list share
};

}  // namespace tessera
