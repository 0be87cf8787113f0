#include "client/draw/store/VolumeTextures.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "common/drawable/VolumeShapes.h"
#include "common/wall/Detail.h"

namespace tessera {
namespace {

/// What GL makes of a voxel's bits is value = read · scale + offset.
struct VoxelTexels {
    GLenum internal, type;
    double scale, offset;
};
VoxelTexels texelsOf(std::int64_t format) {
    switch (format) {
        case Volume::kUint8:
            return {GL_R8, GL_UNSIGNED_BYTE, 255, 0};
        case Volume::kUint16:
            return {GL_R16, GL_UNSIGNED_SHORT, 65535, 0};
        case Volume::kInt16:
            return {GL_R16, GL_UNSIGNED_SHORT, 65535, -32768};
        default:
            return {GL_R32F, GL_FLOAT, 1, 0};
    }
}

std::size_t layerBytes(const Volume& v) {
    return bytesOf(static_cast<VoxelFormat>(v.format)) * static_cast<std::size_t>(v.sizeX * v.sizeY);
}

/// Stops, at least two.
std::size_t stopsOf(const Volume& v) {
    return v.transfer.empty() ? 2 : std::max<std::size_t>(2, v.transfer.sizeBytes() / 4);
}

float finite(double v) {
    constexpr double kMost = 1e30;
    return std::isfinite(v) ? static_cast<float>(std::clamp(v, -kMost, kMost)) : v < 0 ? -1e30f : 1e30f;
}

std::array<float, 4> rowOf(const Affine3d& m, int row) {
    return {finite(m(row, 0)), finite(m(row, 1)), finite(m(row, 2)), finite(m(row, 3))};
}

/// As GL reads voxels, and a little more: whatever filtering rounds to.
std::vector<float> greatestRead(const VolumeBricks& bricks, const Volume& v, bool known) {
    const VoxelTexels texels = texelsOf(v.format);
    std::vector<float> greatest;
    for (std::size_t i = 0; i < bricks.greatest().size(); ++i) {
        const double least = (static_cast<double>(bricks.least()[i]) - texels.offset) / texels.scale;
        const double most = (static_cast<double>(bricks.greatest()[i]) - texels.offset) / texels.scale;
        greatest.push_back(known ? finite(most + 1e-6 * std::max(std::abs(least), std::abs(most))) : 3e38f);
    }
    return greatest;
}

}  // namespace

std::uint8_t marchOf(const Volume& v) {
    return v.mode == Volume::kMaximum ? kMarchMaximum : v.shaded ? kMarchShaded : kMarchCloud;
}

std::optional<VolumeBlock> blockOf(const Volume& v, const DrawItem& item, const ScreenCamera& camera,
                                   std::size_t firstTransferTexel) {
    const Affine3d eye_T_node = camera.eye_T_world * item.world_T_item;
    const Affine3d node_T_eye = eye_T_node.inverse();
    if (!eye_T_node.matrix().allFinite() || !node_T_eye.matrix().allFinite()) return std::nullopt;
    VolumeBlock block{};
    Affine3d steps_T_eye = node_T_eye;
    steps_T_eye.pretranslate(-v.origin);
    steps_T_eye.prescale(v.spacing.cwiseInverse());
    for (int row = 0; row < 3; ++row) {
        block.steps_T_eye[static_cast<std::size_t>(row)] = rowOf(steps_T_eye, row);
        block.node_T_eye[static_cast<std::size_t>(row)] = rowOf(node_T_eye, row);
    }
    const std::array<double, 3> sizes = {static_cast<double>(v.sizeX), static_cast<double>(v.sizeY),
                                         static_cast<double>(v.sizeZ)};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        block.last[axis] = static_cast<float>(sizes[axis] - 1);
        block.texel[axis] = static_cast<float>(1 / sizes[axis]);
    }
    const VoxelTexels texels = texelsOf(v.format);
    const double places = static_cast<double>(stopsOf(v) - 1), perValue = places / (v.high - v.low);
    block.toTable = {finite(texels.scale * perValue), finite((texels.offset - v.low) * perValue),
                     static_cast<float>(places), static_cast<float>(firstTransferTexel)};
    const double diagonal = boxOf(v).size().norm();
    const double step = v.step * detailStep(camera.detail).coarser * v.spacing.minCoeff();
    block.march = {finite(std::max(step, diagonal / kMostMarchSamples)), finite(1 / v.thickness), 0, 0};
    const std::span<const double> planes = v.clipPlanes.as<double>();
    const std::size_t count = std::min(planes.size() / 4, kMostVolumePlanes);
    for (std::size_t i = 0; i < count; ++i) {
        const Vec3d n(planes[4 * i], planes[4 * i + 1], planes[4 * i + 2]);
        const double size = n.norm();
        const Eigen::RowVector4d inEye =
            (Eigen::RowVector4d() << n.transpose() / size, -planes[4 * i + 3] / size).finished() * node_T_eye.matrix();
        for (int k = 0; k < 4; ++k) block.clips[i][static_cast<std::size_t>(k)] = finite(inEye[k]);
    }
    // A loop goes round once.
    if (count == 0) block.clips[0] = {0, 0, 0, -1};
    block.last[3] = static_cast<float>(std::max<std::size_t>(count, 1));
    return block;
}

