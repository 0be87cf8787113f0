// What a list holds becomes draw calls, for one cell after the other.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/draw/passes/RendererImpl.h"
#include "client/draw/shaders/ToneCurves.h"
#include "common/math/Srgb.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

/// A tile's scissor lies on this grid: it is the software rasteriser's own, and makes seams exact.
constexpr int kGridPx = 64;
/// Passes over the screen need whole pixels alone; whole stamps of the software rasteriser's, in which pixels know
/// their neighbours.
constexpr int kStampPx = 4;

/// The tile's rectangle grown outwards to a grid.
PixelRect grownTo(int grid, const PixelRect& r) {
    const int left = r.x / grid * grid;
    const int bottom = r.y / grid * grid;
    const int right = (r.x + r.width + grid - 1) / grid * grid;
    const int top = (r.y + r.height + grid - 1) / grid * grid;
    return {.x = left, .y = bottom, .width = right - left, .height = top - bottom};
}

Expected<void> checkRect(const ScreenCamera& camera, const PixelRect& r) {
    if (r.x < 0 || r.y < 0 || r.width <= 0 || r.height <= 0 || r.width > camera.pixels.width - r.x ||
        r.height > camera.pixels.height - r.y)
        return fail(ErrorCode::kBadInput,
                    fmt::format("a tile of {}x{} at {},{} does not lie on its screen of {}x{}", r.width, r.height, r.x,
                                r.y, camera.pixels.width, camera.pixels.height));
    return {};
}

/// What a screen shows where nothing is, to the step of 255. So it does not matter how a clear colour is rounded.
Vec3d shownOf(const Environment& environment) {
    const Vec3d c = toneMapped(environment.toneMap, environment.background.cast<double>());
    const auto encoded = [](double v) { return std::round(255 * srgbOfLinear(std::clamp(v, 0.0, 1.0))) / 255; };
    return {encoded(c.x()), encoded(c.y()), encoded(c.z())};
}

/// From the origin to the farthest corner.
double reachOf(const Box& box, const Vec3d& origin) {
    return (box.upper - origin).cwiseAbs().cwiseMax((box.lower - origin).cwiseAbs()).norm();
}

}  // namespace

Expected<void> Renderer::Impl::begin(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera,
                                     const PixelRect& rect) {
    if (auto good = checkRect(camera, rect); !good) return good;
    looksUploaded = 0;
    samples = std::min(options.samples, detailStep(camera.detail).mostSamples);
    tile.useSamples(samples);
    scene = {.detail = list.detailed,
             .coated = list.coated,
             .glossy = list.glossy,
             .studio = list.studio.has_value(),
             .toneMap = static_cast<std::uint8_t>(list.environment.toneMap),
             .samples = samples};
    metered.clear();
    shareMemory();
    looks.persons().beginDraw();
    if (auto room = shadows.begin(list.casters); !room) return room;
    if (auto drawn = drawShadows(aspect); !drawn) return drawn;
    collect(aspect, list, camera);
    placeCalls(camera);
    for (const std::uint32_t gone : looks.persons().forgetUnused()) {
        std::erase_if(programs, [gone](const auto& made) { return made.first.person == gone; });
        std::erase_if(drawnWith, [gone](const auto& drawn) { return drawn.first.second.person == gone; });
    }
    triangles = glCalls = states = pixels = 0;
    lightsLeftOut = list.lightsLeftOut;
    shadowsLeftOut = list.shadowsLeftOut;
    scopesLeftOut = list.scopesLeftOut;
    scene.lists = lights.begin(list.lights, camera, list.casters ? shadows.texels(camera) : ShadowMaps::Texels(),
                               !options.clusterLights);
    scene.scoped = lights.scoped();
    scene.cubes = lights.cubes();
    scene.oneSun = lights.oneSun() && !scene.scoped && !scene.studio;
    scene.environment = surroundings.begin(aspect, list.environment);
    const Vec3d seen = shownOf(list.environment);
    background = {static_cast<float>(seen.x()), static_cast<float>(seen.y()), static_cast<float>(seen.z()), 1};
    ofFrame = makeFrameBlock(list, camera);
    ofFrame.surroundings = surroundings.block();
    if (scene.studio) ofFrame.surroundings[1][3] = 1;
    const auto [from, count] = lights.shadowed();
    const auto [pixelWidth, pixelHeight] = shadows.pixelSize();
    ofFrame.shadows = {from, count, pixelWidth, pixelHeight};
    ofFrame.suns = lights.suns();
    ofFrame.few = lights.few();
    return {};
}

