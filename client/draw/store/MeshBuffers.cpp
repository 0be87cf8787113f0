#include "client/draw/store/MeshBuffers.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "common/drawable/TangentArrays.h"

namespace tessera {
namespace {

constexpr std::uint64_t kFirstCapacity = 8 * 1024;
/// Beyond the budget a buffer grows by an eighth: so little that `shrink` leaves it, and so much that not each mesh
/// copies all.
constexpr std::uint64_t kLeastGrowth = 8;
/// `shrink` leaves a quarter more than lay there lately, as all is copied; and leaves a 16th free, for gaps.
constexpr std::size_t kWorthIt = 4, kSlack = 16;

}  // namespace

MeshArrays drawnArrays(const DrawMesh& mesh, const Image* normalMap) {
    if (normalMap) return withTangents(mesh.arrays, *normalMap);
    MeshArrays arrays = mesh.arrays;
    arrays.tangents = Blob();
    return arrays;
}

MeshBuffers::MeshBuffers(GlState& gl, const UseClock& clock, GLuint vertexArray, std::size_t mostBytes)
    : gl_(gl), clock_(clock), vertexArray_(vertexArray), mostBytes_(std::min(mostBytes, kMostBufferBytes)) {
    // As many texels as a texture has, and as vertices have numbers.
    GLint most = 0;
    gl_.GetIntegerv(GL_MAX_TEXTURE_BUFFER_SIZE, &most);
    mostTexels_ = std::min<std::uint64_t>(most > 0 ? static_cast<std::uint64_t>(most) : 0,
                                          std::uint64_t{std::numeric_limits<std::int32_t>::max()} / kNumbersPerPoint);
}

MeshBuffers::~MeshBuffers() {
    for (const Buffer& buffer : buffers_) gl_.DeleteBuffers(1, &buffer.name);
    for (const GLuint* buffer : {&sharedIndices_[0], &sharedIndices_[1], &linearBuffer_}) gl_.DeleteBuffers(1, buffer);
    for (const GLuint* texture : {&pointTexture_, &linearTexture_}) gl_.DeleteTextures(1, texture);
}

void MeshBuffers::beginDraw() {
    if (std::exchange(frame_, clock_.frame()) != clock_.frame()) {
        mostBefore_[clock_.frame() % kRecentFrames] = std::exchange(most_, used());
        shrink();
    }
    // One content may come by ever new handles.
    constexpr std::size_t kHandlesEach = 4, kHandlesMore = 4096;
    if (known_.size() > kHandlesEach * meshes_.size() + kHandlesMore) known_.clear();
}

void MeshBuffers::rest() {
    most_ = used();
    mostBefore_.fill(most_);
    shrink();
}

std::size_t MeshBuffers::allocatedBytes() const {
    MeshSize allocated;
    for (std::size_t i = 0; i < kMeshStores; ++i) allocated.elements[i] = buffers_[i].ranges.capacity();
    return allocated.bytes();
}

MeshSize MeshBuffers::used() const {
    MeshSize used;
    for (std::size_t i = 0; i < kMeshStores; ++i) used.elements[i] = buffers_[i].ranges.used();
    return used;
}

std::size_t MeshBuffers::residentBytes() const {
    return used().bytes();
}

void MeshBuffers::addSpares(std::vector<UseClock::Spare>& spares) {
    clock_.addSpares(meshes_, spares, [this](const Key& key) { letGo(key); });
}

void MeshBuffers::letGo(const Key& key) {
    const auto it = meshes_.find(key);
    Mesh& mesh = *it->second;
    clock_.remember(gone_, key, mesh.uses);
    release(mesh);
    mesh.gone = true;
    meshes_.erase(it);
}

/// What lies in GL is the same whatever the radius of points is, and however particles are sorted.
MeshBuffers::Key MeshBuffers::keyOf(const MeshKey& mesh, std::int64_t fill) {
    Key key{.mesh = mesh, .fill = fill};
    key.mesh.pointRadius = 0;
    key.mesh.sorted = false;
    return key;
}

std::shared_ptr<MeshBuffers::Mesh>& MeshBuffers::knownOf(const DrawMesh& mesh, std::int64_t fill,
                                                         const Image* normalMap) {
    Known& known = known_[mesh.serial];
    if (!normalMap) return known.plain[static_cast<std::size_t>(fill)];
    // As TangentArrays.h has it: tangents of a mesh's own follow no image, and a plain stretch turns none.
    const bool own = !mesh.arrays.tangents.empty();
    const bool ahead = normalMap->rotation == 0 && normalMap->scale.x() > 0 && normalMap->scale.y() > 0;
    Placing placing{.texcoordSet = own ? 0 : normalMap->texcoordSet};
    if (!own && !ahead) {
        placing.rotation = normalMap->rotation;
        placing.scale = {normalMap->scale.x(), normalMap->scale.y()};
    }
    // An image that turns all the time: what is forgotten here is found again by its content.
    constexpr std::size_t kMostPlacings = 8;
    if (known.mapped.size() > kMostPlacings) known.mapped.clear();
    for (auto& [placed, found] : known.mapped)
        if (placed == placing) return found;
    return known.mapped.emplace_back(placing, nullptr).second;
}

const MeshRange* MeshBuffers::find(const DrawMesh& mesh, std::int64_t fill, const Image* normalMap) {
    if (mesh.arrays.kind != MeshKind::kTriangles || fill != Material::kFilled) normalMap = nullptr;
    std::shared_ptr<Mesh>& known = knownOf(mesh, fill, normalMap);
    if (!known || known->gone) known = findByContent(mesh, fill, normalMap);
    if (!known) return nullptr;
    clock_.use(known->uses);
    if (known->written < known->toWrite) writeOn(drawnArrays(mesh, normalMap), *known, ~std::size_t{0});
    return &known->range;
}

std::shared_ptr<MeshBuffers::Mesh> MeshBuffers::findByContent(const DrawMesh& mesh, std::int64_t fill,
                                                              const Image* normalMap) {
    if (!mesh.sound || (fill != Material::kFilled && mesh.arrays.kind != MeshKind::kTriangles)) return nullptr;
    const MeshArrays arrays = drawnArrays(mesh, normalMap);
    const Key key = keyOf(tessera::keyOf(arrays), fill);
    if (const auto known = meshes_.find(key); known != meshes_.end()) return known->second;
    std::shared_ptr<Mesh> made;
    if (fill == Material::kFilled) {
        made = takeOver(arrays);
        if (!made) made = allocate(arrays, true);
    } else {
        const MeshArrays outline = outlineOf(arrays, fill);
        made = allocate(outline, true);
        if (made) writeOn(outline, *made, ~std::size_t{0});
    }
    if (!made) return nullptr;
    if (gone_.contains(key)) made->uses = UseClock::recall(gone_, key);
    return meshes_.emplace(key, std::move(made)).first->second;
}

std::optional<std::size_t> MeshBuffers::prepare(const DrawMesh& mesh, const Image* normalMap, std::size_t bytes) {
    if (!mesh.sound) return 0;
    const MeshArrays arrays = drawnArrays(mesh, mesh.arrays.kind == MeshKind::kTriangles ? normalMap : nullptr);
    const Key key = keyOf(tessera::keyOf(arrays), Material::kFilled);
    auto it = meshes_.find(key);
    if (it == meshes_.end()) {
        // What goes on changing takes a place over when it is drawn.
        for (const MeshOrigin& origin : originsOf(arrays))
            if (meshes_.contains(keyOf(origin.key, Material::kFilled))) return 0;
        if (residentBytes() + sizeOf(arrays).bytes() > budget_.bytes) return std::nullopt;
        std::shared_ptr<Mesh> made = allocate(arrays, false);
        if (!made) return 0;
        it = meshes_.emplace(key, std::move(made)).first;
        it->second->uses.lastDraw = clock_.draw();
    }
    const std::uint64_t before = uploadedBytes_;
    if (it->second->written < it->second->toWrite) writeOn(arrays, *it->second, bytes);
    return uploadedBytes_ - before;
}

void MeshBuffers::expect(const MeshSize& more) {
    for (std::size_t i = 0; i < kMeshStores; ++i) {
        const auto store = static_cast<MeshStore>(i);
        const std::size_t all = allocatedBytes(), own = buffers_[i].ranges.capacity() * elementBytes(store);
        const std::uint64_t most =
            std::min(mostIn(store, budget_.bytes, all - own), mostIn(store, budget_.atOnce, all));
        const std::uint64_t wanted = std::min(most, buffers_[i].ranges.used() + more.elements[i]);
        if (wanted > buffers_[i].ranges.capacity()) grow(store, wanted);
    }
}

std::uint64_t MeshBuffers::mostOf(MeshStore store) const {
    const std::uint64_t most = mostBytes_ / elementBytes(store);
    return store == MeshStore::kTexels ? std::min(most, mostTexels_) : most;
}

std::uint64_t MeshBuffers::mostIn(MeshStore store, std::size_t bytes, std::size_t others) const {
    return std::min<std::uint64_t>(mostOf(store), (bytes - std::min(bytes, others)) / elementBytes(store));
}

std::shared_ptr<MeshBuffers::Mesh> MeshBuffers::allocate(const MeshArrays& arrays, bool needed) {
    const auto made = std::make_shared<Mesh>();
    Mesh& mesh = *made;
    const DrawForm& form = formOf(arrays.kind);
    for (const MeshPart& part : form.parts(arrays)) {
        // What is fetched by its number lies at a multiple of its size.
        const std::uint64_t multipleOf = part.store == MeshStore::kTexels ? part.elementsPerUnit : 1;
        if (!place(part.store, part.elements(), multipleOf, needed,
                   mesh.places[static_cast<std::size_t>(part.store)])) {
            release(mesh);
            return nullptr;
        }
        mesh.toWrite += part.units;
    }
    const MeshPart first = form.parts(arrays)[0];
    mesh.range = {.indexCount = static_cast<std::uint32_t>(
                      sizeOf(arrays).elements[static_cast<std::size_t>(MeshStore::kIndices)]),
                  .hasNormals = form.normals || !arrays.normals.empty(),
                  .hasColors = !arrays.colors.empty(),
                  .hasTangents = first.store == MeshStore::kMappedVertices,
                  .kind = form.kind,
                  .pointParts = pointPartsOf(arrays)};
    if (form.fetched) {
        const DrawForm::Fetched fetched = form.fetched(arrays);
        mesh.unitsBefore = fetched.before;
        const std::uint64_t from = firstUnitOf(mesh);
        if ((from + fetched.things) << fetched.numberBits > std::numeric_limits<std::int32_t>::max()) {
            release(mesh);
            return nullptr;
        }
        mesh.range.indexCount = static_cast<std::uint32_t>(3 * fetched.things);
        mesh.range.indicesEach = fetched.indicesEach;
        mesh.range.atOnce = fetched.atOnce;
        mesh.range.numberBits = fetched.numberBits;
        makeSharedByPoints();
    }
    setRange(mesh);
    return made;
}

void MeshBuffers::writeOn(const MeshArrays& arrays, Mesh& mesh, std::size_t bytes) {
    std::uint64_t before = 0;
    bool any = false;
    for (const MeshPart& part : formOf(mesh.range.kind).parts(arrays)) {
        const std::uint64_t end = before + part.units;
        if (mesh.written < end && (!any || bytes >= part.unitBytes())) {
            const std::uint64_t upTo =
                std::min(end, mesh.written + std::max<std::uint64_t>(1, bytes / part.unitBytes()));
            write(arrays, mesh, part, {mesh.written - before, upTo - before});
            bytes -= std::min<std::size_t>(bytes, (upTo - mesh.written) * part.unitBytes());
            mesh.written = upTo;
            any = true;
        }
        if (mesh.written < end) return;
        before = end;
    }
}

std::shared_ptr<MeshBuffers::Mesh> MeshBuffers::takeOver(const MeshArrays& arrays) {
    const DrawForm& form = formOf(arrays.kind);
    if (form.follows.empty()) return nullptr;
    for (const MeshOrigin& origin : originsOf(arrays)) {
        const auto known = meshes_.find(keyOf(origin.key, Material::kFilled));
        if (known == meshes_.end() || clock_.usedNow(known->second->uses) ||
            known->second->written < known->second->toWrite || !soundWithin(arrays, origin.changed))
            continue;
        // Whoever knows it as what it was is to find that again.
        const auto mesh = std::make_shared<Mesh>(*known->second);
        known->second->gone = true;
        meshes_.erase(known);
        for (const DrawForm::Follows& array : form.follows)
            for (const MeshPart& part : form.parts(arrays))
                if (part.store == array.store)
                    write(arrays, *mesh, part, elementsOf(origin.changed[array.array], array.bytesPerUnit));
        return mesh;
    }
    return nullptr;
}

void MeshBuffers::write(const MeshArrays& arrays, const Mesh& mesh, const MeshPart& part, const ByteRange& units) {
    if (units.empty()) return;
    std::uint64_t at = mesh.places[static_cast<std::size_t>(part.store)].first * elementBytes(part.store) +
                       units.begin * part.unitBytes();
    formOf(mesh.range.kind).write(arrays, part.store, units, [&](ByteSpan made) {
        gl_.NamedBufferSubData(buffer(part.store).name, static_cast<GLintptr>(at), static_cast<GLsizeiptr>(made.size()),
                               made.data());
        at += made.size();
        uploadedBytes_ += made.size();
    });
}

bool MeshBuffers::place(MeshStore store, std::uint64_t count, std::uint64_t multipleOf, bool needed, Place& place) {
    if (count == 0) return true;
    const std::uint64_t wanted = count + multipleOf - 1;
    const std::optional<std::uint64_t> start = roomFor(store, wanted, needed);
    if (!start) return false;
    most_.elements[static_cast<std::size_t>(store)] =
        std::max(most_.elements[static_cast<std::size_t>(store)], buffer(store).ranges.used());
    place = {.taken = *start,
             .takenCount = wanted,
             .first = (*start + multipleOf - 1) / multipleOf * multipleOf,
             .multipleOf = multipleOf};
    return true;
}

std::optional<std::uint64_t> MeshBuffers::roomFor(MeshStore store, std::uint64_t wanted, bool needed) {
    RangeAllocator& ranges = buffer(store).ranges;
    if (const auto start = ranges.allocate(wanted)) return start;
    if (wanted > mostOf(store)) return std::nullopt;
    // Twice as much, as far as the budget goes.
    const std::uint64_t old = ranges.capacity();
    const std::size_t all = allocatedBytes(), others = all - old * elementBytes(store);
    const std::uint64_t room = mostIn(store, budget_.bytes, others), easily = mostIn(store, budget_.atOnce, all);
    const std::uint64_t beyond = old + std::max(wanted, old / kLeastGrowth);
    const std::uint64_t larger =
        std::min({needed ? easily : std::min(easily, room),
                  std::max({std::min(kFirstCapacity, room), std::min(2 * old, room), beyond})});
    if (larger >= old + wanted) grow(store, larger);
    if (const auto start = ranges.allocate(wanted)) return start;
    if (!needed) return std::nullopt;
    if (const auto start = roomOfOthers(store, wanted)) return start;
    grow(store, std::min(mostIn(store, budget_.mostAtOnce, all), old + wanted));
    return ranges.allocate(wanted);
}

std::optional<std::uint64_t> MeshBuffers::roomOfOthers(MeshStore store, std::uint64_t wanted) {
    const auto i = static_cast<std::size_t>(store);
    if (byOthers_[i].draw == clock_.draw() && byOthers_[i].wanted <= wanted) return std::nullopt;
    for (const auto& candidate : clock_.unusedSoFar(meshes_)) {
        if (meshes_.find(*candidate.key)->second->places[i].takenCount == 0) continue;
        letGo(*candidate.key);
        if (const auto start = buffers_[i].ranges.allocate(wanted)) return start;
    }
    byOthers_[i] = {clock_.draw(), wanted};
    return std::nullopt;
}

void MeshBuffers::release(const Mesh& mesh) {
    for (std::size_t i = 0; i < kMeshStores; ++i)
        buffers_[i].ranges.release(mesh.places[i].taken, mesh.places[i].takenCount);
}

void MeshBuffers::grow(MeshStore store, std::uint64_t capacity) {
    Buffer& grown = buffer(store);
    const std::size_t bytesEach = elementBytes(store);
    Refused& refused = byGl_[static_cast<std::size_t>(store)];
    if (capacity <= grown.ranges.capacity() || (refused.draw == clock_.draw() && refused.wanted <= capacity)) return;
    const GLuint larger = makeBuffer(capacity * bytesEach);
    if (larger == 0) {
        refused = {clock_.draw(), capacity};
        return;
    }
    if (grown.name) {
        ++copies_;
        gl_.CopyNamedBufferSubData(grown.name, larger, 0, 0,
                                   static_cast<GLsizeiptr>(grown.ranges.capacity() * bytesEach));
        // What is written next overtakes the copy on a GPU (NVIDIA's driver 580, seen on an H100): triangles are
        // missing for as long as their mesh stays. A buffer grows by doubling, beyond the budget by an eighth, and
        // stays as large for some frames (`shrink`): this is waited for seldom.
        gl_.Finish();
        gl_.DeleteBuffers(1, &grown.name);
    }
    grown.name = larger;
    grown.ranges.grow(capacity);
    rebind();
}

void MeshBuffers::shrink() {
    MeshSize lately = most_;
    for (const MeshSize& before : mostBefore_)
        for (std::size_t i = 0; i < kMeshStores; ++i)
            lately.elements[i] = std::max(lately.elements[i], before.elements[i]);
    const std::size_t allocated = allocatedBytes(), wanted = lately.bytes(), free = allocated - wanted;
    if (allocated <= budget_.bytes || free <= wanted / kWorthIt) return;
    // Each keeps its part of what may stay free.
    const std::size_t stays = std::max(wanted / kSlack, budget_.bytes - std::min(budget_.bytes, wanted));
    const double kept = std::min(1.0, static_cast<double>(stays) / static_cast<double>(free));
    for (std::size_t i = 0; i < kMeshStores; ++i) {
        const std::uint64_t capacity = buffers_[i].ranges.capacity(), unused = capacity - lately.elements[i];
        const std::uint64_t smaller =
            lately.elements[i] + static_cast<std::uint64_t>(kept * static_cast<double>(unused));
        if (smaller < capacity) compact(static_cast<MeshStore>(i), smaller);
    }
}

GLuint MeshBuffers::makeBuffer(std::size_t bytes) {
    GLuint name = 0;
    gl_.CreateBuffers(1, &name);
    if (gl_.reserve(name, bytes)) return name;
    gl_.DeleteBuffers(1, &name);
    return 0;
}

void MeshBuffers::compact(MeshStore store, std::uint64_t capacity) {
    Buffer& from = buffer(store);
    const auto i = static_cast<std::size_t>(store);
    const std::size_t bytesEach = elementBytes(store);
    // In the order in which they lie: each moves towards the beginning, if at all.
    std::vector<Mesh*> moved;
    for (const auto& [key, mesh] : meshes_)
        if (mesh->places[i].takenCount > 0) moved.push_back(mesh.get());
    std::ranges::sort(moved, {}, [i](const Mesh* mesh) { return mesh->places[i].taken; });
    Buffer to;
    to.ranges.grow(capacity);
    if (capacity > 0 && (to.name = makeBuffer(capacity * bytesEach)) == 0) return;
    ++copies_;
    for (Mesh* mesh : moved) {
        Place& place = mesh->places[i];
        const std::optional<std::uint64_t> start = to.ranges.allocate(place.takenCount);
        TESSERA_CHECK(start, "what is taken fits where nothing lies between");
        const std::uint64_t count = place.takenCount - (place.multipleOf - 1);
        const std::uint64_t first = (*start + place.multipleOf - 1) / place.multipleOf * place.multipleOf;
        gl_.CopyNamedBufferSubData(from.name, to.name, static_cast<GLintptr>(place.first * bytesEach),
                                   static_cast<GLintptr>(first * bytesEach),
                                   static_cast<GLsizeiptr>(count * bytesEach));
        place.taken = *start;
        place.first = first;
        setRange(*mesh);
    }
    gl_.Finish();  // as in `grow`
    gl_.DeleteBuffers(1, &from.name);
    from = std::move(to);
    rebind();
}

std::uint64_t MeshBuffers::firstUnitOf(const Mesh& mesh) {
    const Place& texels = mesh.places[static_cast<std::size_t>(MeshStore::kTexels)];
    return texels.first / texels.multipleOf + mesh.unitsBefore;
}

void MeshBuffers::setRange(Mesh& mesh) {
    const auto firstOf = [&mesh](MeshStore store) { return mesh.places[static_cast<std::size_t>(store)].first; };
    MeshRange& range = mesh.range;
    range.firstIndex = static_cast<std::uint32_t>(firstOf(MeshStore::kIndices));
    range.baseVertex = static_cast<std::int32_t>(
        formOf(range.kind).fetched ? firstUnitOf(mesh) << range.numberBits
                                   : firstOf(range.hasTangents ? MeshStore::kMappedVertices : MeshStore::kVertices));
}

void MeshBuffers::rebind() {
    if (const GLuint texels = buffer(MeshStore::kTexels).name) {
        if (!pointTexture_) gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &pointTexture_);
        gl_.TextureBuffer(pointTexture_, GL_RGBA32UI, texels);
    }
    const bool mapped = buffer(MeshStore::kVertices).name == 0;
    if (const GLuint vertices = buffer(mapped ? MeshStore::kMappedVertices : MeshStore::kVertices).name)
        gl_.VertexArrayVertexBuffer(vertexArray_, 0, vertices, 0, mapped ? sizeof(MappedVertex) : sizeof(MeshVertex));
    // The vertex array may have had ones that are gone.
    verticesBound_ = elementsBound_ = 0;
}

