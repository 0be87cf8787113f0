/// Which texels of an ASTC block share endpoints: Khronos Data Format Specification 1.3, section 23.21.
#pragma once

#include <cstdint>

namespace tessera {

/// One of the 1024 patterns of two, three or four parts, as blocks in two dimensions have them.
class AstcPartition {
public:
    /// `small`: the block has fewer than 31 texels.
    AstcPartition(unsigned pattern, unsigned parts, bool small);
    /// The part, from 0 on, of the texel in this column and row.
    [[nodiscard]] unsigned at(unsigned x, unsigned y) const;

private:
    unsigned parts_, scale_, hash_;
    unsigned acrossX_[4] = {}, acrossY_[4] = {};
};

}  // namespace tessera