void Renderer::Impl::collect(const Aspect& aspect, const DrawList& list, const ScreenCamera& camera) {
    calls.collect(aspect, list, camera, stores());
    uploadCalls();
}

/// What the calls that have been collected read, besides meshes and images.
void Renderer::Impl::uploadCalls() {
    looksUploaded += looks.upload();
    volumes.upload(calls.volumes());
    // Images of what was drawn before may be gone.
    std::erase_if(kin, [](const Kin& k) {
        return k.what.second.maps != 0 || k.what.second.layers != 0 || k.what.second.person != 0;
    });
    const auto upload = [this](GLuint buffer, const auto& values) {
        gl.NamedBufferData(buffer, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])), values.data(),
                           GL_STREAM_DRAW);
    };
    if (!calls.blocks().empty()) upload(blockBuffer, calls.blocks());
    if (!calls.sortedIndices().empty()) upload(sortedBuffer, calls.sortedIndices());
}

void Renderer::Impl::upload(const FrameBlock& block) {
    gl.NamedBufferSubData(frameBuffer, 0, sizeof block, &block);
    gl.BindBufferBase(GL_UNIFORM_BUFFER, 0, frameBuffer);
}

void Renderer::Impl::setUp(const PixelRect& viewport, GLuint framebuffer) {
    gl.Viewport(viewport.x, viewport.y, viewport.width, viewport.height);
    gl.Enable(GL_SCISSOR_TEST);
    gl.Scissor(scissor.x, scissor.y, scissor.width, scissor.height);
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    gl.DepthMask(GL_TRUE);
    gl.ColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
    gl.Disable(GL_BLEND);
    gl.BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
}

void Renderer::Impl::placeCalls(const ScreenCamera& screen) {
    callPlaces.assign(calls.calls().size(), {});
    const TileProjection projection(screen,
                                    {.x = 0, .y = 0, .width = screen.pixels.width, .height = screen.pixels.height});
    if (!projection.usable()) return;
    looked.clear();
    boxes.clear();
    world_T_items.clear();
    for (std::size_t i = 0; i < callPlaces.size(); ++i) {
        const DrawCall& call = calls.calls()[i];
        const DrawItem& item = *call.item;
        callPlaces[i].clustered = !item.clusters.empty() && call.sortedCount == 0;
        if (item.everywhere || item.box.empty()) continue;
        looked.push_back(static_cast<std::uint32_t>(i));
        boxes.push_back(item.box.lower.data());
        world_T_items.push_back(item.world_T_item.data());
    }
    rectangles.resize(looked.size());
    placeOnScreen(projection, boxes, world_T_items, rectangles);
    for (std::size_t k = 0; k < looked.size(); ++k) {
        CallPlace& place = callPlaces[looked[k]];
        place.around = rectangles[k];
        // Not a number is anywhere.
        place.known = place.around.lowerX <= place.around.upperX && place.around.lowerY <= place.around.upperY;
        const float lineWidth = calls.calls()[looked[k]].item->lineWidth;
        if (lineWidth == 0) continue;
        const double reach = lineReachPx(lineWidth);
        place.around.lowerX -= reach;
        place.around.lowerY -= reach;
        place.around.upperX += reach;
        place.around.upperY += reach;
    }
}

