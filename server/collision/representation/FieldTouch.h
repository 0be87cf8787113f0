/// Which triangles of a height field meet those of another body? For the queries of this folder.
///
/// The other body's parts are walked down in the field's frame. Whether the field reaches a part is told by a few
/// entries of its pyramid, which the part's coordinates name; so what is small costs little on a field of any size, and
/// nothing of the field is walked. Large triangles of the other body go down the pyramid, with their planes and edges
/// as separating axes.
#pragma once

#include <optional>
#include <vector>

#include "server/collision/mesh/QueryWork.h"
#include "server/collision/representation/FieldParts.h"
#include "server/collision/representation/PairDecider.h"

namespace tessera {

/// How the other body lies in the field's frame, and what decides.
struct FieldTouchFrame {
    Affine3d a_T_b;
    bool fieldIsA;
    Affine3d field_T_other;  ///< a_T_b, or about its inverse
    Vec3d slack;  ///< by how much that is wrong at most for points of the other that touch the field; 0 for a_T_b

    /// Nothing where the field is B and a_T_b has no inverse worth the name: it flattens, or nearly.
    [[nodiscard]] static std::optional<FieldTouchFrame> make(const HeightField& field, bool fieldIsA,
                                                             const Affine3d& a_T_b, const Box& otherBounds);
};

class FieldTouch {
public:
    enum class For { kAny, kAll };
    /// `other`: in the field's frame; `otherBounds`: in its own.
    FieldTouch(const HeightField& field, const BodyParts& other, const Box& otherBounds, const FieldTouchFrame& frame,
               For what, QueryWork& work)
        : field_(field),
          other_(other),
          frame_(frame),
          any_(what == For::kAny),
          work_(work),
          candidates_(frame.fieldIsA ? field.bounds() : otherBounds, frame.fieldIsA ? otherBounds : field.bounds(),
                      frame.a_T_b) {}
    FieldTouch(const FieldTouch&) = delete;
    FieldTouch& operator=(const FieldTouch&) = delete;

    /// False: the work was exhausted.
    bool run();
    /// Faces of A and of B, as found.
    [[nodiscard]] std::vector<FacePair>& pairs() { return pairs_; }

private:
    /// A triangle of the other body.
    struct Face {
        std::uint32_t number;
        Triangle own, here;  ///< in its frame, in the field's
        Box box;             ///< in the field's
        struct Axis {
            Vec3d n;
            double low, high;  ///< of the triangle along it, from its first corner; rounding is in it
        };
        std::array<Axis, 4> axes;
        unsigned axisCount = 0;
    };
    [[nodiscard]] bool done() const { return any_ && !pairs_.empty(); }
    /// These are false where the work is exhausted.
    bool look();
    bool consider(const PartBoxes& boxes);
    bool meetFace(std::uint32_t number);
    bool walk(Face& face, std::size_t level, const HeightField::Cells& cells);
    bool eachCell(const Face& face, const HeightField::Cells& cells);
    void meetCell(const Face& face, std::uint32_t column, std::uint32_t row);
    void addAxes(Face& face) const;
    [[nodiscard]] bool separated(const Face& face, const HeightField::Cells& cells, double low, double high) const;

    struct Open {
        double depth;
        std::uint32_t part;
        bool leaf;
    };

    const HeightField& field_;
    const BodyParts& other_;
    const FieldTouchFrame& frame_;
    bool any_;
    QueryWork& work_;
    std::vector<Open> open_;
    PairDecider candidates_;
    std::vector<FacePair> pairs_;
};

/// How deep a box reaches into the heights below it; below 0 where it meets none. Looks at sixteen blocks at most.
[[nodiscard]] double depthInHeights(const HeightField& field, const Box& box);

/// The finest level of which sixteen blocks hold those cells.
[[nodiscard]] std::size_t levelFor(const HeightField& field, const HeightField::Cells& cells);

/// Of the blocks of a level that hold some cells: found(range of heights, those of the cells that it holds).
template <typename Found>
void eachBlock(const HeightField& field, std::size_t levelIndex, const HeightField::Cells& cells, Found&& found) {
    const HeightField::Level& level = field.levels()[levelIndex];
    const auto within = [](const GridAxis::Cells& of, std::uint32_t block, std::uint32_t size) {
        return GridAxis::Cells{std::max(of.first, block * size), std::min(of.end, (block + 1) * size)};
    };
    for (std::uint32_t r = cells.rows.first / level.cellRows; r <= (cells.rows.end - 1) / level.cellRows; ++r)
        for (std::uint32_t c = cells.columns.first / level.cellColumns;
             c <= (cells.columns.end - 1) / level.cellColumns; ++c)
            if (!found(field.range(level, c, r), HeightField::Cells{within(cells.columns, c, level.cellColumns),
                                                                    within(cells.rows, r, level.cellRows)}))
                return;
}

}  // namespace tessera
