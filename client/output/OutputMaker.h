/// What a projector or monitor gets: the whole way from the pictures of a tile, or of both eyes' tiles, to the picture
/// of an output.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/output/OutputTable.h"
#include "common/base/Error.h"
#include "common/wall/Wall.h"

namespace tessera {

/// One output of a wall. One thread at a time.
class OutputMaker {
public:
    /// Of this tile; of the left eye's where a host draws both for one output. kBadInput: a blend picture cannot be
    /// read. kNotFound: no such tile, or the right eye's of such a pair.
    [[nodiscard]] static Expected<OutputMaker> make(const Wall& wall, const std::string& tile);

    /// Whose pictures it takes: one tile, or the left eye's and the right one's.
    [[nodiscard]] const std::vector<std::string>& tiles() const { return tiles_; }
    [[nodiscard]] int fromWidthPx() const { return fromWidthPx_; }
    [[nodiscard]] int fromHeightPx() const { return fromHeightPx_; }
    [[nodiscard]] int widthPx() const { return widthPx_; }
    [[nodiscard]] int heightPx() const { return heightPx_; }
    [[nodiscard]] StereoPacking packing() const { return packing_; }
    /// Bytes of its table; 0: there is none.
    [[nodiscard]] std::size_t tableBytes() const { return table_ ? table_->size() : 0; }

    /// A picture of each of `tiles`, of the tile's size, rows without gaps. Returns the output's picture in the same
    /// form, until the next call; that may be one of those given.
    [[nodiscard]] const std::uint8_t* draw(std::span<const std::uint8_t* const> pictures);

private:
    OutputMaker() = default;
    [[nodiscard]] const std::uint8_t* tabled(const std::uint8_t* picture, std::vector<std::uint8_t>& room) const;

    std::vector<std::string> tiles_;
    int fromWidthPx_ = 0, fromHeightPx_ = 0, eyeWidthPx_ = 0, eyeHeightPx_ = 0, widthPx_ = 0, heightPx_ = 0;
    StereoPacking packing_ = StereoPacking::kNone;
    bool swapEyes_ = false;
    std::optional<OutputTable> table_;  ///< none: an eye's picture is the tile's
    std::vector<std::uint8_t> eyes_[2], packed_;
};

/// The tiles that stand for the wall's outputs: all but the right eyes that share the left ones'.
[[nodiscard]] std::vector<Tile> outputsOf(const Wall& wall, const std::vector<Tile>& tiles);

}  // namespace tessera