Expected<void> Renderer::Impl::beginCell(const DrawList& list, const ScreenCamera& screen, const CellPart& cell,
                                         TileBuffers& buffers) {
    scissor = grownTo(kGridPx, cell.inCell);
    if (auto room = buffers.reach(scissor.x + scissor.width, scissor.y + scissor.height); !room) return room;
    const ClusterSight sight(screen, cell.onScreen,
                             {.x = cell.onScreen.x - cell.inCell.x,
                              .y = cell.onScreen.y - cell.inCell.y,
                              .width = kCellWidthPx,
                              .height = kCellHeightPx});
    const Frustum frustum = tileFrustum(screen, cell.onScreen);
    const Frustum aroundLines = tileFrustum(screen, cell.onScreen, kFrustumMarginPx + calls.widestLineReachPx());
    inCell.clear();
    runs.clear();
    ScreenBlocks blocks(scissor), transparent(scissor);
    const bool everywhere = &buffers != &tile || !options.leaveOutEmpty || backgroundIsLit();
    if (everywhere) blocks.addAll();
    const PixelRect& part = cell.onScreen;
    const auto beside = [&part](const places::Rectangle& around) {
        return around.upperX < part.x || around.lowerX > part.x + part.width || around.upperY < part.y ||
               around.lowerY > part.y + part.height;
    };
    for (std::size_t i = 0; i < calls.calls().size(); ++i) {
        const DrawCall& call = calls.calls()[i];
        const CallPlace& place = callPlaces[i];
        const auto first = static_cast<std::uint32_t>(runs.size());
        const std::uint32_t all = (call.sortedCount > 0 ? call.sortedCount : call.mesh.indexCount) / 3;
        // The item itself is asked for what its place does not tell alone: each cell goes through all of them.
        const auto outsideFrustum = [&](const DrawItem& item) {
            const Frustum& sides = rowOf(item.kind).standsOut ? aroundLines : frustum;
            return !item.everywhere && !item.box.empty() && sides.classify(item.box, Frustum::kAllPlanes).outside;
        };
        const bool outside = place.known ? beside(place.around) : outsideFrustum(*call.item);
        if (!outside && place.clustered)
            sight.appendRuns({.clusters = call.item->clusters,
                              .triangles = all,
                              .hidden = list.hiddenOf(*call.item),
                              .backFacesShown = looks[call.look].doubleSided,
                              .reach = reachOf(call.item->box, call.item->world_T_item.translation())},
                             call.item->world_T_item, runs);
        else if (!outside)
            runs.push_back({0, all});
        const bool solid = inCell.size() < calls.opaqueCount();
        inCell.push_back({first, static_cast<std::uint32_t>(runs.size())});
        ScreenBlocks& of = solid ? blocks : transparent;
        if (first == runs.size() || of.full()) continue;
        if (!place.known || everywhere)
            of.addAll();
        else
            of.add(place.around, part.x - cell.inCell.x, part.y - cell.inCell.y);
    }
    blocks.add(transparent);
    const PixelRect own = grownTo(kStampPx, cell.inCell);
    shown = blocks.rectangles(own);
    blending = transparent.rectangles(own);
    for (const PixelRect& lit : shown)
        pixels += static_cast<std::uint64_t>(lit.width) * static_cast<std::uint64_t>(lit.height);

    project(ofFrame, cell.camera);
    ofFrame.slices = lights.beginCell(cell.camera, scissor);
    const bool detailed = scene.detail && &buffers == &tile;
    const auto framebuffer = detailed ? buffers.detailedSurfaces() : buffers.surfaces();
    if (!framebuffer) return tl::unexpected(framebuffer.error());
    // The whole cell's viewport for every tile that shares in it; only the scissor is the tile's own.
    const PixelRect viewport{.x = 0, .y = 0, .width = cell.camera.pixels.width, .height = cell.camera.pixels.height};
    upload(ofFrame);
    setUp(viewport, *framebuffer);
    if (&buffers == &tile) {
        if (auto cleared = clearSurfaces(*framebuffer); !cleared) return cleared;
        setUp(viewport, *framebuffer);
        return {};
    }
    const std::array<GLuint, 4> nothing{};
    gl.ClearNamedFramebufferuiv(*framebuffer, GL_COLOR, 0, nothing.data());
    gl.ClearNamedFramebufferfv(*framebuffer, GL_DEPTH, 0, &kFarthest);
    return {};
}

