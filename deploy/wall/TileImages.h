/// The images that the clients of a run leave in DIR/tiles/TILE: NNNNNN.png per frame (or for the last), and
/// shown.frame, which outlives its client.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/Error.h"
#include "common/image/Picture.h"

namespace tessera {

class TileImages {
public:
    /// `folder` holds one folder per tile.
    explicit TileImages(std::string folder) : folder_(std::move(folder)) {}

    /// Removes the images of earlier runs, so that none is taken for one of this run. Other files stay.
    [[nodiscard]] Expected<void> clear() const;

    struct Image {
        std::uint64_t frame = 0;
        Picture picture;
    };
    /// What the tile showed last, whether its client has left a file or died; nothing when it has never shown anything.
    /// kBadInput: a file that is not an image.
    [[nodiscard]] Expected<std::optional<Image>> last(const std::string& tile) const;

    /// The numbers of the frames that are there as files, ascending.
    [[nodiscard]] std::vector<std::uint64_t> frames(const std::string& tile) const;
    [[nodiscard]] Expected<Image> read(const std::string& tile, std::uint64_t frame) const;

private:
    [[nodiscard]] std::string pathOf(const std::string& tile, std::uint64_t frame) const;

    std::string folder_;
};

}  // namespace tessera