VolumeTextures::VolumeTextures(GlState& gl, const UseClock& clock, bool leaveOutEmpty)
    : gl_(gl), clock_(clock), leaveOutEmpty_(leaveOutEmpty) {
    gl_.GetIntegerv(GL_MAX_3D_TEXTURE_SIZE, &mostPx_);
}

VolumeTextures::~VolumeTextures() {
    for (auto& [key, texture] : textures_) drop(texture);
    if (transferTexture_) gl_.DeleteTextures(1, &transferTexture_);
    for (const GLuint* buffer : {&transferBuffer_, &blockBuffer_})
        if (*buffer) gl_.DeleteBuffers(1, buffer);
}

void VolumeTextures::drop(Texture& texture) {
    bytes_ -= texture.bytes;
    gl_.DeleteTextures(1, &texture.name);
    for (const BrickTexture& bricks : texture.brickTextures) gl_.DeleteTextures(1, &bricks.name);
    texture.brickTextures.clear();
}

void VolumeTextures::addSpares(std::vector<UseClock::Spare>& spares) {
    clock_.addSpares(textures_, spares, [this](const Key& key) {
        const auto it = textures_.find(key);
        clock_.remember(gone_, key, it->second.uses);
        drop(it->second);
        textures_.erase(it);
    });
}

bool VolumeTextures::canBeShown(const Volume& v) const {
    if (!v.voxels.resident() || std::max({v.sizeX, v.sizeY, v.sizeZ}) > mostPx_ ||
        std::min({v.sizeX, v.sizeY, v.sizeZ}) < 2)
        return false;
    return v.voxels.sizeBytes() == layerBytes(v) * static_cast<std::size_t>(v.sizeZ);
}

VolumeTextures::Found VolumeTextures::find(const Volume& v) {
    if (!canBeShown(v)) return {};
    Texture& texture = textureOf(v);
    fill(texture, v, v.voxels.sizeBytes());
    clock_.use(texture.uses);
    return {texture.name, v.mode == Volume::kSlices ? 0 : bricksOf(texture, v)};
}

std::optional<std::size_t> VolumeTextures::prepare(const Volume& v, std::size_t bytes) {
    if (!canBeShown(v)) return 0;
    const auto known = textures_.find(keyOf(v));
    if (known != textures_.end() && known->second.layers == v.sizeZ) return 0;
    if (known == textures_.end() && bytes_ + v.voxels.sizeBytes() > budgetBytes_) return std::nullopt;
    Texture& texture = textureOf(v);
    texture.uses.lastDraw = clock_.draw();
    const std::size_t uploaded = fill(texture, v, bytes);
    if (texture.layers == v.sizeZ && v.mode != Volume::kSlices) (void)bricksOf(texture, v);
    return uploaded;
}

