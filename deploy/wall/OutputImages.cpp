#include "deploy/wall/OutputImages.h"

#include <fmt/format.h>

#include <filesystem>
#include <regex>
#include <vector>

#include "client/output/OutputMaker.h"

namespace tessera {
namespace {

std::string pathOf(const std::string& folder, const Tile& tile) {
    return fmt::format("{}/{}.png", folder, tile.name);
}

std::vector<std::uint8_t> withRoom(const Picture& picture) {
    std::vector<std::uint8_t> rgbx;
    rgbx.reserve(picture.rgb.size() / 3 * 4);
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
        rgbx.insert(rgbx.end(), {picture.rgb[i], picture.rgb[i + 1], picture.rgb[i + 2], 255});
    return rgbx;
}

}  // namespace

Expected<void> clearOutputImages(const std::string& folder) {
    // SCREEN-COLUMN-ROW, with an eye where there are two: of this wall or of another one.
    static const std::regex kTileName(".+-[0-9]+-[0-9]+(-left|-right)?\\.png");
    std::error_code error;
    std::vector<std::filesystem::path> old;
    for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end; it.increment(error))
        if (std::regex_match(it->path().filename().string(), kTileName)) old.push_back(it->path());
    for (const std::filesystem::path& path : old) {
        std::filesystem::remove(path, error);
        if (error)
            return fail(ErrorCode::kFailed, fmt::format("{}: cannot be removed: {}", path.string(), error.message()));
    }
    return {};
}

Expected<void> writeOutputImages(const std::string& folder, const Wall& wall, const LastImageOf& imageOf,
                                 Console& console) {
    for (const Tile& tile : outputsOf(wall, layoutTiles(wall))) {
        Expected<OutputMaker> maker = OutputMaker::make(wall, tile.name);
        if (!maker) return failWith("the output of tile " + tile.name, maker.error());
        std::vector<std::vector<std::uint8_t>> pictures;
        std::vector<const std::uint8_t*> starts;
        std::optional<std::uint64_t> frame;
        std::string missing;
        for (const std::string& name : maker->tiles()) {
            const std::optional<TileImages::Image>& image = imageOf(name);
            if (!image)
                missing = "tile " + name + " has shown nothing";
            else if (image->picture.widthPx != maker->fromWidthPx() || image->picture.heightPx != maker->fromHeightPx())
                missing = "the image of tile " + name + " has not its tile's size";
            else if (frame && *frame != image->frame)
                missing = "its eyes show different frames";
            if (!missing.empty()) break;
            frame = image->frame;
            pictures.push_back(withRoom(image->picture));
        }
        if (!missing.empty()) {
            console.warning(fmt::format("no picture of output {}: {}", tile.name, missing));
            continue;
        }
        for (const auto& picture : pictures) starts.push_back(picture.data());
        Picture picture = Picture::filled(maker->widthPx(), maker->heightPx(), 0, 0, 0);
        dropAlpha(maker->draw(starts), picture.rgb.size() / 3, picture.rgb.data());
        if (auto ok = writeFile(pathOf(folder, tile), encodePng(picture, frame)); !ok) return ok;
    }
    return {};
}

}  // namespace tessera
