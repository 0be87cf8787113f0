/// The inside of a Renderer, for the files that it consists of: drawing a list (ListDrawing.cpp), what lights see
/// (ShadowDrawing.cpp), light and what is transparent over parts of the screen (ScreenPasses.cpp), programs that may be
/// needed (Programs.cpp), and pictures of all cells (Renderer.cpp).
#pragma once

#include <unistd.h>

#include <map>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <vector>

#include "client/draw/passes/DepthQueries.h"
#include "client/draw/passes/DrawCalls.h"
#include "client/draw/passes/LightBuffers.h"
#include "client/draw/passes/LookTable.h"
#include "client/draw/passes/Renderer.h"
#include "client/draw/passes/ScreenBlocks.h"
#include "client/draw/passes/ScreenCells.h"
#include "client/draw/passes/ShadowMaps.h"
#include "client/draw/shaders/LoopWatch.h"
#include "client/draw/store/TileBuffers.h"
#include "client/draw/surface/GlMemory.h"

namespace tessera {

// Texture units, as the shaders have them: those of materials are no others', as a sampler stays bound to its unit.
inline constexpr GLuint kFirstMapUnit = 3, kDetailUnit = kFirstMapUnit + kImageMaps, kLightUnit = kDetailUnit + 1,
                        kListUnit = kLightUnit + 1, kSurroundingsUnit = kListUnit + 1,
                        kShadowUnit = kSurroundingsUnit + 1;
static_assert(kShadowUnit < kPointUnit);
inline constexpr GLuint kFirstLayerUnit = 16;

inline constexpr float kFarthest = 0;  ///< depth is reversed

/// What GL is set to: a software rasteriser compiles a program anew for each that it is drawn with.
enum class Pass : std::uint8_t {
    kSurfaces,    ///< what is solid
    kClear,       ///< see ProgramKind
    kClearDepth,  ///< the same without colours
    kClassify,
    kLightOne,
    kLight,
    kLightRest,
    kRestAlone,  ///< the same into a picture of its own
    kMeter,
    kCopy,
    kSpread,
    kBlend,
    kResolve,
    kShadow,
};

struct Renderer::Impl {
    Impl(Surface& onSurface, const GlState& state, RendererOptions o);
    ~Impl();