VolumeTextures::Texture& VolumeTextures::textureOf(const Volume& v) {
    const Key key = keyOf(v);
    if (const auto known = textures_.find(key); known != textures_.end()) return known->second;
    if (takeOver(key, v)) return textures_.find(key)->second;
    Texture texture{
        .bytes = v.voxels.sizeBytes(), .uses = UseClock::recall(gone_, key), .bricks = {}, .brickTextures = {}};
    gl_.CreateTextures(GL_TEXTURE_3D, 1, &texture.name);
    gl_.TextureStorage3D(texture.name, 1, texelsOf(v.format).internal, static_cast<GLsizei>(v.sizeX),
                         static_cast<GLsizei>(v.sizeY), static_cast<GLsizei>(v.sizeZ));
    gl_.TextureParameteri(texture.name, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.TextureParameteri(texture.name, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    // Never beyond the outermost middles; but a texture that is clamped to its edges llvmpipe filters in eighths of a
    // byte's steps.
    for (const GLenum wrap : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T, GL_TEXTURE_WRAP_R})
        gl_.TextureParameteri(texture.name, wrap, GL_MIRROR_CLAMP_TO_EDGE);
    bytes_ += texture.bytes;
    return textures_.emplace(key, std::move(texture)).first->second;
}

std::size_t VolumeTextures::fill(Texture& texture, const Volume& v, std::size_t bytes) {
    if (texture.layers == v.sizeZ) return 0;
    const std::int64_t first = texture.layers;
    texture.layers =
        std::min(v.sizeZ, first + std::max<std::int64_t>(1, static_cast<std::int64_t>(bytes / layerBytes(v))));
    write(texture.name, v, first, texture.layers);
    if (texture.layers == v.sizeZ) texture.bricks = VolumeBricks(v);
    return static_cast<std::size_t>(texture.layers - first) * layerBytes(v);
}

GLuint VolumeTextures::bricksOf(Texture& texture, const Volume& v) {
    const bool maximum = v.mode == Volume::kMaximum;
    const auto bits = [](double number) { return std::bit_cast<std::uint64_t>(number); };
    const std::array<Hash128, 3> parts{Hash128{maximum, 0}, maximum ? Hash128{} : Hash128{bits(v.low), bits(v.high)},
                                       maximum ? Hash128{} : v.transfer.id()};
    const Hash128 of = hash128(std::as_bytes(std::span(parts)));
    auto known = std::ranges::find(texture.brickTextures, of, &BrickTexture::of);
    if (known == texture.brickTextures.end()) {
        // One of a transfer function that nobody has any more.
        std::erase_if(texture.brickTextures, [&](const BrickTexture& other) {
            const bool unused = other.lastDraw + 2 < clock_.draw();
            if (unused) gl_.DeleteTextures(1, &other.name);
            return unused;
        });
        known = texture.brickTextures.insert(texture.brickTextures.end(), {.of = of});
        const std::array<std::int64_t, 3>& counts = texture.bricks.counts();
        const std::int64_t nx = counts[0], ny = counts[1], nz = counts[2];
        gl_.CreateTextures(GL_TEXTURE_3D, 1, &known->name);
        gl_.TextureStorage3D(known->name, 1, maximum ? GL_R32F : GL_R8UI, static_cast<GLsizei>(nx),
                             static_cast<GLsizei>(ny), static_cast<GLsizei>(nz));
        for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
            gl_.TextureParameteri(known->name, filter, GL_NEAREST);
        const GlState::Pixels bytes(gl_, {.unpackBytes = true});
        const auto tell = [&](GLenum format, GLenum type, const void* numbers) {
            gl_.TextureSubImage3D(known->name, 0, 0, 0, 0, static_cast<GLsizei>(nx), static_cast<GLsizei>(ny),
                                  static_cast<GLsizei>(nz), format, type, numbers);
        };
        if (maximum)
            tell(GL_RED, GL_FLOAT, greatestRead(texture.bricks, v, leaveOutEmpty_).data());
        else
            tell(GL_RED_INTEGER, GL_UNSIGNED_BYTE,
                 (leaveOutEmpty_ ? texture.bricks.emptySteps(v)
                                 : std::vector<std::uint8_t>(texture.bricks.greatest().size()))
                     .data());
    }
    known->lastDraw = clock_.draw();
    return known->name;
}

bool VolumeTextures::takeOver(const Key& key, const Volume& v) {
    const std::uint64_t layer = layerBytes(v);
    for (const Blob::Origin& origin : v.voxels.origins()) {
        Key earlier = key;
        earlier.voxels = origin.id;
        const auto known = textures_.find(earlier);
        if (known == textures_.end() || clock_.usedNow(known->second.uses) || known->second.layers < v.sizeZ) continue;
        auto texture = textures_.extract(known);
        texture.key() = key;
        const auto first = static_cast<std::int64_t>(origin.begin / layer),
                   end = static_cast<std::int64_t>((origin.end + layer - 1) / layer);
        write(texture.mapped().name, v, first, end);
        texture.mapped().bricks.update(v, first, end);
        for (const BrickTexture& bricks : texture.mapped().brickTextures) gl_.DeleteTextures(1, &bricks.name);
        texture.mapped().brickTextures.clear();
        textures_.insert(std::move(texture));
        return true;
    }
    return false;
}

void VolumeTextures::write(GLuint texture, const Volume& v, std::int64_t first, std::int64_t end) {
    const auto texels = texelsOf(v.format);
    const std::size_t layer = layerBytes(v);
    std::vector<std::uint16_t> shifted;
    const GlState::Pixels rows(gl_, {.unpackBytes = true});
    for (std::int64_t z = first; z < end; ++z) {
        ByteSpan bytes = v.voxels.bytes().subspan(static_cast<std::size_t>(z) * layer, layer);
        if (v.format == Volume::kInt16) {
            const std::span<const std::uint16_t> numbers =
                v.voxels.as<std::uint16_t>().subspan(static_cast<std::size_t>(z) * layer / 2, layer / 2);
            shifted.assign(numbers.begin(), numbers.end());
            for (std::uint16_t& number : shifted) number = static_cast<std::uint16_t>(number ^ 0x8000u);
            bytes = std::as_bytes(std::span(shifted));
        }
        gl_.TextureSubImage3D(texture, 0, 0, 0, static_cast<GLint>(z), static_cast<GLsizei>(v.sizeX),
                              static_cast<GLsizei>(v.sizeY), 1, GL_RED, texels.type, bytes.data());
        uploadedBytes_ += layer;
    }
}

std::size_t VolumeTextures::addTransfer(const Volume& v) {
    const std::size_t first = transfer_.size();
    const std::span<const std::uint32_t> stops = v.transfer.as<std::uint32_t>();
    if (stops.empty())
        transfer_.insert(transfer_.end(), {0u, 0xffffffffu});
    else
        transfer_.insert(transfer_.end(), stops.begin(), stops.end());
    if (stops.size() == 1) transfer_.push_back(stops[0]);
    return first;
}

void VolumeTextures::upload(const std::vector<VolumeBlock>& blocks) {
    if (blocks.empty()) return;
    if (!transferBuffer_) {
        gl_.CreateBuffers(1, &transferBuffer_);
        gl_.CreateBuffers(1, &blockBuffer_);
        gl_.CreateTextures(GL_TEXTURE_BUFFER, 1, &transferTexture_);
    }
    gl_.NamedBufferData(blockBuffer_, static_cast<GLsizeiptr>(blocks.size() * sizeof(VolumeBlock)), blocks.data(),
                        GL_STREAM_DRAW);
    gl_.NamedBufferData(transferBuffer_, static_cast<GLsizeiptr>(transfer_.size() * sizeof(std::uint32_t)),
                        transfer_.data(), GL_STREAM_DRAW);
    gl_.TextureBuffer(transferTexture_, GL_RGBA8, transferBuffer_);
}

void VolumeTextures::bind(const Found& textures, std::size_t block) const {
    gl_.BindTextureUnit(kVoxelUnit, textures.voxels);
    if (textures.bricks != 0) gl_.BindTextureUnit(kBrickUnit, textures.bricks);
    gl_.BindTextureUnit(kTransferUnit, transferTexture_);
    gl_.BindBufferRange(GL_UNIFORM_BUFFER, kVolumeBinding, blockBuffer_,
                        static_cast<GLintptr>(block * sizeof(VolumeBlock)), sizeof(VolumeBlock));
}

}  // namespace tessera
