#include "deploy/wall/TileImages.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <filesystem>

#include "common/image/SharedFrame.h"

namespace tessera {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kLargestPng = std::size_t{2} << 30;
constexpr const char* kShown = "shown.frame";

/// The frame's number where a file is called NNNNNN.png (more digits from a million on).
std::optional<std::uint64_t> frameOf(const fs::path& file) {
    const std::string stem = file.stem().string();
    std::uint64_t frame = 0;
    const auto [end, error] = std::from_chars(stem.data(), stem.data() + stem.size(), frame);
    if (file.extension() != ".png" || stem.size() < 6 || error != std::errc() || end != stem.data() + stem.size())
        return std::nullopt;
    return frame;
}

}  // namespace

std::string TileImages::pathOf(const std::string& tile, std::uint64_t frame) const {
    return fmt::format("{}/{}/{:06}.png", folder_, tile, frame);
}

Expected<void> TileImages::clear() const {
    std::error_code error;
    std::vector<fs::path> folders;
    for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
        std::error_code ignored;
        if (it->is_directory(ignored) && !it->is_symlink(ignored)) folders.push_back(it->path());
    }
    for (const fs::path& folder : folders) {
        std::vector<fs::path> old;
        for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
            if (frameOf(it->path()) || it->path().filename() == kShown) old.push_back(it->path());
        }
        for (const fs::path& path : old) {
            if (!fs::remove(path, error) && error) {
                return fail(ErrorCode::kFailed, fmt::format("{}: an image of an earlier run cannot be removed: {}",
                                                            path.string(), error.message()));
            }
        }
        fs::remove(folder, error);  // unless something else is in it
    }
    return {};
}

std::vector<std::uint64_t> TileImages::frames(const std::string& tile) const {
    std::vector<std::uint64_t> numbers;
    std::error_code error;
    for (fs::directory_iterator it(fs::path(folder_) / tile, error), end; !error && it != end; it.increment(error)) {
        if (const std::optional<std::uint64_t> frame = frameOf(it->path())) numbers.push_back(*frame);
    }
    std::sort(numbers.begin(), numbers.end());
    return numbers;
}

Expected<TileImages::Image> TileImages::read(const std::string& tile, std::uint64_t frame) const {
    const std::string path = pathOf(tile, frame);
    const Expected<Bytes> bytes = readFile(path, kLargestPng);
    if (!bytes) return tl::unexpected(bytes.error());
    Expected<DecodedPng> png = decodePng(*bytes);
    if (!png) return failWith(path, png.error());
    return Image{.frame = frame, .picture = std::move(png->picture)};
}

Expected<std::optional<TileImages::Image>> TileImages::last(const std::string& tile) const {
    const std::vector<std::uint64_t> numbers = frames(tile);
    std::optional<Image> best;
    if (!numbers.empty()) {
        Expected<Image> image = read(tile, numbers.back());
        if (!image) return tl::unexpected(image.error());
        best = std::move(*image);
    }
    const std::string path = (fs::path(folder_) / tile / kShown).string();
    Expected<ShownImage> shown = readSharedFrame(path);
    if (!shown && shown.error().code != ErrorCode::kNotFound) return failWith(path, shown.error());
    if (shown && (!best || shown->frame > best->frame))
        best = Image{.frame = shown->frame, .picture = std::move(shown->picture)};
    return best;
}

}  // namespace tessera