    [[nodiscard]] Expected<void> begin(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                       const PixelRect& rect);
    /// An error once nobody wants what is drawn.
    [[nodiscard]] Expected<void> goOn();
    [[nodiscard]] Expected<void> beginCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell,
                                           TileBuffers& buffers);
    /// What is to be drawn of a list, seen from here.
    void collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera);
    [[nodiscard]] DrawStores stores() { return {*budget, *meshes, textures, volumes, looks}; }
    void uploadCalls();
    /// What meshes, images and voxels may take now.
    void shareMemory();
    [[nodiscard]] std::size_t memoryBytes() const;
    [[nodiscard]] std::size_t bufferBytes() const;
    void placeCalls(const ScreenCamera& screen);
    [[nodiscard]] Expected<void> drawShadows(const Aspect& aspect);
    [[nodiscard]] Expected<void> drawCasters(const Aspect& aspect, std::size_t index, std::span<const DrawItem> seen,
                                             const MapBlocks& blocks, bool anew);
    void upload(const FrameBlock& block);
    /// For what is drawn first.
    void setUp(const PixelRect& viewport, GLuint framebuffer);
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
    /// Program, material and sides for a call, where they are not what they were for the one before (or null).
    [[nodiscard]] Expected<void> setState(const DrawCall& call, const DrawCall* before, const ProgramKind& wanted);
    /// So many records from here on, of one mesh.
    void drawInstances(std::size_t firstRecord, std::size_t instances);
    void bindLook(std::uint32_t index, std::uint8_t maps, std::uint16_t layers);
    /// What a material says to the person's program in use.
    void say(const ProgramKind& kind, const DrawLook& look);
    /// Sets what a pass needs but its program; `kSurfaces` sets `setUp`.
    [[nodiscard]] Expected<void> enter(Pass pass);
    /// The pass over these parts of the cell; where there are none, it is to be prepared.
    [[nodiscard]] Expected<void> drawOver(Pass pass, std::span<const PixelRect> parts);
    [[nodiscard]] Expected<void> lightSurfaces();
    [[nodiscard]] Expected<void> blendTransparent();
    /// Adds how bright the cell's surfaces are to `metered`.
    [[nodiscard]] Expected<void> meter(const CellPart& cell);
    /// To nothing, far away: what is `shown` of the tile's.
    [[nodiscard]] Expected<void> clearSurfaces(GLuint framebuffer);
    /// Notes that a program was drawn with, in a pass: what other lights would draw in its place is to be made some
    /// time.
    void met(Pass pass, const ProgramKind& kind, std::uint32_t look);
    void expectKin(Pass pass, const ProgramKind& kind, std::uint32_t look);
    void expect(Pass pass, const ProgramKind& kind, std::uint32_t look);
    [[nodiscard]] Expected<void> make(Pass pass, const ProgramKind& kind, std::uint32_t look);
    void bindSurfaces();
    /// Pixels where nothing is are lit as others are: surroundings are seen there, or a studio.
    [[nodiscard]] bool backgroundIsLit() const { return surroundings.seen() || scene.studio; }
    /// Draws until no person's program holds it up (see RendererOptions::programsMost).
    [[nodiscard]] Expected<void> drawInTime(const std::function<Expected<void>()>& once);
    /// Whether what is drawn with it is watched.
    [[nodiscard]] bool isWatched(const ProgramKind& kind) const;
    /// Draws nothing with the programs of a pass that are watched: what a software rasteriser compiles then is no time
    /// of theirs.
    [[nodiscard]] Expected<void> compileWatched(ProgramKind::Use use);
    /// Before something is drawn with this program: what a person's loops take is measured, that of several together as
    /// long as nobody is to blame.
    [[nodiscard]] Expected<void> watchFor(const ProgramKind& kind);
    /// An error where it took too long.
    [[nodiscard]] Expected<void> watchNoMore();
    void blame();
    void blameAll();

    Surface& surface;
    GlState gl;
    RendererOptions options;
    const std::function<bool()>* unwanted = nullptr;  ///< while something is drawn that may not be wanted to its end
    bool leftOff = false;                             ///< it was not
    int samples = 4;  ///< per pixel, of the list being drawn: the options', or fewer where the camera's detail says so
    std::map<ProgramKind, Program> programs;  ///< made when first needed
    std::uint64_t compiled = 0;               ///< of them, those that are gone again included
    using Drawn = std::pair<Pass, ProgramKind>;
    std::map<Drawn, bool> drawnWith;  ///< compiled to the last; whether something was drawn with it
    /// Not made yet, and for which of the list's looks.
    struct Kin {
        Drawn what;
        std::uint32_t look = 0;
    };
    std::vector<Kin> kin;
    std::minstd_rand anyKin{static_cast<unsigned>(::getpid())};
    GLuint vertexArray = 0, emptyArray = 0;
    GLuint itemBuffer = 0, blockBuffer = 0, sortedBuffer = 0, frameBuffer = 0;
    GLuint white = 0;  ///< of one pixel: an image that nobody says
    UseClock clock;    ///< of what takes memory of GL
    std::unique_ptr<MeshBuffers> meshes;
    TextureCache textures;
    VolumeTextures volumes;
    std::unique_ptr<SharedBudget> budget;
    LookTable looks;
    TileBuffers tile, ids;
    LightBuffers lights;
    EnvironmentTexture surroundings;
    ShadowMaps shadows;
    std::unique_ptr<DepthQueries> depths;  ///< made when a culler asks
    GlMemory memory;
    unsigned callsSinceAsked = 0;  ///< of shareMemory

    LoopWatch loops;
    /// Each program by itself: once one of several was too slow, and from then on.
    bool watchesEach = false;
    bool shared = false;                 ///< a time of this frame is that of several together
    std::vector<std::uint32_t> watched;  ///< those of now; none: nobody is watched
    using ByProgram = std::map<std::uint32_t, Duration>;
    ByProgram loopsTook, loopsTookBefore;  ///< in the picture so far; in the pictures of this frame before it
    Duration loopsMay{};                   ///< in the picture
    bool framesAreTold = false;            ///< by beginFrame; else each picture is one
    bool rests = false;                    ///< nothing was drawn in the last frame, and what is free has gone

    // Of the list being drawn.
    DrawCalls calls;
    FrameBlock ofFrame{};  ///< projected as the cell being drawn is
    // Of the cell being drawn, by call: which runs of triangles it may show, of all that are.
    struct Span {
        std::uint32_t first = 0, end = 0;
    };
    std::vector<Span> inCell;
    /// Where on the screen it may show, in pixels; once for all cells.
    struct CallPlace {
        places::Rectangle around{};
        bool known = false;      ///< else only the planes around a cell tell
        bool clustered = false;  ///< runs of it are looked at by themselves
    };
    std::vector<CallPlace> callPlaces;
    // Of those that are looked for.
    std::vector<std::uint32_t> looked;
    std::vector<const double*> boxes;
    std::vector<places::Matrix> world_T_items;
    std::vector<places::Rectangle> rectangles;
    std::vector<TriangleRun> runs;
    // Of the pass: calls that the cell may show, and their records, in order.
    std::vector<std::uint32_t> inPass;
    std::vector<ItemRecord> records;
    ProgramKind kindNow;
    bool insidesNow = false;      ///< both sides of what is drawn are seen
    std::size_t recordsFrom = 0;  ///< the record that the vertex array has first
    std::vector<GLsizei> counts;
    std::vector<const void*> offsets;
    std::vector<GLint> baseVertices;
    std::vector<std::uint8_t> rgbx;  ///< of `draw`
    Duration readBackTime{};
    std::uint64_t looksUploaded = 0;
    std::uint64_t triangles = 0, glCalls = 0, states = 0, pixels = 0, lightsLeftOut = 0, shadowsLeftOut = 0,
                  scopesLeftOut = 0;
    PixelRect scissor;
    /// Parts of the tile in this cell where items may be seen, and of those where transparent ones may.
    std::vector<PixelRect> shown, blending;
    std::array<float, 4> background{};  ///< as a screen shows it
    /// Of the picture: by cell, the classes of squares of the screen, row by row from below.
    struct MeteredCell {
        int left = 0, bottom = 0, columns = 0, rows = 0;  ///< squares
        std::size_t pitch = 0;                            ///< bytes
        std::vector<std::uint8_t> classes;
    };
    std::vector<MeteredCell> metered;
    ProgramKind scene;  ///< what all programs of the list share
};

}  // namespace tessera