ProgramKind Renderer::Impl::kindOf(ProgramKind::Use use) const {
    using Use = ProgramKind::Use;
    ProgramKind kind{.use = use};
    const bool lightsSurfaces =
        use == Use::kLightOne || use == Use::kLight || use == Use::kLightRest || use == Use::kMeter;
    if (isLit(use)) {
        kind.coated = scene.coated;
        kind.glossy = scene.glossy;
        kind.scoped = scene.scoped;
        kind.lists = scene.lists;
        kind.cubes = scene.cubes;
        kind.environment = scene.environment;
        if (use != Use::kMeter) kind.toneMap = scene.toneMap;
    }
    if (use == Use::kSurface || use == Use::kClear || use == Use::kClassify || lightsSurfaces)
        kind.detail = scene.detail;
    if (lightsSurfaces) kind.studio = scene.studio;
    if (lightsSurfaces) kind.oneSun = scene.oneSun;
    if (use != Use::kBlend && use != Use::kSurface && use != Use::kNodeIds && use != Use::kShadow &&
        use != Use::kCopy && use != Use::kClear)
        kind.samples = samples;
    return kind;
}

ProgramKind Renderer::Impl::kindOf(ProgramKind::Use use, const DrawCall& call) const {
    using Use = ProgramKind::Use;
    const DrawLook& look = looks[call.look];
    ProgramKind kind = kindOf(use);
    kind.items = call.mesh.kind;
    kind.pointParts = call.mesh.pointParts;
    kind.masked = look.masked && use != Use::kBlend;
    if (look.person && use != Use::kDepth)
        kind.person = looks.persons().isRefused(look.person) ? PersonPrograms::kError : look.person;
    if (use == Use::kNodeIds || use == Use::kShadow) {
        if (kind.masked) kind.maps = look.mapBits & bitOf(ImageMap::kBaseColor);
        if (kind.person) kind.maps = look.mapBits;
        kind.faceted = kind.person && !call.mesh.hasNormals;
    } else {
        kind.maps = look.mapBits;
        kind.layers = look.layerBits;
        kind.faceted = !call.mesh.hasNormals;
    }
    // No material says anything of a volume.
    if (rowOf(call.mesh.kind).volume) {
        kind.maps = kind.layers = 0;
        kind.masked = false;
        kind.person = PersonPrograms::kNone;
        if (use == Use::kBlend) kind.samples = samples;
    }
    kind.large = use == Use::kSurface && DrawCalls::isLarge(call);
    const bool balls = formOf(kind.items).balls;
    kind.plain = use == Use::kSurface && !kind.person && kind.maps == 0 && kind.layers == 0 && !kind.masked &&
                 (!call.mesh.hasColors || balls);
    kind.look = kind.maps != 0 || kind.layers != 0 || kind.masked || kind.person ||
                (use == Use::kBlend && !rowOf(call.mesh.kind).volume);
    kind.tangents = call.mesh.hasTangents && (kind.maps & bitOf(ImageMap::kNormal)) != 0;
    if ((use == Use::kSurface && (kind.masked || balls)) || (use == Use::kBlend && balls)) kind.samples = samples;
    return kind;
}