void MeshBuffers::makeSharedByPoints() {
    if (sharedIndices_[0]) return;
    const auto fill = [this](GLuint& buffer, const auto& values) {
        gl_.CreateBuffers(1, &buffer);
        gl_.NamedBufferData(buffer, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])), values.data(),
                            GL_STATIC_DRAW);
    };
    for (const bool insides : {false, true}) fill(sharedIndices_[insides], sharedPointIndices(insides));
    fill(linearBuffer_, linearNumbers());
    gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &linearTexture_);
    gl_.TextureBuffer(linearTexture_, GL_R32F, linearBuffer_);
}

void MeshBuffers::bindFor(MeshKind kind) {
    if (!formOf(kind).fetched) return;
    gl_.BindTextureUnit(kPointUnit, pointTexture_);
    gl_.BindTextureUnit(kLinearUnit, linearTexture_);
}

void MeshBuffers::bindElements(GLuint buffer) {
    if (buffer != elementsBound_) gl_.VertexArrayElementBuffer(vertexArray_, buffer);
    elementsBound_ = buffer;
}

void MeshBuffers::bind(const MeshRange& mesh, GLuint indices) {
    const GLuint vertices = buffer(mesh.hasTangents ? MeshStore::kMappedVertices : MeshStore::kVertices).name;
    // What is fetched has none.
    if (vertices != 0 && vertices != verticesBound_) {
        gl_.VertexArrayVertexBuffer(vertexArray_, 0, vertices, 0,
                                    mesh.hasTangents ? sizeof(MappedVertex) : sizeof(MeshVertex));
        verticesBound_ = vertices;
    }
    bindElements(indices);
}

