#include "client/output/OutputMaker.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "client/output/StereoPack.h"
#include "common/output/BlendPicture.h"
#include "common/wall/WindowLayout.h"

namespace tessera {
namespace {

bool sharesOutput(const Tile& tile, const std::vector<Tile>& tiles) {
    return tile.eye == Eye::kRight && partnerOf(tile, tiles);
}

}  // namespace

std::vector<Tile> outputsOf(const Wall& wall, const std::vector<Tile>& tiles) {
    const std::vector<Tile> all = layoutTiles(wall);
    std::vector<Tile> outputs;
    for (const Tile& tile : tiles)
        if (!sharesOutput(tile, all)) outputs.push_back(tile);
    return outputs;
}

Expected<OutputMaker> OutputMaker::make(const Wall& wall, const std::string& name) {
    const std::vector<Tile> all = layoutTiles(wall);
    const auto at = std::ranges::find_if(all, [&](const Tile& t) { return t.name == name; });
    if (at == all.end()) return fail(ErrorCode::kNotFound, fmt::format("the wall has no tile {}", name));
    if (sharesOutput(*at, all))
        return fail(ErrorCode::kNotFound,
                    fmt::format("tile {} has no output of its own: it goes out with the left eye's", name));
    const Tile& tile = *at;
    const TileOutput& out = tile.output;
    OutputMaker maker;
    maker.tiles_ = {tile.name};
    maker.packing_ = out.stereo;
    maker.swapEyes_ = out.swapEyes;
    if (out.stereo != StereoPacking::kNone) {
        const Tile* const right = partnerOf(tile, all);
        TESSERA_CHECK(right, "an output for two eyes without the right one: checkWall was not called");
        maker.tiles_.push_back(right->name);
    }
    maker.fromWidthPx_ = tile.rect.width;
    maker.fromHeightPx_ = tile.rect.height;
    maker.eyeWidthPx_ = out.widthPx > 0 ? out.widthPx : tile.rect.width;
    maker.eyeHeightPx_ = out.heightPx > 0 ? out.heightPx : tile.rect.height;
    const PackedSize packed = packedSize(out.stereo, maker.eyeWidthPx_, maker.eyeHeightPx_);
    maker.widthPx_ = packed.widthPx;
    maker.heightPx_ = packed.heightPx;

    TileOutput untouched;
    untouched.monitor = out.monitor;
    untouched.stereo = out.stereo;
    untouched.swapEyes = out.swapEyes;
    if (out == untouched) return maker;

    OutputTable::Options table{.fromWidthPx = tile.rect.width,
                               .fromHeightPx = tile.rect.height,
                               .widthPx = maker.eyeWidthPx_,
                               .heightPx = maker.eyeHeightPx_,
                               .warp = out.warp.get(),
                               .share = nullptr,
                               .part = nullptr,
                               .lift = {},
                               .black = out.black,
                               .gain = out.gain,
                               .gamma = out.gamma,
                               .flipX = out.flipX,
                               .flipY = out.flipY};
    const TileOverlaps overlaps = overlapsOf(*wall.findScreen(tile.screen), tile.column, tile.row);
    BlendPicture picture;
    if (out.blendPicture) {
        auto decoded = decodeBlendPicture(*out.blendPicture);
        if (!decoded) return failWith(out.blendFile, decoded.error());
        picture = std::move(*decoded);
        table.share = [&picture, gamma = out.blendPictureGamma](double, double, double u, double v) {
            return std::pow(picture.at(u, v), gamma);
        };
    }
    if (out.blend) table.share = [&overlaps](double x, double y, double, double) { return overlaps.shareAt(x, y); };
    if (out.blend || out.blendPicture) {
        table.lift = blackLiftOf(wall, tile);
        table.part = [&overlaps](double x, double y) { return overlaps.partAt(x, y); };
    }
    maker.table_.emplace(table);
    return maker;
}

const std::uint8_t* OutputMaker::tabled(const std::uint8_t* picture, std::vector<std::uint8_t>& room) const {
    if (!table_) return picture;
    const std::size_t pitch = 4 * static_cast<std::size_t>(eyeWidthPx_);
    room.resize(pitch * static_cast<std::size_t>(eyeHeightPx_));
    table_->draw(picture, {room.data(), pitch});
    return room.data();
}

const std::uint8_t* OutputMaker::draw(std::span<const std::uint8_t* const> pictures) {
    TESSERA_CHECK(pictures.size() == tiles_.size(), "an output takes a picture of each of its tiles");
    if (packing_ == StereoPacking::kNone) return tabled(pictures[0], eyes_[0]);
    const std::uint8_t* left = pictures[swapEyes_ ? 1 : 0];
    const std::uint8_t* right = pictures[swapEyes_ ? 0 : 1];
    if (mixesColours(packing_)) {
        const std::size_t pitch = 4 * static_cast<std::size_t>(fromWidthPx_);
        packed_.resize(pitch * static_cast<std::size_t>(fromHeightPx_));
        packEyes(packing_, {left, right, fromWidthPx_, fromHeightPx_}, {packed_.data(), pitch});
        return tabled(packed_.data(), eyes_[0]);
    }
    left = tabled(left, eyes_[0]);
    right = tabled(right, eyes_[1]);
    const std::size_t pitch = 4 * static_cast<std::size_t>(widthPx_);
    packed_.resize(pitch * static_cast<std::size_t>(heightPx_));
    packEyes(packing_, {left, right, eyeWidthPx_, eyeHeightPx_}, {packed_.data(), pitch});
    return packed_.data();
}

}  // namespace tessera