/// In the list's order. Neighbours of one mesh and one state are instances of one call: GL draws these in their order.
Expected<void> Renderer::Impl::issue(std::size_t first, std::size_t last, ProgramKind::Use use) {
    inPass.clear();
    records.clear();
    for (std::size_t i = first; i < last; ++i) {
        if (inCell[i].first == inCell[i].end) continue;
        // Outlines that lie over a surface.
        if (use == ProgramKind::Use::kShadow && !rowOf(calls.calls()[i].mesh.kind).castsShadows) continue;
        inPass.push_back(static_cast<std::uint32_t>(i));
        records.push_back(calls.recordOf(calls.calls()[i]));
    }
    if (inPass.empty()) return {};
    gl.NamedBufferData(itemBuffer, static_cast<GLsizeiptr>(records.size() * sizeof(ItemRecord)), records.data(),
                       GL_STREAM_DRAW);
    gl.VertexArrayVertexBuffer(vertexArray, kItemBinding, itemBuffer, 0, sizeof(ItemRecord));
    gl.BindVertexArray(vertexArray);
    recordsFrom = 0;
    if (auto compiledFirst = compileWatched(use); !compiledFirst) return compiledFirst;
    const auto oneRun = [this](std::uint32_t call) { return inCell[call].end - inCell[call].first == 1; };
    const DrawCall* before = nullptr;
    for (std::size_t i = 0, next = 0; i < inPass.size(); i = next) {
        if (auto wanted = goOn(); !wanted) return wanted;
        const DrawCall& call = calls.calls()[inPass[i]];
        const ProgramKind wanted = kindOf(use, call);
        if (auto watching = watchFor(wanted); !watching) return watching;
        if (auto set = setState(call, before, wanted); !set) return set;
        before = &call;
        next = i + 1;
        while (!kindNow.large && oneRun(inPass[i]) && next < inPass.size() && oneRun(inPass[next]) &&
               runs[inCell[inPass[next]].first] == runs[inCell[inPass[i]].first] &&
               DrawCalls::sameButPlace(call, calls.calls()[inPass[next]]))
            ++next;
        drawInstances(i, next - i);
        if (!formOf(call.mesh.kind).castRays || kindNow.samples == 1 || use != ProgramKind::Use::kBlend) continue;
        // Then pixels whose samples see different depths.
        kindNow.pointParts |= kMarchEachSample;
        if (auto used = useProgram(kindNow); !used) return used;
        met(Pass::kBlend, kindNow, call.look);
        drawInstances(i, next - i);
    }
    return watchNoMore();
}

Expected<void> Renderer::Impl::setState(const DrawCall& call, const DrawCall* before, const ProgramKind& wanted) {
    const DrawLook& look = looks[call.look];
    const ProgramKind::Use use = wanted.use;
    const bool anotherProgram = !before || wanted != kindNow, anotherLook = !before || before->look != call.look;
    // What turns its back to a light stands in its way all the same.
    const auto bothSides = [this, use](const DrawCall& of) {
        const DrawForm::Sides sides = formOf(of.mesh.kind).sides;
        if (sides != DrawForm::Sides::kMaterial) return sides == DrawForm::Sides::kBoth;
        return looks[of.look].doubleSided || use == ProgramKind::Use::kShadow;
    };
    const auto mirrored = [](const DrawCall& of) { return of.mirrored && !formOf(of.mesh.kind).balls; };
    const bool otherSides = !before || bothSides(*before) != bothSides(call);
    const bool otherFront = !before || mirrored(*before) != mirrored(call);
    if (anotherProgram)
        if (auto used = useProgram(wanted); !used) return used;
    if (anotherLook || kindNow.maps != wanted.maps || kindNow.layers != wanted.layers)
        bindLook(call.look, wanted.maps, wanted.layers);
    if (wanted.person && (anotherProgram || anotherLook)) say(wanted, look);
    kindNow = wanted;
    if (otherSides) bothSides(call) ? gl.Disable(GL_CULL_FACE) : gl.Enable(GL_CULL_FACE);
    const auto depthTest = [](const DrawCall& of) -> GLenum {
        return formOf(of.mesh.kind).castRays ? GL_ALWAYS : of.equal ? GL_GEQUAL : GL_GREATER;
    };
    if (use == ProgramKind::Use::kBlend && depthTest(call) != (before ? depthTest(*before) : GL_GREATER))
        gl.DepthFunc(depthTest(call));
    if (use == ProgramKind::Use::kBlend && call.voxels.voxels != 0) volumes.bind(call.voxels, call.volume);
    if (otherFront) gl.FrontFace(mirrored(call) ? GL_CW : GL_CCW);
    insidesNow = bothSides(call);
    if (wanted.large)
        gl.BindBufferRange(GL_UNIFORM_BUFFER, 2, blockBuffer, static_cast<GLintptr>(call.block * sizeof(ItemBlock)),
                           sizeof(ItemBlock));
    states += anotherProgram || anotherLook || otherSides || otherFront;
    using Use = ProgramKind::Use;
    if (anotherProgram && (use == Use::kSurface || use == Use::kBlend))
        met(use == Use::kBlend ? Pass::kBlend : Pass::kSurfaces, wanted, call.look);
    return {};
}

