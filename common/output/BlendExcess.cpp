#include "common/output/BlendExcess.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/output/BlendPicture.h"
#include "common/output/MeshLook.h"

namespace tessera {
namespace {

constexpr double kMostPerPixel = 1.02, kMostPerSquare = 1.05;
constexpr int kSquarePx = 16;
/// Above it squares are looked at too.
constexpr std::int64_t kMostPixels = std::int64_t{1} << 26;

/// What a screen's tiles add up to, in squares of some pixels.
class LightSums {
public:
    LightSums(const Screen& screen, int squarePx)
        : squarePx_(squarePx),
          screenHeight_(screenPixels(screen).height),
          columns_((screenPixels(screen).width + squarePx - 1) / squarePx),
          sums_(static_cast<std::size_t>(columns_) *
                static_cast<std::size_t>((screenHeight_ + squarePx - 1) / squarePx)),
          means_(sums_.size()) {}

    /// Of the tile that comes next: a place on the screen (from its upper left corner) and its share of light.
    void add(double x, double y, double share) {
        if (x < 0 || y < 0) return;
        const std::size_t at = static_cast<std::size_t>(y / squarePx_) * static_cast<std::size_t>(columns_) +
                               static_cast<std::size_t>(x / squarePx_);
        if (x / squarePx_ >= columns_ || at >= means_.size()) return;
        means_[at].sum += static_cast<float>(share);
        ++means_[at].count;
    }
    /// The tile is over. The largest of the sums that it has a part in.
    struct Largest {
        double sum = 0;
        int x = 0, y = 0;  ///< the middle of that square
    };
    Largest endTile() {
        Largest largest;
        for (std::size_t i = 0; i < means_.size(); ++i) {
            if (means_[i].count == 0) continue;
            sums_[i] += means_[i].sum / static_cast<float>(means_[i].count);
            means_[i] = {};
            if (sums_[i] <= largest.sum) continue;
            const int column = static_cast<int>(i % static_cast<std::size_t>(columns_)),
                      row = static_cast<int>(i / static_cast<std::size_t>(columns_));
            largest = {sums_[i], column * squarePx_ + squarePx_ / 2, row * squarePx_ + squarePx_ / 2};
        }
        return largest;
    }

private:
    struct Mean {
        float sum = 0;
        std::uint32_t count = 0;
    };
    int squarePx_, screenHeight_, columns_;
    std::vector<float> sums_;
    std::vector<Mean> means_;
};

int sideOr(int given, int tiles) {
    return given > 0 ? given : tiles;
}

}  // namespace

std::optional<OutputFault> findBlendExcess(const Wall& wall) {
    const std::vector<Tile> tiles = layoutTiles(wall);
    for (const Screen& screen : wall.screens) {
        for (const Eye eye : {Eye::kCenter, Eye::kLeft, Eye::kRight}) {
            const auto ours = [&](const Tile& t) {
                return t.screen == screen.name && t.eye == eye && t.output.blendPicture;
            };
            if (std::ranges::none_of(tiles, ours)) continue;
            const bool bent = std::ranges::any_of(
                tiles, [&](const Tile& t) { return ours(t) && (t.output.warp || t.output.widthPx > 0); });
            const ScreenPixels size = screenPixels(screen);
            const bool vast = std::int64_t{size.width} * size.height > kMostPixels;
            LightSums sums(screen, bent || vast ? kSquarePx : 1);
            std::size_t index = 0;
            for (std::size_t h = 0; h < wall.hosts.size(); ++h) {
                for (std::size_t t = 0; t < wall.hosts[h].tiles.size(); ++t, ++index) {
                    const Tile& tile = tiles[index];
                    if (!ours(tile)) continue;
                    const auto picture = decodeBlendPicture(*tile.output.blendPicture);
                    if (!picture)
                        return OutputFault{h, t,
                                           fmt::format("the blend picture \"{}\": {}", tile.output.blendFile,
                                                       picture.error().message)};
                    const int left = tile.rect.x, top = screenPixels(screen).height - tile.rect.y - tile.rect.height;
                    const int width = sideOr(tile.output.widthPx, tile.rect.width),
                              height = sideOr(tile.output.heightPx, tile.rect.height);
                    const auto see = [&](int x, int y, const Look& look) {
                        if (look.u < 0 || look.v < 0 || look.u >= 1 || look.v >= 1) return;
                        const double value = picture->at((x + 0.5) / width, (y + 0.5) / height);
                        const double gamma = tile.output.blendPictureGamma;
                        sums.add(left + look.u * tile.rect.width, top + look.v * tile.rect.height,
                                 (gamma == 1 ? value : std::pow(value, gamma)) * look.intensity);
                    };
                    if (tile.output.warp) {
                        lookThrough(*tile.output.warp, width, height, see);
                    } else {
                        for (int y = 0; y < height; ++y)
                            for (int x = 0; x < width; ++x) see(x, y, Look{(x + 0.5) / width, (y + 0.5) / height, 1});
                    }
                    const LightSums::Largest largest = sums.endTile();
                    if (largest.sum <= (bent ? kMostPerSquare : kMostPerPixel)) continue;
                    return OutputFault{
                        h, t,
                        fmt::format("the blend pictures of screen \"{}\" add up to {:.3f} of the light at column {} "
                                    "row {} of tile {} (pixels from its "
                                    "upper left corner): at most 1 is possible",
                                    screen.name, largest.sum, largest.x - left, largest.y - top, tile.name)};
                }
            }
        }
    }
    return std::nullopt;
}

}  // namespace tessera
