/// Faces, lines and points of foreign meshes that cannot be shown, because a vertex of theirs does not exist or stands
/// nowhere: they are left out, and the rest is shown.
#pragma once

#include <cmath>
#include <cstdint>
#include <span>
#include <string>

#include "common/geometry/Mesh.h"

namespace tessera {

/// What was left out of one mesh; for a note.
class LeftOutParts {
public:
    /// What numbers of vertices say: kSigned, the file's may be negative; kOrNone, the greatest stands for what is
    /// none.
    enum class Numbers { kPlain, kSigned, kOrNone };
    /// `mesh`: what people call it; `parts`: "triangles".
    LeftOutParts(std::string mesh, const char* parts, Numbers numbers = Numbers::kPlain)
        : mesh_(std::move(mesh)), parts_(parts), numbers_(numbers) {}

    /// Whether the next part, of these vertices, can stay. `stands(vertex)` is asked of those that exist alone.
    template <typename Stands>
    bool keeps(std::span<const std::uint32_t> corners, std::size_t vertices, Stands&& stands) {
        const std::size_t number = seen_++;
        for (const std::uint32_t corner : corners)
            if (corner >= vertices || !stands(corner)) {
                if (leftOut_++ == 0) rememberFirst(number, corner, vertices);
                return false;
            }
        return true;
    }
    /// "MESH: 2 of 40 triangles are left out; the first, number 7, names vertex 9 of 4"; empty: all are there. Numbers
    /// begin at 0.
    [[nodiscard]] std::string text() const;

private:
    void rememberFirst(std::size_t number, std::uint32_t corner, std::size_t vertices);

    std::string mesh_;
    const char* parts_;
    Numbers numbers_;
    std::size_t seen_ = 0, leftOut_ = 0;
    std::string first_;
};

inline bool stands(const float* position) {
    return std::isfinite(position[0]) && std::isfinite(position[1]) && std::isfinite(position[2]);
}

/// Leaves out what cannot be shown, and says so, or is silent. Vertices that stand nowhere are moved to one that does:
/// nothing names them any more, and they extend nothing. Of points, each in `positions`, vertices are left out.
[[nodiscard]] std::string keepSoundParts(MeshData& mesh, const std::string& name);

}  // namespace tessera