void Renderer::Impl::drawInstances(std::size_t firstRecord, std::size_t instances) {
    const std::uint32_t index = inPass[firstRecord];
    const DrawCall& call = calls.calls()[index];
    const Span& span = inCell[index];
    const bool sorted = call.sortedCount > 0;
    // Several runs in one call know no first instance: their record is bound instead.
    const bool severalRuns = span.end - span.first > 1;
    if (const std::size_t wanted = severalRuns ? firstRecord : 0; !kindNow.large && wanted != recordsFrom) {
        gl.VertexArrayVertexBuffer(vertexArray, kItemBinding, itemBuffer,
                                   static_cast<GLintptr>(wanted * sizeof(ItemRecord)), sizeof(ItemRecord));
        recordsFrom = wanted;
    }
    if (!severalRuns) {
        const TriangleRun& run = runs[span.first];
        triangles += run.count * instances * (call.mesh.indicesEach / 3);
        if (!sorted) {
            glCalls += meshes->draw(call.mesh, run.first, run.count, firstRecord, instances, insidesNow);
            return;
        }
        ++glCalls;
        meshes->bind(call.mesh, sortedBuffer);
        gl.DrawElementsInstancedBaseVertexBaseInstance(
            GL_TRIANGLES, static_cast<GLsizei>(3 * run.count), GL_UNSIGNED_INT,
            reinterpret_cast<const void*>((call.firstSorted + 3 * std::size_t{run.first}) * sizeof(std::uint32_t)),
            static_cast<GLsizei>(instances), call.mesh.baseVertex, static_cast<GLuint>(firstRecord));
        return;
    }
    if (call.mesh.atOnce > 0) {
        for (std::uint32_t k = span.first; k < span.end; ++k) {
            glCalls += meshes->draw(call.mesh, runs[k].first, runs[k].count, 0, 1, insidesNow);
            triangles += runs[k].count * (call.mesh.indicesEach / 3);
        }
        return;
    }
    ++glCalls;
    meshes->bind(call.mesh, meshes->indexBuffer());
    counts.clear();
    offsets.clear();
    for (std::uint32_t k = span.first; k < span.end; ++k) {
        counts.push_back(static_cast<GLsizei>(3 * runs[k].count));
        offsets.push_back(reinterpret_cast<const void*>((call.mesh.firstIndex + 3 * std::size_t{runs[k].first}) *
                                                        sizeof(std::uint32_t)));
        triangles += runs[k].count;
    }
    baseVertices.assign(counts.size(), call.mesh.baseVertex);
    gl.MultiDrawElementsBaseVertex(GL_TRIANGLES, counts.data(), GL_UNSIGNED_INT, offsets.data(),
                                   static_cast<GLsizei>(counts.size()), baseVertices.data());
}

void Renderer::Impl::bindLook(std::uint32_t index, std::uint8_t maps, std::uint16_t layers) {
    gl.BindBufferRange(GL_UNIFORM_BUFFER, 1, looks.buffer(), static_cast<GLintptr>(index * sizeof(LookBlock)),
                       sizeof(LookBlock));
    const DrawLook& look = looks[index];
    for (GLuint map = 0; map < kImageMaps; ++map) {
        if ((maps >> map & 1) == 0) continue;
        gl.BindTextureUnit(kFirstMapUnit + map, look.maps[map].texture->name);
        gl.BindSampler(kFirstMapUnit + map, textures.sampler(look.maps[map].sampler));
    }
    for (GLuint layer = 0; layers >> (kLayerBits * layer) != 0; ++layer) {
        gl.BindTextureUnit(kFirstLayerUnit + layer, look.layers[layer].texture->name);
        gl.BindSampler(kFirstLayerUnit + layer, textures.sampler(look.layers[layer].sampler));
    }
}

}  // namespace tessera