std::uint64_t MeshBuffers::draw(const MeshRange& mesh, std::size_t firstTriangle, std::size_t triangles,
                                std::size_t firstRecord, std::size_t instances, bool insides) {
    const auto issue = [this](std::size_t count, GLenum type, std::size_t offset, std::size_t times, std::int64_t base,
                              std::size_t record) {
        gl_.DrawElementsInstancedBaseVertexBaseInstance(
            GL_TRIANGLES, static_cast<GLsizei>(count), type, reinterpret_cast<const void*>(offset),
            static_cast<GLsizei>(times), static_cast<GLint>(base), static_cast<GLuint>(record));
    };
    if (!formOf(mesh.kind).fetched) {
        bind(mesh, indexBuffer());
        issue(3 * triangles, GL_UNSIGNED_INT, (mesh.firstIndex + 3 * firstTriangle) * sizeof(std::uint32_t), instances,
              mesh.baseVertex, firstRecord);
        return 1;
    }
    if (mesh.atOnce > 0) {
        bind(mesh, indexBuffer());
        std::uint64_t calls = 0;
        // One instance after the other, whole: as they are drawn one by one.
        const std::size_t together = triangles <= mesh.atOnce ? std::max<std::size_t>(instances, 1) : 1;
        for (std::size_t i = 0; i < instances; i += together)
            for (std::size_t k = 0; k < triangles; k += mesh.atOnce, ++calls)
                issue(std::min<std::size_t>(mesh.atOnce, triangles - k) * mesh.indicesEach, GL_UNSIGNED_INT,
                      std::size_t{mesh.firstIndex} * sizeof(std::uint32_t), together,
                      mesh.baseVertex + static_cast<std::int64_t>((firstTriangle + k) << mesh.numberBits),
                      firstRecord + i);
        return calls;
    }
    bind(mesh, sharedIndices_[insides]);
    const std::uint64_t points = mesh.indexCount / kIndicesPerPoint, indicesEach = kIndicesPerPoint * (insides ? 2 : 1);
    if (points <= kPointsAtOnce) {
        issue(points * indicesEach, GL_UNSIGNED_SHORT, 0, instances, mesh.baseVertex, firstRecord);
        return 1;
    }
    // One instance after the other, whole: as they are drawn one by one.
    std::uint64_t calls = 0;
    for (std::size_t i = 0; i < instances; ++i)
        for (std::uint64_t first = 0; first < points; first += kPointsAtOnce, ++calls)
            issue(indicesEach * std::min<std::uint64_t>(kPointsAtOnce, points - first), GL_UNSIGNED_SHORT, 0, 1,
                  mesh.baseVertex + static_cast<std::int64_t>(kNumbersPerPoint * first), firstRecord + i);
    return calls;
}

}  // namespace tessera
