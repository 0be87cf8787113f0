/// Who looks at a wall, from where, and how large things are on their screens.
#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "common/scene/ChildChoice.h"
#include "common/wall/View.h"

namespace tessera {

/// Users that tiles are drawn for, by the bytes of Node::levels. Not thread-safe.
class Lookers {
public:
    explicit Lookers(const Wall& wall);

    struct Looker {
        Vec3d head = Vec3d::Zero();  ///< between the eyes, world
        double pixels =
            0;  ///< of what is as large as it is far away, straight before the eye, on the finest of the user's screens
        double coarser = 1;  ///< DetailStep::coarser
    };
    /// Whether any of them is another than before.
    [[nodiscard]] bool lookFrom(const View& view);

    [[nodiscard]] const Looker& operator[](std::size_t user) const { return lookers_[user]; }
    /// Bytes with users, ascending.
    [[nodiscard]] std::span<const std::size_t> bytes() const { return used_; }
    [[nodiscard]] std::span<const std::size_t> usersOf(std::size_t byte) const { return usersOf_[byte]; }
    /// The byte itself, or the one that stands for it where the wall has no such user. Wants a byte with users.
    [[nodiscard]] std::size_t byteFor(std::size_t byte) const {
        return usersOf_[byte].empty() ? used_[byte % used_.size()] : byte;
    }

private:
    Wall wall_;
    std::vector<std::vector<std::size_t>> screensOf_;            ///< by user: those that tiles draw for them
    std::array<std::vector<std::size_t>, kLevelUsers> usersOf_;  ///< by byte: those who count
    std::vector<std::size_t> used_;                              ///< bytes with users
    std::vector<Looker> lookers_;                                ///< by user
};

}  // namespace tessera
