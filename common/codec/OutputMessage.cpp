#include "common/codec/OutputMessage.h"

#include <fmt/format.h>

#include <bit>
#include <cstring>

#include "common/output/MeshFile.h"

namespace tessera {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers travel as they lie in memory");
static_assert(sizeof(WarpNode) == 5 * sizeof(float));

constexpr std::size_t kMaxMeshText = std::size_t{32} << 20;

Expected<std::shared_ptr<const WarpMesh>> meshOf(const std::string& bytes) {
    WarpMesh mesh;
    std::int32_t sides[2] = {};
    if (bytes.size() < sizeof sides) return fail(ErrorCode::kBadInput, "warp_mesh is cut short");
    std::memcpy(sides, bytes.data(), sizeof sides);
    const OutputLimits limits;
    const bool good = sides[0] > 0 && sides[1] > 0 && sides[0] <= limits.maxWarpSide && sides[1] <= limits.maxWarpSide;
    const std::size_t count = good ? static_cast<std::size_t>(sides[0]) * static_cast<std::size_t>(sides[1]) : 0;
    if (!good || bytes.size() != sizeof sides + count * sizeof(WarpNode))
        return fail(ErrorCode::kBadInput,
                    fmt::format("warp_mesh says {} x {} nodes and has {} bytes", sides[0], sides[1], bytes.size()));
    mesh.columns = sides[0];
    mesh.rows = sides[1];
    mesh.nodes.resize(count);
    std::memcpy(mesh.nodes.data(), bytes.data() + sizeof sides, count * sizeof(WarpNode));
    return std::make_shared<const WarpMesh>(std::move(mesh));
}

ChannelValues channelsOf(const proto::Wall::Output::Channels& from, ChannelValues absent) {
    if (from.has_r()) absent[0] = from.r();
    if (from.has_g()) absent[1] = from.g();
    if (from.has_b()) absent[2] = from.b();
    return absent;
}

void putChannels(const ChannelValues& from, proto::Wall::Output::Channels& to) {
    to.set_r(from[0]);
    to.set_g(from[1]);
    to.set_b(from[2]);
}

Expected<Bytes> fileOf(const WallFiles& files, const std::string& name, std::size_t atMost) {
    if (files) return files(name, atMost);
    return fail(ErrorCode::kNotFound,
                fmt::format("the wall names the file \"{}\" and does not come from a file itself", name));
}

}  // namespace

Expected<TileOutput> outputOf(const proto::Wall::Output& message, int tileWidthPx, int tileHeightPx,
                              const WallFiles& files) {
    TileOutput out;
    // Enumerations are open in proto3: a number may stand for nothing.
    if (!proto::Wall::Output::Stereo_IsValid(message.stereo()))
        return fail(ErrorCode::kBadInput, fmt::format("stereo cannot be {}", static_cast<int>(message.stereo())));
    out.monitor = message.monitor();
    out.widthPx = message.width_px();
    out.heightPx = message.height_px();
    out.stereo = static_cast<StereoPacking>(message.stereo());
    out.swapEyes = message.swap_eyes();
    out.warpFile = message.warp();
    out.blendFile = message.blend_picture();
    out.blend = message.blend();
    if (message.has_blend_picture_gamma()) out.blendPictureGamma = message.blend_picture_gamma();
    out.gain = channelsOf(message.gain(), out.gain);
    out.gamma = channelsOf(message.gamma(), out.gamma);
    out.black = message.black();
    out.flipX = message.flip_x();
    out.flipY = message.flip_y();
    if (!message.warp_mesh().empty()) {
        auto mesh = meshOf(message.warp_mesh());
        if (!mesh) return tl::unexpected(mesh.error());
        out.warp = std::move(*mesh);
    } else if (!out.warpFile.empty()) {
        auto text = fileOf(files, out.warpFile, kMaxMeshText);
        if (!text) return tl::unexpected(text.error());
        const double width = out.widthPx > 0 ? out.widthPx : tileWidthPx,
                     height = out.heightPx > 0 ? out.heightPx : tileHeightPx;
        auto mesh = readMesh(asText(*text), out.warpFile, width / std::max(1.0, height));
        if (!mesh) return tl::unexpected(mesh.error());
        out.warp = std::make_shared<const WarpMesh>(std::move(*mesh));
    }
    if (!message.blend_png().empty()) {
        const ByteSpan bytes = asBytes(message.blend_png());
        out.blendPicture = share(Bytes(bytes.begin(), bytes.end()));
    } else if (!out.blendFile.empty()) {
        auto png = fileOf(files, out.blendFile, OutputLimits().maxBlendBytes);
        if (!png) return tl::unexpected(png.error());
        out.blendPicture = share(std::move(*png));
    }
    return out;
}

void putOutput(const TileOutput& output, proto::Wall::Output& message) {
    message.set_monitor(output.monitor);
    message.set_width_px(output.widthPx);
    message.set_height_px(output.heightPx);
    message.set_stereo(static_cast<proto::Wall::Output::Stereo>(output.stereo));
    message.set_swap_eyes(output.swapEyes);
    message.set_warp(output.warpFile);
    message.set_blend_picture(output.blendFile);
    message.set_blend(output.blend);
    message.set_blend_picture_gamma(output.blendPictureGamma);
    putChannels(output.gain, *message.mutable_gain());
    putChannels(output.gamma, *message.mutable_gamma());
    message.set_black(output.black);
    message.set_flip_x(output.flipX);
    message.set_flip_y(output.flipY);
    if (output.warp) {
        const std::int32_t sides[2] = {output.warp->columns, output.warp->rows};
        std::string& bytes = *message.mutable_warp_mesh();
        bytes.assign(reinterpret_cast<const char*>(sides), sizeof sides);
        bytes.append(reinterpret_cast<const char*>(output.warp->nodes.data()),
                     output.warp->nodes.size() * sizeof(WarpNode));
    }
    if (output.blendPicture) *message.mutable_blend_png() = std::string(asText(*output.blendPicture));
}

}  // namespace tessera
